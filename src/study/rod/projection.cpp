// Inextensible rods: fast projection (thesis 4.5.2) against stiff stretching, explicit and implicit, on a rope that
// swings from one end.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "rod_cases.h"
#include "study/framework/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kRopeEnd = 0.6;   // [s] past the lowest point
constexpr int kEdges = 50;
constexpr double kRopeStretch = 1e4;   // [N]; the rope weighs half a newton

struct Method
{
  std::string name;
  Integrator integrator = Integrator::symplectic_euler;
  bool isotropic = true, projected = true;
  double stretch = kRopeStretch;
};

struct RopeRun
{
  Eigen::Vector3d tip;
  double cpu = std::numeric_limits<double>::infinity();   ///< per simulated second
  double length_error = 0;                                ///< largest | |e|/L - 1 | at any time
  int iterations = 0, cuts = 0;                           ///< most projection iterations in a step; cut steps
  long total_iterations = 0;
  std::string failure;
};

/// 1 m of rope, 2 mm thick, released horizontally from a clamp.
RopeRun releaseRope(const Method& method, double step)
{
  RodCase c = circularRod(1.0, 0.002, 1e7, 0.45, 4000, kEdges);
  c.stretch = method.stretch;
  c.mass_damping = 0.5;
  RodSetup rod = straightRod(c);
  auto model = std::make_shared<RodModel>(*rod.model);
  model->isotropic = method.isotropic;
  model->inextensible = method.projected;
  rod.model = model;
  rod.inputs.gravity = {0, 0, -9.81};
  rod.hold(0, 0, true);
  RodStepper stepper(rod.model, timeConfig(method.integrator, step, 1e-8));
  const int steps = static_cast<int>(std::lround(kRopeEnd / step));
  RopeRun run;
  const double start = threadSeconds();
  for (int i = 0; i < steps && run.failure.empty(); ++i)
  {
    const StepReport report = stepper.step(rod.state, rod.inputs, kRopeEnd / steps);
    if (!report.ok)
      run.failure = toString(report.failure);
    run.iterations = std::max(run.iterations, report.projection_iterations);
    run.total_iterations += report.projection_iterations;
    run.cuts += report.cut_steps;
    // a relative error of the square is twice that of the length
    run.length_error = std::max(run.length_error, method.projected ? 0.5 * report.constraint_error : report.max_strain);
  }
  run.cpu = (threadSeconds() - start) / kRopeEnd;
  run.tip = rod.tip();
  if (run.failure.empty() && !isFinite(rod.state))
    run.failure = "not finite";
  return run;
}

}   // namespace

void runProjection(StudyContext& context)
{
  const Method projected{"projection, isotropic"}, general{"projection, general", Integrator::symplectic_euler, false};
  std::vector<double> steps = {2e-3, 1e-3, 5e-4, 2e-4, 1e-4};
  if (!context.quick())
    steps.insert(steps.end(), {5e-5, 2e-5});

  // the inextensible rope: first order in the step, so two Richardson steps; the difference of the last two is its
  // error
  context.progress(0, 4, "converged solution");
  const double h = context.quick() ? 4e-5 : 1e-5;
  const Eigen::Vector3d a = releaseRope(projected, 4 * h).tip, b = releaseRope(projected, 2 * h).tip,
                        c = releaseRope(projected, h).tip;
  const Eigen::Vector3d coarse = 2 * b - a, fine = 2 * c - b, exact = fine + (fine - coarse) / 3;
  const double uncertain = (exact - fine).norm();
  context.row()
      .set("method", "reference")
      .set("tip_x", exact.x())
      .set("tip_z", exact.z())
      .set("last_correction_mm", 1e3 * uncertain);

  Plot& pareto = context.plot("projection_pareto", "Swinging rope, 50 edges: tip error at 0.6 s against run time",
                              "CPU seconds per simulated second", "tip error [mm]");
  Plot& constraint =
      context.plot("projection_constraint", "Largest error of an edge's length", "step [s]", "| |e| / L - 1 |");
  std::vector<Method> methods = {projected, general};
  for (const double stretch : {1e2, 1e4})
    methods.push_back({"stiff stretching, explicit, EA " + std::to_string(static_cast<int>(stretch)) + " N",
                       Integrator::symplectic_euler, true, false, stretch});
  methods.push_back({"stiff stretching, implicit Euler", Integrator::implicit_euler, false, false});
  methods.push_back({"stiff stretching, TR-BDF2", Integrator::tr_bdf2, false, false});
  std::vector<double> errors, used;
  double isotropic_cpu = 0, general_cpu = 0;
  int most = 0, done = 0;
  double worst = 0;
  for (const Method& method : methods)
    for (const double step : steps)
    {
      context.progress(done++, static_cast<int>(methods.size() * steps.size()), method.name);
      RopeRun run = releaseRope(method, step);
      if (!context.quick() && run.failure.empty())
        run.cpu = std::min(run.cpu, releaseRope(method, step).cpu);
      const double error = run.failure.empty() ? (run.tip - exact).norm() : std::numeric_limits<double>::quiet_NaN();
      Row& row = context.row();
      row.set("method", method.name)
          .set("step_s", step)
          .set("tip_error_mm", 1e3 * error)
          .set("cpu_per_second", run.cpu);
      row.set("length_error", run.length_error).set("iterations_max", run.iterations);
      row.set("iterations_mean", run.total_iterations / (kRopeEnd / step)).set("cuts", run.cuts);
      if (!run.failure.empty())
      {
        row.set("failure", run.failure);
        continue;
      }
      pareto.at(method.name).x.push_back(run.cpu);
      pareto.at(method.name).y.push_back(1e3 * error);
      constraint.at(method.name).x.push_back(step);
      constraint.at(method.name).y.push_back(std::max(run.length_error, 1e-17));
      if (!method.projected)
        continue;
      row.check(run.length_error, 0.0, 1e-8, "inextensible to 1e-8 relative");
      worst = std::max(worst, run.length_error);
      if (step <= 1e-3)
      {
        most = std::max(most, run.iterations);
        context.row()
            .set("method", method.name)
            .set("step_s", step)
            .set("quantity", "iterations")
            .check(run.iterations, 0, 5, "thesis 4.5.2: 3 to 5 iterations");
      }
      (method.isotropic ? isotropic_cpu : general_cpu) += run.cpu;
      if (method.isotropic)
      {
        used.push_back(step);
        errors.push_back(error);
      }
    }
  context.metric("length_error_max", worst);
  context.metric("iterations_max_to_1ms", most);
  context.metric("isotropic_over_general_cpu", isotropic_cpu / general_cpu);
  context.metric("order", logSlope(used, errors));
}

const StudyRegistration kProjectionRegistration{
    "projection",
    "inextensible rope: length error and iterations of fast projection; against stiff stretching, error against run "
    "time",
    runProjection};

}   // namespace slender::study
