// A disc that hangs from a wire and turns: the wire's material frames carry the torque (thesis 4.5.3).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "study/rod/group_cases.h"
#include "slender_sim/geometry/rotation.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

struct Pendulum
{
  const char* name;
  double length, youngs_modulus, poissons_ratio, radius, density;
  double mass, inertia;   ///< of the disc, about the wire
};

/// Mean period between upward zero crossings of the disc's angle, half a turn of amplitude.
double period(const Pendulum& p, int edges, Integrator integrator, int steps_per_period, double expected,
              StepReport& worst)
{
  RodCase wire = circularRod(p.length, p.radius, p.youngs_modulus, p.poissons_ratio, p.density, edges);
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
  nodes.row(2).setLinSpaced(edges + 1, 0.0, -p.length);
  RodSetup rod = shapedRod(wire, nodes);
  rod.hold(0, 0, true);
  GroupSetup g;
  g.add(rod);
  g.add("disc", p.mass, {0.5 * p.inertia, 0.5 * p.inertia, p.inertia},
        {nodes.col(edges), Eigen::Quaterniond::Identity()});
  g.weld(0, edges, 0);
  g.setGravity({0, 0, -9.81});
  const double h = expected / steps_per_period;
  World world = g.world(timeConfig(integrator, h));
  require(world.solveEquilibrium(g.state, g.inputs), "hanging disc");
  g.state.bodies[0].velocity.angular = {0, 0, M_PI * 2 * M_PI / expected};

  double angle = 0, first = 0, last = 0;
  int crossings = 0;
  for (int k = 1; k <= 4 * steps_per_period + steps_per_period / 4; ++k)
  {
    const Eigen::Quaterniond before = g.state.bodies[0].X_WB.orientation;
    const StepReport report = world.step(g.state, g.inputs);
    require(report, "torsional pendulum");
    worst.iterations = std::max(worst.iterations, report.iterations);
    const double was = angle;
    angle += rotationVector(g.state.bodies[0].X_WB.orientation * before.conjugate()).z();
    if (k > 1 && was < 0 && angle >= 0)
    {
      last = (k - angle / (angle - was)) * h;
      if (crossings++ == 0)
        first = last;
    }
  }
  return crossings > 1 ? (last - first) / (crossings - 1) : std::nan("");
}

}   // namespace

void runTorsionalPendulum(StudyContext& context)
{
  // Reference cases of torsion_pendulum.csv; the disc's mass strains the wire by under 1e-3.
  const Pendulum pendulums[] = {{"steel wire", 1.0, 2e11, 0.3, 0.001, 7800, 1.0, 0.001},
                                {"rubber cord", 0.5, 1e7, 0.5, 0.002, 1100, 0.01, 5e-6}};
  const std::vector<int> meshes = context.quick() ? std::vector<int>{10} : std::vector<int>{5, 10, 40};
  const std::vector<int> steps = context.quick() ? std::vector<int>{400} : std::vector<int>{200, 400, 800};
  int done = 0;
  const int total = static_cast<int>(2 * meshes.size() * steps.size() * implicitIntegrators().size());
  for (const Pendulum& p : pendulums)
  {
    const double stiffness =
        circularRod(p.length, p.radius, p.youngs_modulus, p.poissons_ratio, p.density, 1).twist / p.length;
    const double expected = 2 * M_PI * std::sqrt(p.inertia / stiffness);
    Plot& plot = context.plot(std::string("torsional_pendulum_") + (p.radius > 0.0015 ? "rubber" : "steel"),
                              std::string("Torsional pendulum, ") + p.name + ": error against step", "steps per period",
                              "relative error of the period");
    for (const int edges : meshes)
      for (const Integrator integrator : implicitIntegrators())
        for (const int n : steps)
        {
          context.progress(done++, total, std::string(p.name) + ", " + toString(integrator));
          const double begin = threadSeconds();
          StepReport worst;
          const double measured = period(p, edges, integrator, n, expected, worst);
          Row& row = context.row();
          row.set("case", p.name)
              .set("edges", edges)
              .set("integrator", toString(integrator))
              .set("steps_per_period", n);
          row.check(measured, expected, 0.002 * expected, "2 pi sqrt(J L / beta)")
              .set("relative_error", measured / expected - 1);
          row.set("iterations_per_step", worst.iterations).set("cpu_seconds", threadSeconds() - begin);
          if (edges == meshes.back())
          {
            plot.at(toString(integrator)).x.push_back(n);
            plot.at(toString(integrator)).y.push_back(std::abs(measured / expected - 1));
          }
        }
  }
  context.note(
      "The disc swings by half a turn to each side; the wire hangs in gravity, its twist follows quasistatically (no "
      "polar inertia).");
}

const StudyRegistration kTorsionalPendulumRegistration{
    "torsional_pendulum", "a disc that turns on a wire: period, all integrators and steps", runTorsionalPendulum};

}   // namespace slender::study
