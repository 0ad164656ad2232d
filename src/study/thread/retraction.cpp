// Free threads that surface tension pulls together: long ones (exact_checks.csv T5), and a single edge until it is a
// drop.
#include <cmath>
#include <string>

#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

constexpr double kRetractingViscosity = 100.0, kGamma = 20.0, kStartRadius = 0.1, kStartLength = 5.0;

struct Retracted
{
  double length, radius, volume_drift;
};

Retracted retract(int edges, double h, double time)
{
  ThreadSetup t = straightThread(kStartLength, Eigen::VectorXd::Constant(edges, kStartRadius));
  t.model.viscosity = kRetractingViscosity;
  t.model.density = 1e-6;
  t.model.surface_tension = kGamma;
  t.model.surface_shape = SurfaceShape::cylinder;   // the formula is slender theory's, whose ends have no caps
  const double volume = t.state.totalVolume();
  ThreadStepper stepper = makeStepper(t);
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 0; k < steps; ++k)
    advance(stepper, t, h, "retraction");
  return {t.length(), t.state.radius(edges / 2), t.state.totalVolume() / volume - 1};
}

double exactRadius(double t) { return kStartRadius + kGamma * t / (6 * kRetractingViscosity); }
double exactLength(double t) { return kStartLength * std::pow(kStartRadius / exactRadius(t), 2); }

/// Length of a single edge with caps on both ends after `time`, from `length`.
double edgeLength(double volume, double length, double h, double time)
{
  ThreadSetup t = straightThread(length, Eigen::VectorXd::Constant(1, std::sqrt(volume / (M_PI * length))));
  t.model.viscosity = kRetractingViscosity;
  t.model.density = 1e-6;
  t.model.surface_tension = kGamma;
  ThreadStepper stepper = makeStepper(t);
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 0; k < steps; ++k)
    advance(stepper, t, h, "a single edge");
  return t.length();
}

/// 3 mu V L'/L^2 = -dE/dL with E = gamma (2 sqrt(pi V L) + 2 V/L), by the midpoint rule.
double exactEdgeLength(double volume, double length, double time)
{
  constexpr int kSteps = 20000;
  const double dt = time / kSteps;
  const auto rate = [volume](double l) {
    return -kGamma / (3.0 * kRetractingViscosity) * (std::sqrt(M_PI * l * l * l / volume) - 2.0);
  };
  for (int k = 0; k < kSteps; ++k)
    length += dt * rate(length + 0.5 * dt * rate(length));
  return length;
}

}   // namespace

void runRetraction(StudyContext& context)
{
  const double h = context.quick() ? 5e-3 : 1e-3;
  double drift = 0.0;
  for (const double time : {0.5, 1.0, 2.0})
  {
    const Retracted seen = retract(40, h, time);
    checkRelative(context, "free ends", "length", seen.length, exactLength(time), 0.01, "L0 (1 + gamma t/(6 mu a0))^-2")
        .set("t", time);
    checkRelative(context, "free ends", "radius", seen.radius, exactRadius(time), 0.01, "a0 + gamma t/(6 mu)")
        .set("t", time);
    drift = std::max(drift, std::abs(seen.volume_drift));
  }
  // a rod and a disc of the same volume, on their way and when they have become drops
  const double volume = M_PI * kStartRadius * kStartRadius * 1.0, drop = std::cbrt(4.0 * volume / M_PI);
  for (const double length : {1.0, 0.05})
  {
    const std::string test = length > drop ? "rod of one edge" : "disc of one edge";
    checkRelative(context, test, "length", edgeLength(volume, length, 0.2 * h, 1.0),
                  exactEdgeLength(volume, length, 1.0), 0.01,
                  "3 mu V L'/L^2 = -dE/dL, E = gamma (2 sqrt(pi V L) + 2 V/L)")
        .set("t", 1.0);
    checkRelative(context, test, "length", edgeLength(volume, length, 10.0 * h, 100.0), drop, 1e-3, "L = 2 r")
        .set("t", 100.0);
  }
  const auto error = [&](double step) { return retract(20, step, 1.0).length / exactLength(1.0) - 1; };
  context.metric("observed_order_time", observedOrder(error(0.02), error(0.01)));
  context.metric("volume_drift", drift);
}

const StudyRegistration kRetractionRegistration{
    "retraction", "free viscous threads drawn together by surface tension, and drops", runRetraction};

}   // namespace slender::study
