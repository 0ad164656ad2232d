// A flag and a swinging cloth: error against run time of the cloth's integrators and solvers, against a converged run.
#include <cmath>
#include <cstdio>

#include "cloth_cases.h"
#include "slender_sim/study/study.h"
#include "study/framework/work_precision.h"

namespace slender::study {

namespace {

constexpr int kCells = 15;

ClothSetup scene(bool flag)
{
  const TriangleMesh mesh = gridMesh(0.5, 0.5, kCells, kCells, GridPattern::alternating);
  ClothModel model = buildCloth("cloth", mesh, 0.15, isotropicMembrane(1e5, 0.3, 1e-3));   // 100 N/m
  model.bending_modulus = 1e-4;
  model.wind_coefficient = flag ? 0.6 : 0.0;
  model.mass_damping = 0.5;
  model.stiffness_damping = 1e-3;   // leaves no ripples that no step could follow
  ClothSetup cloth(std::move(model));
  if (flag)
  {
    cloth.pin(verticesWhere(mesh, [](const Eigen::Vector3d& p) { return p.x() < 1e-9; }));
    cloth.inputs.gravity = Eigen::Vector3d(0, -9.81, 0);
    cloth.inputs.wind = Eigen::Vector3d(3, 0, 0.5);
  }
  else
  {
    cloth.pin({0, kCells});
    cloth.inputs.gravity = Eigen::Vector3d(0, 0, -9.81);
  }
  return cloth;
}

/// State at the end [s]; empty when a step is refused.
Eigen::Matrix3Xd runTo(double end, const ClothSetup& setup, const ClothOptions& options, double h, double& seconds)
{
  ClothStepper stepper(setup.model, options);
  ClothState state = setup.state;
  const int steps = static_cast<int>(std::lround(end / h));
  const double start = threadSeconds();
  for (int k = 0; k < steps; ++k)
    if (!stepper.step(state, setup.inputs, end / steps).ok)
      return {};
  seconds = threadSeconds() - start;
  return state.x;
}

struct Method
{
  const char* name;
  Integrator integrator;
  bool one_step;
  ClothSolver solver;
  double linear_tolerance = ClothSolving{}.linear_tolerance;
};

constexpr Method kMethods[] = {
    {"implicit, Newton, cholesky", Integrator::implicit_euler, false, ClothSolver::cholesky},
    {"implicit, Newton, sweeps", Integrator::implicit_euler, false, ClothSolver::gauss_seidel},
    {"implicit, one step, cholesky", Integrator::implicit_euler, true, ClothSolver::cholesky},
    {"implicit, one step, sweeps to 0.02", Integrator::implicit_euler, true, ClothSolver::gauss_seidel, 0.02},
    {"implicit, one step, sweeps", Integrator::implicit_euler, true, ClothSolver::gauss_seidel},
    {"implicit, one step, sweeps to 1e-3", Integrator::implicit_euler, true, ClothSolver::gauss_seidel, 1e-3},
    {"TR-BDF2, Newton, cholesky", Integrator::tr_bdf2, false, ClothSolver::cholesky},
    {"TR-BDF2, Newton, sweeps", Integrator::tr_bdf2, false, ClothSolver::gauss_seidel},
    {"TR-BDF2, one step, sweeps", Integrator::tr_bdf2, true, ClothSolver::gauss_seidel},
    {"IMEX", Integrator::imex, false, ClothSolver::gauss_seidel},
    {"explicit", Integrator::symplectic_euler, false, ClothSolver::gauss_seidel}};

}   // namespace

void runClothAccuracy(StudyContext& context)
{
  useOneBlasThread();
  const double end = context.quick() ? 0.2 : 0.5;
  std::vector<double> implicit_steps{0.01, 0.005, 0.0025};
  if (!context.quick())
    implicit_steps = {0.02, 0.01, 0.005, 0.0025, 0.00125};
  const std::vector<double> explicit_steps =
      context.quick() ? std::vector<double>{1e-4, 2e-5} : std::vector<double>{2e-4, 1e-4, 5e-5, 2e-5};
  for (const bool flag : {false, true})
  {
    const std::string name = flag ? "flag" : "swinging";
    const ClothSetup setup = scene(flag);
    // explicit runs extrapolated: their error is of first order in the step
    ClothOptions fine;
    fine.integrator = Integrator::symplectic_euler;
    context.progress(0, 2, name + ", converged run");
    double seconds = 0;
    const double h = context.quick() ? 1e-5 : 5e-6;
    const Eigen::Matrix3Xd coarse = runTo(end, setup, fine, 2 * h, seconds),
                           finer = runTo(end, setup, fine, h, seconds);
    if (coarse.cols() == 0 || finer.cols() == 0)
      throw std::runtime_error("cloth_accuracy: the converged run failed");
    const Eigen::Matrix3Xd exact = 2 * finer - coarse;
    const auto rms = [&](const Eigen::Matrix3Xd& x) {
      return std::sqrt((x - exact).squaredNorm() / static_cast<double>(x.cols()));
    };
    context.metric("reference_uncertainty_mm_" + name, 1e3 * rms(finer));
    const double moved = 1e3 * rms(setup.state.x);
    WorkPrecision front(context, "cloth_accuracy_" + name, "Cloth, " + name, "RMS error of the vertices [mm]", moved);
    double order = std::numeric_limits<double>::infinity(), second_order = order;
    for (const Method& method : kMethods)
    {
      const bool is_explicit =
          method.integrator == Integrator::symplectic_euler || method.integrator == Integrator::imex;
      double previous = 0;
      for (const double step : is_explicit ? explicit_steps : implicit_steps)
      {
        context.progress(flag, 2, name + ", " + method.name);
        ClothOptions options;
        options.integrator = method.integrator;
        options.one_newton_step = method.one_step;
        options.solver = method.solver;
        options.linear_tolerance = method.linear_tolerance;
        const Eigen::Matrix3Xd x = runTo(end, setup, options, step, seconds);
        Row& row = context.row();
        row.set("scene", name).set("method", method.name).set("step_ms", 1e3 * step);
        if (x.cols() == 0)
        {
          row.set("refused", "yes");
          continue;
        }
        const double error = 1e3 * rms(x);
        row.set("error_mm", error);
        char setting[32];
        std::snprintf(setting, sizeof setting, "step %g ms", 1e3 * step);
        front.add(row, method.name, setting, error, seconds / end);
        if (previous > 0)
          row.set("error_over_previous", error / previous);
        if (method.integrator == Integrator::implicit_euler && step == implicit_steps.back())
          order = std::min(order, std::log2(previous / error));
        if (method.integrator == Integrator::tr_bdf2 && !method.one_step && step == implicit_steps.back())
          second_order = std::min(second_order, std::log2(previous / error));
        previous = error;
      }
    }
    front.conclude();
    context.metric("observed_order_" + name, order);
    context.metric("observed_order_tr_bdf2_" + name, second_order);
  }
  context.note(
      "reference: explicit runs at two steps, extrapolated; observed_order: least of implicit Euler's rows, and of "
      "TR-BDF2's with full Newton, from their last two steps; an error of 100 %: how far the vertices moved.");
}

const StudyRegistration kClothAccuracyRegistration{
    "cloth_accuracy", "error against run time of the cloth's integrators and solvers, on a flag and a swinging cloth",
    runClothAccuracy};

}   // namespace slender::study
