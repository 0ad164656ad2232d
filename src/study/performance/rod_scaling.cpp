#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "study/rod/rod_cases.h"
#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/rod/rod_system.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// Seconds, fastest of several runs.
struct IterationCost
{
  double gradient = std::numeric_limits<double>::infinity();   ///< frames and gradient
  /// frames, gradient, Hessian, factorisation, forward substitution
  double assemble = gradient;
  /// backward substitution; measures, trial along the direction, frames made new base
  double solve = gradient, update = gradient;
  double factor = gradient;   ///< of a matrix of this shape alone, for comparison
  double step = gradient;     ///< a whole step over its Newton iterations
  double iterations_per_step = 0;
  double total() const { return assemble + solve + update; }
};

/// A rope of 5 mm edges held at its left end and released from the horizontal.
RodSetup rope(int nodes)
{
  RodSetup rod = straightRod(circularRod(0.005 * (nodes - 1), 0.004, 1e7, 0.45, 1100, nodes - 1));
  rod.inputs.gravity = {0, 0, -9.81};
  rod.hold(0, 0, true);
  return rod;
}

/// Whole implicit Euler steps of 1 ms: predictor, iterations, wrenches and copies of the state included.
void timeSteps(RodSetup& rod, int repeats, int steps, IterationCost& cost)
{
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1e-3));
  int iterations = 0;
  for (int r = -1; r < repeats; ++r)   // the first batch warms up
  {
    int batch = 0;
    const double start = threadSeconds();
    for (int i = 0; i < steps; ++i)
    {
      const StepReport report = stepper.step(rod.state, rod.inputs, 1e-3);
      require(report, "rope of " + std::to_string(rod.model->nodes()) + " nodes");
      batch += report.iterations;
    }
    if (r >= 0)
      cost.step = std::min(cost.step, (threadSeconds() - start) / batch);
    iterations += batch;
  }
  cost.iterations_per_step = static_cast<double>(iterations) / ((repeats + 1) * steps);
}

/// The parts of one Newton iteration, as dynamics/newton.h goes through them, at the state that the rope has reached.
void timeIterationParts(const RodSetup& rod, int repeats, IterationCost& cost)
{
  RodSystem system(*rod.model);
  system.load(rod.state);
  system.setResponse(0.0, nullptr);
  const double step = 1e-3;
  for (int i = 0; i < rod.model->nodes(); ++i)
    system.setInertia(i, system.isFree(i) ? rod.model->mass[i] / (step * step) : 0.0, rod.state.x.col(i),
                      rod.model->mass[i] * rod.inputs.gravity);
  system.evaluate(true);
  system.accept();
  for (int i = 0; i < repeats; ++i)
  {
    const double a = threadSeconds();
    system.evaluate(false);
    const double b = threadSeconds();
    if (!system.evaluate(true).inertia.positiveDefinite())
      throw std::runtime_error("rod_scaling: the matrix is not definite");
    const double c = threadSeconds();
    system.solve();
    const double d = threadSeconds();
    // as Newton measures them
    const double limit = system.incrementSize() + system.slope() < 0 ? 0.5 : system.stepLimit();
    system.moveAlong(limit);
    system.accept();
    const double e = threadSeconds();
    cost.gradient = std::min(cost.gradient, b - a);
    cost.assemble = std::min(cost.assemble, c - b);
    cost.solve = std::min(cost.solve, d - c);
    cost.update = std::min(cost.update, e - d);
  }

  BandedLdlt<10, 4> matrix;
  matrix.resize(rod.model->nodes());
  for (int i = 0; i < std::min(repeats, 200); ++i)
  {
    for (int b = 0; b < matrix.blocks(); ++b)   // diagonally dominant
      for (int c = 0; c < 4; ++c)
      {
        for (int r = 0; r < RodPanel::kStride; ++r)
          matrix.panels()[b].below[c][r] = r < RodPanel::kBelow && b + 1 + r / 4 < matrix.blocks() ? -0.3 : 0.0;
        for (int r = 0; r < 4; ++r)
          matrix.panels()[b].diag[c][r] = r == c ? 9.0 : -0.3;
      }
    const double start = threadSeconds();
    matrix.factor();
    cost.factor = std::min(cost.factor, threadSeconds() - start);
  }
}

}   // namespace

void runRodScaling(StudyContext& context)
{
  const std::vector<int> sizes =
      context.quick() ? std::vector<int>{50, 200, 1000, 10000, 100000}
                      : std::vector<int>{50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 50000, 100000};
  Plot& plot =
      context.plot("rod_scaling", "Newton iteration of a rod: time against size", "nodes", "time per iteration [s]");
  std::vector<double> x, y, whole;
  double at_1000 = 0, largest = 0, iterations = 0;
  int done = 0;
  for (const int nodes : sizes)
  {
    context.progress(done++, static_cast<int>(sizes.size()), std::to_string(nodes) + " nodes");
    IterationCost cost;
    const int work = context.quick() ? 400000 : 2000000;   // node-iterations per batch
    RodSetup rod = rope(nodes);
    timeSteps(rod, context.quick() ? 3 : 5, std::clamp(work / nodes / 5, 3, 400), cost);
    timeIterationParts(rod, std::clamp(work / nodes, 10, 4000), cost);
    const double total = cost.total(), per_node = 1e6 / nodes;
    const double band = cost.assemble - cost.gradient;
    context.row()
        .set("nodes", nodes)
        .set("microseconds_per_node", total * per_node)
        .set("frames_gradient_us", cost.gradient * per_node)
        .set("hessian_factor_us", band * per_node)
        .set("solve_us", cost.solve * per_node)
        .set("update_us", cost.update * per_node)
        .set("frames_gradient_share", cost.gradient / total)
        .set("hessian_factor_share", band / total)
        .set("solve_share", cost.solve / total)
        .set("update_share", cost.update / total)
        .set("factor_alone_us", cost.factor * per_node)
        .set("whole_step_us", cost.step * per_node)
        .set("iterations_per_step", cost.iterations_per_step)
        .set("seconds_per_iteration", total);
    const std::pair<const char*, double> parts[] = {
        {"whole iteration", total},       {"frames, gradient", cost.gradient},
        {"Hessian, factorisation", band}, {"solve", cost.solve},
        {"update", cost.update},          {"whole step per iteration", cost.step}};
    for (const auto& part : parts)
    {
      plot.at(part.first).x.push_back(nodes);
      plot.at(part.first).y.push_back(part.second);
    }
    iterations = std::max(iterations, cost.iterations_per_step);
    if (nodes >= 1000)
    {
      x.push_back(nodes);
      y.push_back(total);
      whole.push_back(cost.step);
      largest = std::max(largest, total * per_node);
    }
    if (nodes == 1000)
      at_1000 = total * per_node;
  }
  context.metric("scaling_exponent", logSlope(x, y));
  context.metric("iterations_per_step_worst", iterations);
  context.metric("microseconds_per_node_iteration", at_1000);
  context.metric("microseconds_per_node_iteration_worst", largest);
  context.metric("scaling_exponent_whole_step", logSlope(x, whole));
  context.note(
      "microseconds_per_node: one Newton iteration, at 1000 nodes in the metric: frames + gradient + Hessian + factor "
      "+ solve + update.");
  context.note(
      "hessian_factor: assembly, factorisation and forward substitution run in one pass, piece by piece; factor_alone: "
      "a stored band's.");
  context.note(
      "whole_step_us: a step with everything around the iterations (predictor, wrenches, copies of the state), per "
      "iteration and node.");
}

const StudyRegistration kRodScalingRegistration{
    "rod_scaling", "time per Newton iteration and node from 50 to 100,000 nodes", runRodScaling};

}   // namespace slender::study
