#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/reference.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kGravity = 9.81, kDensity = 1000.0, kBoundMillimetres = 0.3;
constexpr int kNodesAtRest = 200;

struct Rod
{
  double radius, youngs_modulus;
  double x, z;   ///< tip of the exact inextensible elastica [m]
};

/// Evenly spaced nodes, or 200 nodes set closer near the clamp, where a soft rod bends within millimetres: s = u (0.4 +
/// 0.6 u), first edge 2 mm, last 8 mm.
Eigen::Matrix3Xd restNodes(bool graded)
{
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, kNodesAtRest);
  for (int i = 0; i < kNodesAtRest; ++i)
  {
    const double u = i / (kNodesAtRest - 1.0);
    nodes(0, i) = graded ? u * (0.4 + 0.6 * u) : u;
  }
  return nodes;
}

RodSetup clampedRod(const Rod& r, bool stretches, bool graded, double mass_damping)
{
  RodCase c = circularRod(1.0, r.radius, r.youngs_modulus, 0.3, kDensity, kNodesAtRest - 1);
  if (!stretches)
    c.stretch = std::max(c.stretch, 1e6 * c.linear_density * kGravity);
  c.mass_damping = mass_damping;
  RodSetup rod = shapedRod(c, restNodes(graded));
  rod.inputs.gravity = {0, 0, -kGravity};
  rod.hold(0, 0, true);
  return rod;
}

}   // namespace

void runRodsAtRest(StudyContext& context)
{
  const Rod rods[] = {{0.005, 1e7, 0.12285, -0.95089},
                      {0.002, 1e9, 0.66234, -0.69540},
                      {0.005, 1e9, 0.97903, -0.19047},
                      {0.001, 1e6, 0.00717, -0.99704}};
  double worst[2] = {0, 0};
  int done = 0;
  for (const Rod& r : rods)
    for (const bool stretches : {false, true})
      for (const int way : {0, 1, 2, 3})
      {
        const bool dynamic = way % 2 == 1, graded = way >= 2;
        if (stretches && way != 2)
          continue;
        context.progress(done++, 20, dynamic ? "settling" : "static");
        // Critically damped in the slowest mode, as in the cantilever study.
        const double gamma = 4 * kDensity * kGravity / (r.youngs_modulus * r.radius * r.radius);
        // sqrt(EI/(rho A L^4)) [1/s]
        const double unit = std::sqrt(r.youngs_modulus * r.radius * r.radius / (4 * kDensity));
        const double rate = unit * std::sqrt(3.5 * 3.5 + 1.45 * gamma);
        RodSetup rod = clampedRod(r, stretches, graded, dynamic ? 2 * rate : 0.0);
        RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 0.01, 1e-8));
        const double begin = threadSeconds();
        const std::string refused = dynamic ? settle(stepper, rod, 0.2 / rate, 1e-8, 5000)
                                            : stepper.solveEquilibrium(rod.state, rod.inputs).message;
        const double seconds = threadSeconds() - begin;

        CantileverTip exact{-r.z, r.x};
        if (stretches)
          exact = heavyCantilever(gamma, kDensity * kGravity / r.youngs_modulus);
        const double error = !refused.empty()
                                 ? std::numeric_limits<double>::quiet_NaN()
                                 : 1e3 * std::hypot(rod.tip().x() - exact.extent, rod.tip().z() + exact.drop);
        Row& row = context.row();
        row.set("how", dynamic ? "settled" : "static")
            .set("mesh", graded ? "graded" : "even")
            .set("model", stretches ? "EA = E pi r^2" : "inextensible");
        row.set("radius_m", r.radius)
            .set("E_Pa", r.youngs_modulus)
            .set("tip_x", rod.tip().x())
            .set("tip_z", rod.tip().z());
        row.set("expected_x", exact.extent).set("expected_z", -exact.drop);
        row.set("quantity", "tip error [mm]");
        const char* source = stretches ? "extensible elastica" : "exact elastica";
        if (graded || stretches)
          row.check(error, 0.0, kBoundMillimetres, source);
        else
          row.set("measured", error).set("expected", 0.0).set("source", source);
        row.set("cpu_seconds", seconds);
        if (!refused.empty())
          row.set("refused", refused);
        if (!stretches)
          worst[graded] = error <= worst[graded] ? worst[graded] : error;   // keeps NaN
      }
  context.metric("max_tip_error_mm", worst[1]);
  context.metric("max_tip_error_even_mm", worst[0]);
  context.note(
      "graded: the 200 nodes stand closer at the clamp (edges of 2 to 8 mm, `grading: 4` in a scene). On even nodes "
      "the last rod, whose");
  context.note("bending layer Gamma^(-1/2) L = 5 mm is one edge long, misses 0.3 mm with every clamp that was tried.");
  context.note(
      "inextensible: EA is raised until the rod's weight strains it by 1e-6, since the exact elastica does not "
      "stretch;");
  context.note(
      "the rows with the material's own EA are compared with the elastica that stretches (0.98 % at E = 1e6 Pa).");
}

const StudyRegistration kRodsAtRestRegistration{
    "rods_at_rest", "settled tips of four 1 m rods against the exact elastica", runRodsAtRest};

}   // namespace slender::study
