// Localised helical buckling through a scene file: the shipped scene and other rods, as `simulate` runs them
// (thesis 4.7.1, Fig. 4.3).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "study/framework/scene_cases.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// A rod, and the smooth solution of its clamped-clamped boundary-value problem (helix_summary.csv: phi0_finite,
/// M3_finite).
struct HelixCase
{
  const char* name;
  double length, alpha, beta, turns, shortening, peak, moment;
};
constexpr HelixCase kShipped{"shipped", 9.29, 1.345, 0.789, 27, 0.3, 0.9185498494, 14.25201565};
constexpr HelixCase kHelices[] = {{"D02", 9.29, 1.345, 0.789, 27, 0.2, 0.5610876374, 14.3127407},
                                  {"D01", 9.29, 1.345, 0.789, 27, 0.1, 0.2770050604, 14.36210465},
                                  {"short", 4, 1, 1, 5, 0.4, 0.8641947329, 7.431150286}};

/// What the scene ends with.
struct Reached
{
  double peak = 0, moment = 0;
  double speed = 0;   ///< of the fastest node [m/s]
};

std::string exactText(double value)
{
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

/// Values of the shipped scene that make it the scene of another rod.
std::vector<std::string> overridesOf(const HelixCase& h, int edges)
{
  return {"rods.0.centerline.straight.to=[" + exactText(h.length) + ", 0, 0]",
          "rods.0.centerline.straight.edges=" + std::to_string(edges),
          "rods.0.initial_twist=" + exactText(2 * M_PI * h.turns),
          "rods.0.material.bend_modulus=" + exactText(h.alpha),
          "rods.0.material.twist_modulus=" + exactText(h.beta),
          "rods.0.grasps.right.motion.table.1.1=" + exactText(-h.shortening)};
}

/// The largest angle between the rod and its axis, by a parabola through the three steepest edges. The angle does not
/// depend on where along the rod the helix sits nor on how it is turned about the axis, which both cost next to no
/// energy.
double peakOf(const Eigen::Matrix3Xd& x)
{
  const int edges = static_cast<int>(x.cols()) - 1;
  std::vector<double> phi(edges);
  for (int j = 0; j < edges; ++j)
    phi[j] = std::acos(std::clamp((x.col(j + 1) - x.col(j)).normalized().x(), -1.0, 1.0));
  const int top = static_cast<int>(std::max_element(phi.begin() + 1, phi.end() - 1) - phi.begin());
  const double slope = 0.5 * (phi[top + 1] - phi[top - 1]), bow = phi[top + 1] - 2 * phi[top] + phi[top - 1];
  return bow < 0 ? phi[top] - 0.5 * slope * slope / bow : phi[top];
}

Reached simulate(const std::vector<std::string>& overrides)
{
  Simulation simulation = packageScene("helical_buckling", overrides);
  const long steps = stepsUntil(simulation.config().time.duration, simulation.config().time.step);
  SceneInputs inputs;
  for (long k = 0; k < steps; ++k)
  {
    simulation.defaultInputs(inputs);
    const StepReport report = simulation.step(inputs);
    if (!report.ok)
      throw std::runtime_error("helical_scene: step " + std::to_string(k) + ": " + report.message);
  }
  const RodState& rod = simulation.state().rods[0];
  return {peakOf(rod.x), std::abs(simulation.state().wrenches[0].torque.x()), rod.v.colwise().norm().maxCoeff()};
}

struct Worst
{
  double peak = 0, moment = 0;
};

void check(StudyContext& context, const std::string& name, int edges, const HelixCase& h, const Reached& r,
           Worst& worst)
{
  const double peak_error = r.peak / h.peak - 1, moment_error = r.moment / h.moment - 1;
  // The bounds are those that were asked for at n = 200. The error falls with 1/n^2.
  Row& peak = context.row();
  peak.set("case", name)
      .set("n", edges)
      .set("quantity", "peak [rad]")
      .set("relative_error", peak_error)
      .set("speed", r.speed);
  peak.check(r.peak, h.peak, 0.005 * h.peak, "helix_summary.csv, phi0_finite");
  Row& moment = context.row();
  moment.set("case", name)
      .set("n", edges)
      .set("quantity", "moment [N m]")
      .set("relative_error", moment_error)
      .set("speed", r.speed);
  moment.check(r.moment, h.moment, 0.001 * h.moment, "helix_summary.csv, M3_finite");
  worst.peak = std::max(worst.peak, std::abs(peak_error));
  worst.moment = std::max(worst.moment, std::abs(moment_error));
}

}   // namespace

void runHelicalScene(StudyContext& context)
{
  constexpr int kEdges = 200;
  const int total = context.quick() ? 2 : 8;
  int done = 0;
  Worst worst;
  if (!context.quick())
  {
    context.progress(done++, total, "the shipped scene");
    check(context, "shipped, as it is", 400, kShipped, simulate({}), worst);
  }
  context.progress(done++, total, "the shipped scene with 200 edges");
  const Reached shipped = simulate({"rods.0.centerline.straight.edges=200"});
  check(context, "shipped", kEdges, kShipped, shipped, worst);
  for (const HelixCase& h : kHelices)
  {
    if (context.quick() && std::string(h.name) != "short")
      continue;
    context.progress(done++, total, h.name);
    check(context, h.name, kEdges, h, simulate(overridesOf(h, kEdges)), worst);
  }
  context.metric("worst_peak_error", worst.peak);
  context.metric("worst_moment_error", worst.moment);
  if (context.quick())
    return;

  // Turned frames: natural twist that winds the material frames up but changes no strain.
  context.progress(done++, total, "frames turned by 40 rad");
  const Reached turned = simulate({"rods.0.centerline.straight.edges=200", "rods.0.rest_twist=-40"});
  Row& frames = context.row();
  frames.set("case", "shipped, frames turned")
      .set("n", kEdges)
      .set("quantity", "peak [rad]")
      .set("speed", turned.speed);
  // The strains are the same up to round-off, which the 2,000 steps hardly amplify (3e-14 was measured).
  frames.check(turned.peak, shipped.peak, 1e-9 * shipped.peak, "the same rod with its frames as they are");
  context.metric("frames_matter", std::abs(turned.peak / shipped.peak - 1));

  context.progress(done++, total, "the thesis's curvature");
  const Reached tangent = simulate({"rods.0.centerline.straight.edges=200", "rods.0.curvature=tangent"});
  context.row()
      .set("case", "shipped, curvature: tangent")
      .set("n", kEdges)
      .set("quantity", "peak [rad]")
      .set("measured", tangent.peak)
      .set("relative_error", tangent.peak / kShipped.peak - 1)
      .set("speed", tangent.speed);
  context.metric("tangent_peak_error", std::abs(tangent.peak / kShipped.peak - 1));
  context.note(
      "The row of the thesis's curvature (curvature: tangent) shows what scenes gave before isotropic sections had a "
      "default of their own.");
}

const StudyRegistration kHelicalSceneRegistration{
    "helical_scene",
    "the shipped scene of the localised helix and three more, as simulate runs them, against the smooth solutions",
    runHelicalScene};

}   // namespace slender::study
