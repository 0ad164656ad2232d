// Error against run time of a viscous thread that sags between two plates: integrators, steps, edges and tolerances
// against a converged run.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "study/rod/rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "thread_cases.h"
#include "study/framework/work_precision.h"

namespace slender::study {
namespace {

/// Fig. 5.4 of the thesis, CGS units.
constexpr double kSpan = 2.5, kSpanRadius = 0.0875, kEnd = 0.1;
constexpr int kSamples = 99;

struct Run
{
  Eigen::VectorXd depth;   ///< at kSamples places between the plates; empty when a step was refused
  double cpu = 0.0;
};

Run sag(int edges, double h, double tolerance, Integrator integrator)
{
  ThreadSetup t = straightThread(kSpan, Eigen::VectorXd::Constant(edges, kSpanRadius));
  t.model.density = ThesisOil::density;
  t.model.viscosity = ThesisOil::viscosity;
  t.model.surface_tension = ThesisOil::surface_tension;
  t.model.limits.max_edge_length = 2 * kSpan / edges;
  t.inputs.gravity = {0, 0, -ThesisOil::gravity};
  t.hold(0);
  t.hold(1);
  NewtonConfig newton;
  newton.tolerance = tolerance;
  ThreadStepper stepper(std::make_shared<ThreadModel>(t.model), newton, integrator);
  const int steps = static_cast<int>(std::lround(kEnd / h));
  const double start = threadSeconds();
  for (int k = 0; k < steps; ++k)
    if (!stepper.step(t.state, t.inputs, kEnd / steps).ok)
      return {};
  Run run;
  run.cpu = (threadSeconds() - start) / kEnd;
  run.depth.resize(kSamples);
  int j = 0;
  for (int k = 0; k < kSamples; ++k)
  {
    const double x = kSpan * (k + 1) / (kSamples + 1);
    while (j + 2 < t.state.nodes() && t.state.x[j + 1].x() < x)
      ++j;
    const double share = (x - t.state.x[j].x()) / (t.state.x[j + 1].x() - t.state.x[j].x());
    run.depth[k] = -(t.state.x[j].z() + share * (t.state.x[j + 1].z() - t.state.x[j].z()));
  }
  return run;
}

}   // namespace

void runThreadAccuracy(StudyContext& context)
{
  const int edges = context.quick() ? 100 : 400;
  const double h = context.quick() ? 2e-4 : 1e-4, fine = 1e-8;
  context.progress(0, 1, "converged run");
  // first order in the step, second in the edges: extrapolated in both
  const Eigen::VectorXd rough = sag(edges, 2 * h, fine, Integrator::implicit_euler).depth,
                        half = sag(edges, h, fine, Integrator::implicit_euler).depth,
                        coarse = sag(edges / 2, h, fine, Integrator::implicit_euler).depth;
  if (rough.size() == 0 || half.size() == 0 || coarse.size() == 0)
    throw std::runtime_error("thread_accuracy: the converged run failed");
  const Eigen::VectorXd exact = half + (half - rough) + (half - coarse) / 3;
  const auto rms = [&](const Eigen::VectorXd& depth) {
    return (depth - exact).norm() / std::sqrt(static_cast<double>(kSamples));
  };
  context.metric("reference_uncertainty_mm",
                 10 * ((half - coarse) / 3 - (half - rough)).norm() / std::sqrt(static_cast<double>(kSamples)) / 4);

  WorkPrecision front(context, "thread_accuracy", "Sagging thread", "RMS error of the depth at 0.1 s [mm]",
                      10 * exact.norm() / std::sqrt(static_cast<double>(kSamples)));
  struct Candidate
  {
    Integrator integrator;
    int edges;
    double step, tolerance;
  };
  std::vector<Candidate> candidates;
  const std::vector<double> steps = context.quick() ? std::vector<double>{0.01, 0.0025, 1e-3}
                                                    : std::vector<double>{0.02, 0.01, 0.005, 0.0025, 1e-3, 5e-4, 2e-4};
  for (const int n : {12, 25, 50, 100})
  {
    for (const double step : steps)
      for (const double tolerance : {NewtonConfig{}.tolerance, 1e-2})
        candidates.push_back({Integrator::implicit_euler, n, step, tolerance});
    const double edge = kSpan / n, stable = ThesisOil::density * edge * edge / (6 * ThesisOil::viscosity);
    if (n <= (context.quick() ? 25 : 100))
      candidates.push_back({Integrator::symplectic_euler, n, 0.5 * stable, NewtonConfig{}.tolerance});
  }
  int done = 0;
  for (const Candidate& c : candidates)
  {
    const std::string name = toString(c.integrator);
    context.progress(done++, static_cast<int>(candidates.size()), name);
    Run run = sag(c.edges, c.step, c.tolerance, c.integrator);
    for (int k = 0; k < 2 && run.depth.size() != 0 && c.integrator == Integrator::implicit_euler;
         ++k)   // the fastest of three
      run.cpu = std::min(run.cpu, sag(c.edges, c.step, c.tolerance, c.integrator).cpu);
    Row& row = context.row();
    row.set("integrator", name).set("edges", c.edges).set("step_s", c.step).set("newton_tolerance", c.tolerance);
    if (run.depth.size() == 0)
    {
      row.set("refused", "yes");
      continue;
    }
    const double error = 10 * rms(run.depth);
    row.set("error_mm", error);
    if (c.integrator == Integrator::implicit_euler && c.edges == 100 && c.step == 1e-3 && c.tolerance < 2e-3)
      context.metric("error_mm_100_edges_1ms", error);
    char setting[96];
    std::snprintf(setting, sizeof setting, "step %g s, tolerance %g", c.step, c.tolerance);
    // A loose Newton tolerance leaves an error of its own, which may happen to cancel: shown, but not counted.
    front.add(row, name + ", " + std::to_string(c.edges) + " edges", setting, error, run.cpu, c.tolerance < 2e-3);
  }
  front.conclude();
}

const StudyRegistration kThreadAccuracyRegistration{
    "thread_accuracy", "error against run time of a viscous thread that sags between two plates", runThreadAccuracy};

}   // namespace slender::study
