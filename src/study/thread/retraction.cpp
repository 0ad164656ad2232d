// A free thread that surface tension pulls together (exact_checks.csv T5).
#include <cmath>

#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

constexpr double kMu = 100.0, kGamma = 20.0, kRadius = 0.1, kLength = 5.0;

struct Outcome
{
  double length, radius, volume_drift;
};

Outcome retract(int edges, double h, double time)
{
  ThreadSetup t = straightThread(kLength, Eigen::VectorXd::Constant(edges, kRadius));
  t.model.viscosity = kMu;
  t.model.density = 1e-6;
  t.model.surface_tension = kGamma;
  const double volume = t.state.totalVolume();
  ThreadStepper stepper = makeStepper(t);
  const int steps = static_cast<int>(std::lround(time / h));
  for (int k = 0; k < steps; ++k)
    advance(stepper, t, h, "retraction");
  return {t.length(), t.state.radius(edges / 2), t.state.totalVolume() / volume - 1};
}

double exactRadius(double t) { return kRadius + kGamma * t / (6 * kMu); }
double exactLength(double t) { return kLength * std::pow(kRadius / exactRadius(t), 2); }

}   // namespace

void runRetraction(StudyContext& context)
{
  const double h = context.quick() ? 5e-3 : 1e-3;
  double drift = 0.0;
  for (const double time : {0.5, 1.0, 2.0})
  {
    const Outcome seen = retract(40, h, time);
    checkRelative(context, "free ends", "length", seen.length, exactLength(time), 0.01, "L0 (1 + gamma t/(6 mu a0))^-2")
        .set("t", time);
    checkRelative(context, "free ends", "radius", seen.radius, exactRadius(time), 0.01, "a0 + gamma t/(6 mu)")
        .set("t", time);
    drift = std::max(drift, std::abs(seen.volume_drift));
  }
  const auto error = [&](double step) { return retract(20, step, 1.0).length / exactLength(1.0) - 1; };
  context.metric("observed_order_time", observedOrder(error(0.02), error(0.01)));
  context.metric("volume_drift", drift);
}

const StudyRegistration kRetractionRegistration{"retraction", "a free viscous thread drawn together by surface tension",
                                                runRetraction};

}   // namespace slender::study
