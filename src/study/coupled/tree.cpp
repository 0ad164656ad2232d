// A tree in a storm: branches that rigid bodies join, 2,158 vertices (thesis 4.7.3, Fig. 4.10).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "study/framework/scene_cases.h"
#include "study/framework/cpu_clock.h"

namespace slender::study {
namespace {

using Eigen::Vector3d;

int verticesOf(const Simulation& scene)
{
  int count = 0;
  for (const RodState& rod : scene.state().rods)
    count += static_cast<int>(rod.x.cols());
  return count;
}

void drawTree(Plot& picture, const std::string& label, const Simulation& scene, const Vector3d& shift)
{
  for (const RodState& rod : scene.state().rods)
    draw(picture, label, rod.x, false, {}, shift);
}

/// Weight, and the wind's drag, of the whole tree where it stands; moments about the root.
Wrench loadOn(const Simulation& scene)
{
  const SceneConfig& config = scene.config();
  const Vector3d root = scene.state().rods[0].grasps[0].X_WG.position;
  Wrench sum;
  const auto add = [&](const Vector3d& at, const Vector3d& force) {
    sum.force += force;
    sum.torque += (at - root).cross(force);
  };
  for (std::size_t r = 0; r < scene.state().rods.size(); ++r)
  {
    const RodModel& m = scene.rodModel(static_cast<int>(r));
    for (int i = 0; i < m.nodes(); ++i)
      add(scene.state().rods[r].x.col(i),
          m.mass[i] * config.gravity + (m.drag.size() > 0 ? m.drag[i] : 0.0) * config.wind);
  }
  for (std::size_t b = 0; b < config.bodies.size(); ++b)
    add(scene.state().bodies[b].X_WB.position, config.bodies[b].mass * config.gravity);
  return sum;
}

/// Farthest that a branch's tip is from where it is in another scene [m].
double tipsApart(const Simulation& scene, const Simulation& other)
{
  double most = 0;
  for (std::size_t r = 0; r < scene.state().rods.size(); ++r)
    most = std::max(most, (scene.state().rods[r].x.rightCols<1>() - other.state().rods[r].x.rightCols<1>()).norm());
  return most;
}

}   // namespace

void runTree(StudyContext& context)
{
  const int vertices = context.quick() ? 1000 : 2158;
  const auto tree = [](int count, bool windy, const char* start) {
    return packageScene("tree", {"generate.0.tree.vertices=" + std::to_string(count), std::string("start=") + start,
                                 windy ? "record.every=4" : "wind.velocity=[0, 0, 0]"});
  };
  context.progress(0, 3, "at rest");
  const Simulation calm = tree(vertices, false, "equilibrium"), bent = tree(vertices, true, "equilibrium");
  const auto row = [&](const char* quantity) -> Row& {
    return context.row().set("vertices", verticesOf(bent)).set("quantity", quantity);
  };
  const Wrench load = loadOn(bent), root = bent.grasps().wrench(0);
  row("force on the root less weight and wind [N]")
      .set("size", load.force.norm())
      .check((root.force - load.force).norm(), 0, 1e-4 * load.force.norm(),
             "balance at rest in the wind: through all joints");
  row("moment on the root less weight and wind [N m]")
      .set("size", load.torque.norm())
      .check((root.torque - load.torque).norm(), 0, 1e-4 * load.torque.norm(), "balance at rest in the wind");
  const double deflection = tipsApart(bent, calm);
  context.metric("tip_deflection", deflection);

  // the storm sets in
  Plot& picture = addPicture(
      context, "tree", "Tree (scene tree) as it grew, at rest in the wind, and as the storm sets in", "x [m]", "z [m]");
  drawTree(picture, "at rest in the wind", bent, {3.5, 0, 0});
  Plot& sway = context.plot("tree_sway", "Tree in a wind of 12 m/s: farthest tip from where it stands in the end",
                            "t [s]", "distance [m]");
  sway.log_x = sway.markers = false;
  Simulation storm = tree(vertices, true, "as_given");
  drawTree(picture, "grown", storm, {0, 0, 0});
  const double duration = context.quick() ? 0.5 : 8.0;
  double seconds = 0;
  bool finite = true;
  while (storm.state().time < duration - 1e-9)
  {
    context.progress(static_cast<int>(1e3 * storm.state().time), static_cast<int>(1e3 * duration), "storm");
    const SceneInputs inputs = storm.defaultInputs();
    const double start = threadSeconds();
    require(storm.step(inputs), "tree in wind");
    seconds += threadSeconds() - start;
    for (const RodState& rod : storm.state().rods)
      finite = finite && isFinite(rod);
    sway.at("farthest tip").x.push_back(storm.state().time);
    sway.at("farthest tip").y.push_back(tipsApart(storm, bent));
  }
  drawTree(picture, std::to_string(duration).substr(0, 3) + " s", storm, {7, 0, 0});
  const double per_step = 1e3 * seconds / static_cast<double>(storm.state().steps);
  row("storm")
      .set("time", duration)
      .set("ms_per_step", per_step)
      .set("finite", finite ? "yes" : "no")
      .set("from_rest", tipsApart(storm, bent));
  context.metric("ms_per_step", per_step);
  context.metric("ms_per_simulated_ms", per_step / (1e3 * storm.config().time.step));
  context.note("Thesis, table 4.1: 22 ms per step of 0.1 ms, 220 ms per simulated ms, on a 2.66 GHz Core 2 Duo.");
}

const StudyRegistration kTreeRegistration{
    "tree", "a tree of 2,158 vertices in wind: what its root carries, time per step", runTree};

}   // namespace slender::study
