// Islands of several parts: sparse factorisation against conjugate gradients with the factors of the parts.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "study/framework/cpu_clock.h"
#include "study/rod/rod_cases.h"

namespace slender::study {

namespace {

constexpr double kRodRadius = 0.002, kSpacing = 0.012;   // [m]

/// Four layers of `rods` parallel rods each, crosswise, on a floor. Each rod has three edges per rod that it crosses.
std::string pile(int rods, const std::string& solver)
{
  const double length = kSpacing * (rods + 1);
  std::ostringstream text;
  text << "time: {step: 0.002, duration: 10, integrator: implicit_euler, newton: {linear: " << solver << "}}\n"
       << "contact: {gap: 2.0e-4}\nobstacles:\n  - {name: floor, shape: {plane: {point: [0, 0, 0], normal: [0, 0, "
          "1]}}}\n"
       << "rods:\n";
  for (int layer = 0; layer < 4; ++layer)
    for (int k = 0; k < rods; ++k)
    {
      const double across = kSpacing * (k + 1), z = (2.05 * layer + 1.05) * kRodRadius;
      const auto point = [&](double along) {
        std::ostringstream at;
        at << "[" << (layer % 2 ? across : along) << ", " << (layer % 2 ? along : across) << ", " << z << "]";
        return at.str();
      };
      text << "  - {name: rod_" << layer << "_" << k << ", centerline: {straight: {from: " << point(0.0)
           << ", to: " << point(length) << ", edges: " << 3 * (rods + 1) << "}}, cross_section: {radius: " << kRodRadius
           << "}, material: {density: 1100, youngs_modulus: 2.0e6, poissons_ratio: 0.4}, contact: {friction: 0.3}}\n";
    }
  return text.str();
}

struct Run
{
  double seconds = 0.0;   ///< per step
  int nodes = 0, iterations = 0, linear_iterations = 0;
  std::size_t contacts = 0;
  std::vector<RodState> rods;
};

Run runPile(int rods, const std::string& solver, int steps)
{
  Simulation scene(parseScene(pile(rods, solver), "pile"));
  scene.setThreads(1);
  Run run;
  for (int k = 0; k < steps; ++k)
  {
    const SceneInputs inputs = scene.defaultInputs();
    const double begin = threadSeconds();
    const StepReport report = scene.step(inputs);
    run.seconds += (threadSeconds() - begin) / steps;
    require(report, solver + ", " + std::to_string(rods) + " rods a layer, step " + std::to_string(k));
    run.iterations += report.iterations;
    run.linear_iterations += report.linear_iterations;
    run.contacts = std::max(run.contacts, scene.world().contacts().size());
  }
  run.rods = scene.state().rods;
  for (const RodState& rod : run.rods)
    run.nodes += static_cast<int>(rod.x.cols());
  return run;
}

/// Largest distance of nodes in the two states [m].
double difference(const std::vector<RodState>& a, const std::vector<RodState>& b)
{
  double largest = 0.0;
  for (std::size_t r = 0; r < a.size(); ++r)
    largest = std::max(largest, (a[r].x - b[r].x).colwise().norm().maxCoeff());
  return largest;
}

}   // namespace

void runIslandSolvers(StudyContext& context)
{
  const std::vector<int> sizes = context.quick() ? std::vector<int>{2, 6} : std::vector<int>{2, 4, 8, 16, 24, 32};
  const int steps = context.quick() ? 10 : 20;
  double worst = 0.0, slowest_choice = 0.0;
  int change = 0;
  for (const int rods : sizes)
  {
    context.progress(0, 1, std::to_string(rods) + " rods a layer");
    const Run direct = runPile(rods, "cholesky", steps), iterative = runPile(rods, "conjugate_gradients", steps),
              automatic = runPile(rods, "auto", steps);
    const double error = difference(direct.rods, iterative.rods) / (kSpacing * (rods + 1));
    worst = std::max(worst, error);
    slowest_choice = std::max(slowest_choice, automatic.seconds / std::min(direct.seconds, iterative.seconds));
    if (automatic.linear_iterations > 0 && change == 0)
      change = automatic.nodes;
    context.row()
        .set("rods", 4 * rods)
        .set("nodes", direct.nodes)
        .set("contacts", static_cast<double>(direct.contacts))
        .set("cholesky_ms", 1e3 * direct.seconds)
        .set("conjugate_gradients_ms", 1e3 * iterative.seconds)
        .set("automatic_ms", 1e3 * automatic.seconds)
        .set("newton_iterations_per_step", static_cast<double>(direct.iterations) / steps)
        .set("linear_iterations_per_solution",
             static_cast<double>(iterative.linear_iterations) / std::max(1, iterative.iterations))
        // both end Newton's method at increments of 1e-6 of an edge, which friction and contact amplify
        .check(error, 0.0, 1e-6, "the same equations; difference over the length of a rod");
  }
  context.metric("worst_difference", worst);
  context.metric("nodes_where_the_choice_changes", change);
  context.metric("worst_time_of_the_choice", slowest_choice);
}

const StudyRegistration kIslandSolversRegistration{
    "island_solvers",
    "time of a step of a pile of rods over its size: factorisation, conjugate gradients, and the choice",
    runIslandSolvers};

}   // namespace slender::study
