#include <cmath>
#include <string>
#include <vector>

#include "rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kBound = 0.002;   // relative

struct Pendulum
{
  const char* name;
  double length, youngs_modulus, poissons_ratio, radius, inertia, density;
};

/// Straight rod held by the end sections at both ends; the far one turns.
struct TwistedRod
{
  explicit TwistedRod(const Pendulum& p, int edges)
    : rod(straightRod(circularRod(p.length, p.radius, p.youngs_modulus, p.poissons_ratio, p.density, edges)))
  {
    rod.hold(0, 0, true);
    rod.hold(edges, edges, true);
    start = rod.inputs.grasps[1].X_WG;
  }
  void turnTo(double angle)
  {
    rod.inputs.grasps[1].X_WG.orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX())) * start.orientation;
  }
  RodSetup rod;
  Pose start;
};

/// Period of a disc on the rod, J phi'' = torque(phi): velocity Verlet around the rod's own steps, as a gripper would
/// do it.
double pendulumPeriod(const Pendulum& p, double stiffness, int edges, Integrator integrator, int steps_per_period)
{
  TwistedRod t(p, edges);
  const double step = 2 * M_PI * std::sqrt(p.inertia / stiffness) / steps_per_period;
  RodStepper stepper(t.rod.model, timeConfig(integrator, step));
  const double amplitude = 0.5;
  double angle = amplitude, speed = 0;
  // Turned to the start slowly enough: half a radian in ten equilibria.
  for (int i = 1; i <= 10; ++i)
  {
    t.turnTo(angle * i / 10);
    require(stepper.solveEquilibrium(t.rod.state, t.rod.inputs), "torsional pendulum, start");
  }
  double torque = stepper.wrenches()[1].torque.x();
  double first = 0, last = 0;
  int crossings = 0;
  for (int i = 1; i <= 4 * steps_per_period; ++i)
  {
    const double before = angle;
    speed += step / 2 * torque / p.inertia;
    angle += step * speed;
    t.turnTo(angle);
    require(stepper.step(t.rod.state, t.rod.inputs, step), "torsional pendulum");
    torque = stepper.wrenches()[1].torque.x();
    speed += step / 2 * torque / p.inertia;
    if ((before > 0) != (angle > 0))
    {
      last = (i - 1 + before / (before - angle)) * step;
      if (crossings++ == 0)
        first = last;
    }
  }
  return 2 * (last - first) / (crossings - 1);
}

}   // namespace

void runTorsion(StudyContext& context)
{
  const Pendulum pendulums[] = {{"steel wire", 1.0, 2e11, 0.3, 0.001, 0.001, 7800},
                                {"rubber cord", 0.5, 1e7, 0.5, 0.002, 5e-6, 1100}};
  const std::vector<int> meshes = context.quick() ? std::vector<int>{20} : std::vector<int>{10, 40, 160};
  int done = 0;
  for (const Pendulum& p : pendulums)
  {
    const RodCase material = circularRod(p.length, p.radius, p.youngs_modulus, p.poissons_ratio, p.density, 1);
    const double stiffness = material.twist / p.length;
    for (const int edges : meshes)
    {
      TwistedRod t(p, edges);
      RodStepper stepper(t.rod.model, timeConfig(Integrator::implicit_euler, 0.01));
      double angle = 0;
      for (const double target : {0.1, 1.0, 3.0, 8.0})   // it buckles beyond 8.99 (1 + nu) rad
      {
        context.progress(done++, 100, std::string(p.name) + ", torque");
        for (const double from = angle; angle < target - 1e-12;)
        {
          angle = std::min(target, angle + std::min(0.5, target - from));
          t.turnTo(angle);
          require(stepper.solveEquilibrium(t.rod.state, t.rod.inputs), "twisted rod");
        }
        Row& row = context.row();
        row.set("case", p.name).set("quantity", "torque [N m]").set("edges", edges).set("angle_rad", target);
        row.check(-stepper.wrenches()[1].torque.x(), stiffness * target, kBound * stiffness * target, "beta angle / L");
      }
      for (const Integrator integrator : implicitIntegrators())
      {
        context.progress(done++, 100, std::string(p.name) + ", " + toString(integrator));
        const double start = threadSeconds();
        const double period = pendulumPeriod(p, stiffness, edges, integrator, 200);
        const double expected = 2 * M_PI * std::sqrt(p.inertia / stiffness);
        Row& row = context.row();
        row.set("case", p.name)
            .set("quantity", "period [s]")
            .set("edges", edges)
            .set("integrator", toString(integrator));
        row.check(period, expected, kBound * expected, "2 pi sqrt(J L / beta)")
            .set("cpu_seconds", threadSeconds() - start);
      }
    }
  }
  context.note(
      "period: the disc's angle by velocity Verlet, 200 steps per period, the rod between two grasps; material frames "
      "are quasistatic,");
  context.note("so the rod's own polar inertia (2e-6 and 5e-4 of the period) is left out of the reference as well.");
}

const StudyRegistration kTorsionRegistration{"torsion", "torque of a twisted rod and period of a torsional pendulum",
                                             runTorsion};

}   // namespace slender::study
