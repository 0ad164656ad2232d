// A chain of rings drawn taut: hooked links hold, and part when one of them is cut or bends open (thesis 4.7.2,
// Fig. 4.7).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "study/framework/scene_cases.h"

namespace slender::study {
namespace {

using Eigen::Vector3d;

/// How often one ring winds through another [-]; open ones closed by a straight edge. Exact for polylines (solid
/// angles).
int linkingNumber(const RodState& a, const RodState& b)
{
  double sum = 0;
  const auto next = [](const RodState& r, Eigen::Index i) { return r.x.col((i + 1) % r.x.cols()); };
  for (Eigen::Index i = 0; i < a.x.cols(); ++i)
    for (Eigen::Index j = 0; j < b.x.cols(); ++j)
    {
      const Vector3d r13 = b.x.col(j) - a.x.col(i), r14 = next(b, j) - a.x.col(i), r23 = b.x.col(j) - next(a, i),
                     r24 = next(b, j) - next(a, i);
      const Vector3d sides[4] = {r13.cross(r14), r14.cross(r24), r24.cross(r23), r23.cross(r13)};
      double angle = 0;
      for (int k = 0; k < 4; ++k)
      {
        const double size = sides[k].norm() * sides[(k + 1) % 4].norm();
        angle += size > 0 ? std::asin(std::clamp(sides[k].dot(sides[(k + 1) % 4]) / size, -1.0, 1.0)) : 0.0;
      }
      const double handed = (next(b, j) - b.x.col(j)).cross(next(a, i) - a.x.col(i)).dot(r13);
      sum += handed > 0 ? angle : handed < 0 ? -angle : 0.0;
    }
  return static_cast<int>(std::lround(std::abs(sum / (4 * M_PI))));
}

/// Neighbours that are hooked into each other.
int hooked(const std::vector<RodState>& links)
{
  int count = 0;
  for (std::size_t k = 0; k + 1 < links.size(); ++k)
    count += linkingNumber(links[k], links[k + 1]);
  return count;
}

/// Cuts a ring between its last node and its first: the edge there is gone, all else stays as it is.
void cut(GroupSetup& g, int rod)
{
  auto open = std::make_shared<RodModel>(*g.model.rods[rod].model);
  const int edges = open->edges() - 1;
  open->closed = false;
  RodState& state = g.state.rods[rod];
  for (Eigen::VectorXd* perEdge :
       {&open->rest_length, &open->spin_inertia, &open->stretch_modulus, &open->radius_a, &open->radius_b, &state.spin})
    if (perEdge->size() > 0)
      perEdge->conservativeResize(edges);
  state.d1.conservativeResize(3, edges);
  state.twist[0] = state.twist[edges] = 0;
  state.forgetHistory();
  g.model.rods[rod].model = open;
}

void drawChain(Plot& picture, const std::string& label, const std::vector<std::shared_ptr<const RodModel>>& models,
               const std::vector<RodState>& links, double lower)
{
  for (std::size_t k = 0; k < links.size(); ++k)
    draw(picture, label, links[k].x, models[k]->closed, {{0.5, 1, -0.3}, {0, 0, 1}}, {0, 0, -lower});
}

std::string pullTable(double from, double to, double way)
{
  return "generate.0.chain.end_motion={table: [[0, 0, 0, 0, 0, 0, 0, 1], [" + std::to_string(from) +
         ", 0, 0, 0, 0, 0, 0, 1], [" + std::to_string(to) + ", " + std::to_string(way) + ", 0, 0, 0, 0, 0, 1]]}";
}

/// Closed rings, drawn taut; then the one in the middle is cut.
void cutChain(StudyContext& context, int links, int edges, double way, Plot& picture)
{
  Simulation scene =
      packageScene("chain", {"generate.0.chain.opening=0", "generate.0.chain.links=" + std::to_string(links),
                             "generate.0.chain.edges=" + std::to_string(edges), pullTable(0.3, 1.3, way)});
  const double step = scene.config().time.step, pulled = 1.6;
  double penetration = 0, weight = 0;
  while (scene.state().time < pulled - 0.5 * step)
  {
    context.progress(static_cast<int>(1e3 * scene.state().time), 1600, "closed links");
    require(scene.step(scene.defaultInputs()), "closed links");
    if (scene.state().steps % 10 == 0)
      penetration = std::max(penetration, -bruteForceClearance(groupOf(scene)));
  }
  GroupSetup g = groupOf(scene);
  std::vector<std::shared_ptr<const RodModel>> models;
  for (const WorldModel::Rod& rod : g.model.rods)
    models.push_back(rod.model);
  for (const auto& model : models)
    weight += model->totalMass() * scene.config().gravity.norm();
  drawChain(picture, "drawn taut", models, g.state.rods, 0);
  const auto row = [&](const char* quantity) -> Row& {
    return context.row().set("case", "closed links, one cut").set("n", edges).set("quantity", quantity);
  };
  row("hooked pairs when drawn taut")
      .set("tension", -scene.grasps().wrench(1).force.x())
      .check(hooked(g.state.rods), links - 1, 0.5, "as built: no link has passed through another");
  row("weight on the ends [N]")
      .check(-scene.grasps().wrench(0).force.z() - scene.grasps().wrench(1).force.z(), weight, 0.01 * weight,
             "rho A l g");

  const int middle = links / 2;
  cut(g, middle);
  models[middle] = g.model.rods[middle].model;
  World world = g.world(scene.config().time);
  double parted = 0;
  std::vector<double> looks = {0.02, 0.1, 0.3};
  for (int k = 1; k * step < 0.3 + 0.5 * step; ++k)
  {
    require(world.step(g.state, g.inputs), "cut link");
    penetration = std::max(penetration, -bruteForceClearance(g));
    if (parted == 0 && hooked(g.state.rods) < links - 1)
      parted = k * step;
    for (std::size_t look = 0; look < looks.size(); ++look)
      if (std::abs(k * step - looks[look]) < 0.5 * step)
        drawChain(picture, std::to_string(static_cast<int>(1e3 * looks[look])) + " ms after the cut", models,
                  g.state.rods, 0.25 * static_cast<double>(look + 1));
  }
  const int left = linkingNumber(g.state.rods[middle - 1], g.state.rods[middle]),
            right = linkingNumber(g.state.rods[middle], g.state.rods[middle + 1]);
  row("hooks that hold at the cut link's weaker side")
      .set("parted_after", parted)
      .check(std::min(left, right), 0, 0.5, "the chain parts there");
  row("hooked pairs elsewhere").check(hooked(g.state.rods) - left - right, links - 3, 0.5, "all others hold");
  row("largest penetration [m]").check(std::max(0.0, penetration), 0, 1e-9, "all pairs, brute force");
  context.metric("tension_when_cut", -scene.grasps().wrench(1).force.x());
  context.metric("parted_after", parted);
}

/// The scene itself: open links, drawn apart until they bend open.
void openChain(StudyContext& context, Plot& picture)
{
  Simulation scene = packageScene("chain");
  const int links = static_cast<int>(scene.state().rods.size());
  std::vector<std::shared_ptr<const RodModel>> models;
  for (int k = 0; k < links; ++k)
    models.push_back(std::make_shared<RodModel>(scene.rodModel(k)));
  double strongest = 0, broke = 0, penetration = 0, drawn = 0;
  const double start = scene.state().rods.back().grasps[0].X_WG.position.x();
  double extension = 0;
  while (scene.state().time < 4.0)
  {
    context.progress(static_cast<int>(1e3 * scene.state().time), 4000, "open links");
    require(scene.step(scene.defaultInputs()), "open links");
    strongest = std::max(strongest, -scene.grasps().wrench(1).force.x());
    if (scene.state().steps % 20 == 0)
      penetration = std::max(penetration, -bruteForceClearance(groupOf(scene)));
    if (broke == 0 && hooked(scene.state().rods) < links - 1)
    {
      broke = scene.state().time;
      extension = scene.state().rods.back().grasps[0].X_WG.position.x() - start;
    }
    if ((drawn == 0 && scene.state().time > 1.5) || (drawn == 1 && scene.state().time > 3.4) ||
        (drawn == 2 && broke > 0 && scene.state().time > broke + 0.05))
      drawChain(picture,
                scene.state().time < 1.6 ? "hanging"
                : broke > 0              ? "50 ms after it broke"
                                         : "about to break",
                models, scene.state().rods, 0.3 * drawn++);
  }
  const int after = hooked(scene.state().rods);
  const auto row = [&](const char* quantity) -> Row& {
    return context.row()
        .set("case", "open links (scene)")
        .set("n", scene.rodModel(0).edges())
        .set("quantity", quantity);
  };
  row("break").set("time", broke).set("tension", strongest).set("extension", extension).set("hooked_after", after);
  row("largest penetration [m]").check(std::max(0.0, penetration), 0, 1e-9, "all pairs, brute force");
  context.metric("break_tension", strongest);
  context.metric("hooked_after_break", after);
}

}   // namespace

void runChain(StudyContext& context)
{
  Plot& closed = addPicture(context, "chain_cut", "Chain of closed links, of which one is cut", "right [m]", "up [m]");
  if (context.quick())
  {
    cutChain(context, 5, 20, 0.21, closed);
    return;
  }
  cutChain(context, 7, 30, 0.3, closed);
  openChain(context,
            addPicture(context, "chain_open", "Chain of open links drawn apart (scene chain)", "right [m]", "up [m]"));
}

const StudyRegistration kChainRegistration{
    "chain", "hooked links hold while the chain is drawn taut, and part when one is cut or bends open", runChain};

}   // namespace slender::study
