#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "rod_cases.h"
#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/study/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

struct Cost
{
  double per_iteration = std::numeric_limits<double>::infinity();   ///< whole step over its Newton iterations [s]
  double factor = per_iteration, solve = per_iteration;             ///< [s]
  double iterations_per_step = 0;
};

/// A rope of 5 mm edges held at its left end and released from the horizontal; implicit Euler, 1 ms.
void timeSteps(int nodes, int repeats, int steps, Cost& cost)
{
  RodSetup rod = straightRod(circularRod(0.005 * (nodes - 1), 0.004, 1e7, 0.45, 1100, nodes - 1));
  rod.inputs.gravity = {0, 0, -9.81};
  rod.hold(0, 0, true);
  RodStepper stepper(rod.model, timeConfig(Integrator::implicit_euler, 1e-3));
  int iterations = 0;
  for (int r = -1; r < repeats; ++r)   // the first batch warms up
  {
    int batch = 0;
    const double start = threadSeconds();
    for (int i = 0; i < steps; ++i)
    {
      const StepReport report = stepper.step(rod.state, rod.inputs, 1e-3);
      require(report, "rope of " + std::to_string(nodes) + " nodes");
      batch += report.iterations;
    }
    if (r >= 0)
      cost.per_iteration = std::min(cost.per_iteration, (threadSeconds() - start) / batch);
    iterations += batch;
  }
  cost.iterations_per_step = static_cast<double>(iterations) / ((repeats + 1) * steps);
}

/// The linear algebra alone, on a diagonally dominant band of the same shape.
void timeFactor(int nodes, int repeats, Cost& cost)
{
  BandedLdlt<10, 4> matrix;
  matrix.resize(nodes);
  const auto fill = [&] {
    for (int b = 0; b < nodes; ++b)
    {
      RodPanel& panel = matrix.panels()[b];
      for (int c = 0; c < 4; ++c)
      {
        for (int r = 0; r < RodPanel::kStride; ++r)
          panel.below[c][r] = r < RodPanel::kBelow && b + 1 + r / 4 < nodes ? -0.3 : 0.0;
        for (int r = 0; r < 4; ++r)
          panel.diag[c][r] = r == c ? 9.0 : -0.3;
      }
    }
  };
  std::vector<double> x(4 * static_cast<std::size_t>(nodes), 1.0);
  for (int i = 0; i < repeats; ++i)
  {
    fill();
    const double start = threadSeconds();
    matrix.factor();
    const double middle = threadSeconds();
    matrix.solve(x.data());
    cost.factor = std::min(cost.factor, middle - start);
    cost.solve = std::min(cost.solve, threadSeconds() - middle);
  }
}

}  // namespace

void runRodScaling(StudyContext& context)
{
  const std::vector<int> sizes = context.quick() ? std::vector<int>{50, 200, 1000, 10000, 100000}
                                                 : std::vector<int>{50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 50000, 100000};
  Plot& plot = context.plot("rod_scaling", "Newton iteration of a rod: time against size", "nodes", "time per iteration [s]");
  std::vector<double> x, y;
  double at_1000 = 0, largest = 0;
  int done = 0;
  for (const int nodes : sizes)
  {
    context.progress(done++, static_cast<int>(sizes.size()), std::to_string(nodes) + " nodes");
    Cost cost;
    const int work = context.quick() ? 400000 : 2000000;   // node-steps per batch
    timeSteps(nodes, context.quick() ? 3 : 5, std::clamp(work / nodes / 5, 3, 400), cost);
    timeFactor(nodes, std::clamp(work / nodes, 5, 2000), cost);
    const double total = cost.per_iteration, rest = total - cost.factor - cost.solve;
    const double per_node = 1e6 / nodes;
    context.row().set("nodes", nodes).set("microseconds_per_node", total * per_node).set("factor_us", cost.factor * per_node)
        .set("solve_us", cost.solve * per_node).set("frames_gradient_hessian_us", rest * per_node)
        .set("factor_share", cost.factor / total).set("solve_share", cost.solve / total).set("frames_gradient_hessian_share", rest / total)
        .set("iterations_per_step", cost.iterations_per_step).set("seconds_per_iteration", total);
    plot.at("whole iteration").x.push_back(nodes);
    plot.at("whole iteration").y.push_back(total);
    plot.at("frames, gradient, Hessian, line search").x.push_back(nodes);
    plot.at("frames, gradient, Hessian, line search").y.push_back(rest);
    plot.at("factorisation").x.push_back(nodes);
    plot.at("factorisation").y.push_back(cost.factor);
    plot.at("solve").x.push_back(nodes);
    plot.at("solve").y.push_back(cost.solve);
    if (nodes >= 1000)
    {
      x.push_back(nodes);
      y.push_back(total);
      largest = std::max(largest, total * per_node);
    }
    if (nodes == 1000)
      at_1000 = total * per_node;
  }
  context.metric("scaling_exponent", logSlope(x, y));
  context.metric("microseconds_per_node_iteration", at_1000);
  context.metric("microseconds_per_node_iteration_worst", largest);
  context.note("time of whole steps over their Newton iterations (all overhead included), at 1000 nodes; factor and solve timed alone on a band");
  context.note("of the same shape, the rest is frames, gradient, Hessian and line search. Fastest of several batches, thread CPU clock.");
}

}  // namespace slender::study
