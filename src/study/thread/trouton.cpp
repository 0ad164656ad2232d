// Straight threads that stretch: Trouton's viscosity 3 mu (exact_checks.csv T1 and T3).
#include <cmath>
#include <string>

#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

constexpr double kStretchedViscosity = 1000.0, kUnstretchedRadius = 0.1, kTroutonBound = 0.01;

/// Between plates that move apart: at constant speed 1, or so that L = exp(t).
ThreadSetup betweenPlates(int edges, double gamma)
{
  ThreadSetup t = straightThread(1.0, Eigen::VectorXd::Constant(edges, kUnstretchedRadius));
  t.model.viscosity = kStretchedViscosity;
  t.model.density = 1e-6;   // the formulas have no inertia
  t.model.surface_tension = gamma;
  t.hold(0);
  t.hold(1);
  return t;
}

double plateLength(bool exponential, double time) { return exponential ? std::exp(time) : 1.0 + time; }

/// Force on the plate at `time` (a multiple of h).
double plateForce(bool exponential, double gamma, int edges, double h, double time, double* radius = nullptr)
{
  ThreadSetup t = betweenPlates(edges, gamma);
  ThreadStepper stepper = makeStepper(t);
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 1; k <= steps; ++k)
  {
    t.inputs.ends[1].position.x() = plateLength(exponential, k * h);
    advance(stepper, t, h, "trouton, plates");
  }
  if (radius)
    *radius = t.state.radius(edges / 2);
  return -stepper.endLoads()[1].force.x();
}

double exactForce(bool exponential, double gamma, double time)
{
  const double area0 = M_PI * kUnstretchedRadius * kUnstretchedRadius, length = plateLength(exponential, time),
               rate = exponential ? 1.0 : 1.0 / length;
  return 3.0 * kStretchedViscosity * area0 / length * rate + M_PI * gamma * kUnstretchedRadius / std::sqrt(length);
}

struct Hanging
{
  double length, top_radius;
};

/// Under its own weight g = 981, clamped at the top, for a fraction of the time at which it would break off.
Hanging hang(double gamma, int edges, double h, double time)
{
  ThreadSetup t = straightThread(1.0, Eigen::VectorXd::Constant(edges, kUnstretchedRadius));
  t.model.viscosity = kStretchedViscosity;
  t.model.density = 1.0;
  t.model.surface_tension = gamma;
  t.model.surface_shape = SurfaceShape::cylinder;   // the formula is slender theory's
  t.inputs.gravity = {981.0, 0, 0};
  t.hold(0);
  ThreadStepper stepper = makeStepper(t);
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 1; k <= steps; ++k)
    advance(stepper, t, time / steps, "trouton, hanging");
  // the first edge's middle lies beside the top: its neighbours' slope carries on to it
  return {t.length(), 1.5 * t.state.radius(0) - 0.5 * t.state.radius(1)};
}

/// With surface tension: 3 mu dA/dt = -rho g A0 S + gamma sqrt(pi A) for every section S of the fluid below it.
double hangingLength(double gamma, double time)
{
  const int sections = 400, steps = 4000;
  const double area0 = M_PI * kUnstretchedRadius * kUnstretchedRadius, dt = time / steps;
  double length = 0.0;
  for (int k = 0; k < sections; ++k)
  {
    const double below = (k + 0.5) / sections;
    const auto rate = [&](double a) {
      return (-981.0 * area0 * below + gamma * std::sqrt(M_PI * a)) / (3 * kStretchedViscosity);
    };
    double a = area0;
    for (int i = 0; i < steps; ++i)
      a += dt * rate(a + 0.5 * dt * rate(a));
    length += area0 / a / sections;
  }
  return length;
}

}   // namespace

void runTrouton(StudyContext& context)
{
  const double h = context.quick() ? 4e-3 : 1e-3;
  const int edges = 40;
  for (const bool exponential : {false, true})
    for (const double gamma : exponential ? std::vector<double>{0.0, 20.0} : std::vector<double>{0.0})
      for (const double time : {1.0, 2.0})
      {
        const std::string test = std::string(exponential ? "plates, L = exp(t)" : "plates, speed 1") + ", gamma " +
                                 std::to_string(static_cast<int>(gamma));
        double radius = 0.0;
        const double force = plateForce(exponential, gamma, edges, h, time, &radius);
        const double length = plateLength(exponential, time);
        checkRelative(context, test, "force", force, exactForce(exponential, gamma, time), kTroutonBound,
                      "3 mu A L'/L + pi gamma a")
            .set("t", time);
        checkRelative(context, test, "radius", radius, kUnstretchedRadius / std::sqrt(length), kTroutonBound,
                      "a0 sqrt(L0/L)")
            .set("t", time);
      }

  const double t_star = 3 * kStretchedViscosity / 981.0;
  for (const double gamma : {0.0, 20.0})
    for (const double part : {0.25, 0.5, 0.75})
    {
      context.progress(static_cast<int>(part * 4), 4, "hanging thread");
      const Hanging seen = hang(gamma, context.quick() ? 40 : 80, h, part * t_star);
      const std::string test = "hanging, gamma " + std::to_string(static_cast<int>(gamma));
      const double length = gamma == 0 ? -std::log(1 - part) / part : hangingLength(gamma, part * t_star);
      checkRelative(context, test, "length", seen.length, length, kTroutonBound,
                    gamma == 0 ? "-L0 (t*/t) ln(1-t/t*)" : "3 mu dA/dt = -rho g A0 S + gamma sqrt(pi A)")
          .set("t", part * t_star);
      if (gamma == 0)
        checkRelative(context, test, "radius at the top", seen.top_radius, kUnstretchedRadius * std::sqrt(1 - part),
                      kTroutonBound, "a0 sqrt(1-t/t*)")
            .set("t", part * t_star);
    }

  const auto time_error = [&](double step) {
    return plateForce(true, 20.0, 10, step, 1.0) / exactForce(true, 20.0, 1.0) - 1;
  };
  context.metric("observed_order_time", observedOrder(time_error(0.01), time_error(0.005)));
  // The step's error is the same on all meshes: differences of three of them.
  const double coarse = hang(0.0, 10, 4e-3, 0.5 * t_star).length, middle = hang(0.0, 20, 4e-3, 0.5 * t_star).length,
               fine = hang(0.0, 40, 4e-3, 0.5 * t_star).length;
  context.metric("observed_order_space", observedOrder(coarse - middle, middle - fine));
  context.note(
      "inertia: none in the formulas; between the plates rho = 1e-6, hanging rho = 1 as in the reference (rho L^2/(mu "
      "t*) = 3e-4).");
}

const StudyRegistration kTroutonRegistration{
    "trouton", "straight viscous threads stretched by plates and by their weight", runTrouton};

}   // namespace slender::study
