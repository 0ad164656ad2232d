// A head of hair that touches itself and the head, which turns (thesis 4.7.2, Fig. 4.8).
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "study/framework/scene_cases.h"
#include "slender_sim/geometry/rotation.h"
#include "study/framework/cpu_clock.h"

namespace slender::study {

void runHair(StudyContext& context)
{
  const int strands = context.quick() ? 60 : 1080, steps = context.quick() ? 40 : 30, looks = 10;
  context.progress(0, steps, "reading the scene");
  Simulation scene = packageScene("hair", {"generate.0.hair.strands=" + std::to_string(strands)});
  scene.setThreads(1);
  int vertices = 0;
  for (const RodState& rod : scene.state().rods)
    vertices += static_cast<int>(rod.x.cols());
  Plot& picture = addPicture(context, "hair", "Head of hair (scene hair), every twentieth wisp", "y [m]", "z [m]");
  const auto show = [&](const std::string& label, double right) {
    for (std::size_t r = 0; r < scene.state().rods.size(); r += context.quick() ? 1 : 20)
      draw(picture, label, scene.state().rods[r].x, false, {{-1, 0, 0}, {0, 0, 1}}, {0, right, 0});
  };
  show("at first", 0);

  const Pose start = scene.state().obstacles[0];
  const double step = scene.config().time.step;
  double seconds = 0, slowest = 0, clearance = std::numeric_limits<double>::infinity(), fastest = 0;
  int iterations = 0;
  std::size_t contacts = 0;
  for (int k = 1; k <= steps; ++k)
  {
    context.progress(k, steps, std::to_string(contacts) + " contacts");
    SceneInputs inputs = scene.defaultInputs();
    const double turn = 0.5 * (1 - std::cos(2 * M_PI * k * step / 0.6));   // shakes: a radian to and fro in 0.6 s
    inputs.obstacles[0].X_WG.orientation = fromRotationVector(Eigen::Vector3d(0, 0, turn)) * start.orientation;
    inputs.obstacles[0].velocity.reset();
    const double begin = threadSeconds();
    const StepReport report = scene.step(inputs);
    const double took = threadSeconds() - begin;
    require(report, "hair, step " + std::to_string(k));
    seconds += took;
    slowest = std::max(slowest, took);
    iterations += report.iterations;
    contacts = std::max(contacts, scene.world().contacts().size());
    for (const RodState& rod : scene.state().rods)
      fastest = std::max(fastest, isFinite(rod) ? fastestNode(rod) : std::numeric_limits<double>::infinity());
    if (k % looks == 0)
      clearance = std::min(clearance, bruteForceClearance(groupOf(scene)));
    if (k == steps / 2)
      show("turned after " + std::to_string(static_cast<int>(1e3 * k * step)) + " ms", 0.6);
  }
  show("after " + std::to_string(static_cast<int>(1e3 * steps * step)) + " ms", 1.2);
  const auto row = [&](const char* quantity) -> Row& {
    return context.row().set("vertices", vertices).set("steps", steps).set("quantity", quantity);
  };
  row("seconds per step, one thread")
      .set("mean", seconds / steps)
      .set("slowest", slowest)
      .set("iterations_per_step", static_cast<double>(iterations) / steps)
      .set("contacts", static_cast<double>(contacts))
      .set("fastest_m_s", fastest)
      .set("least_gap_um", 1e6 * clearance);
  row("largest penetration [m]").check(std::max(0.0, -clearance), 0, 1e-9, "all pairs, brute force");
  row("steps with a number that is not finite").check(std::isfinite(fastest) ? 0 : 1, 0, 0.5, "none");
  context.metric("seconds_per_step", seconds / steps);
  context.metric("least_gap", clearance);
}

const StudyRegistration kHairRegistration{
    "hair", "54,000 vertices of hair on a head that turns: time per step, worst gap", runHair};

}   // namespace slender::study
