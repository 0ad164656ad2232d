// A sheet pinned at two corners: what an implicit step costs beside one factorisation of its matrix.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "study/cloth/cloth_cases.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/energy/membrane_term.h"
#include "slender_sim/linalg/sparse_cholesky.h"
#include "slender_sim/study/study.h"
#include "cloth/cloth_linear_solver.h"

namespace slender::study {

namespace {

constexpr double kStep = 0.01;   // [s]

const char* nameOf(ClothSolver solver) { return solver == ClothSolver::cholesky ? "cholesky" : "gauss_seidel"; }

constexpr double kMembrane = 1e3, kStiffMembrane = 5e4;   // [N/m]

ClothSetup pinnedSheet(int side, double membrane)
{
  ClothModel model = buildCloth("sheet", gridMesh(1.0, 1.0, side - 1, side - 1, GridPattern::alternating), 0.15,
                                isotropicMembrane(1e3 * membrane, 0.3, 1e-3));
  model.bending_modulus = 1e-4;
  ClothSetup cloth(std::move(model));
  cloth.pin({0, side - 1});
  cloth.inputs.gravity = Eigen::Vector3d(0, 0, -9.81);
  return cloth;
}

/// Least time to factor the matrix of a step from this state, by supernodes as CHOLMOD does, with nested dissection of
/// points and wide supernodes.
double factorSeconds(const ClothSetup& cloth, double budget)
{
  const ClothModel& model = *cloth.model;
  const MeshTopology& t = model.topology;
  const int n = model.vertices();
  const auto element = IsometricElement::nonconforming;
  const PointMatrix bending = isometricBending(
      model.rest, t, element, model.bending_modulus * bendingCalibration(model.rest, t, element, model.warp));
  BlockMatrix matrix(n, {model.rest.triangles, t.hinges});
  MembraneTerm membrane(model.rest, model.membrane, model.warp);
  PointVector x, gradient(4 * n, 0.0);
  toPoints(cloth.state.x, x);
  matrix.setZero();
  membrane.setPattern(matrix);
  membrane.addHessian(HessianKind::semidefinite, x.data(), gradient.data(), matrix.values());
  matrix.add(1.0, bending, matrix.mapOf(bending));
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k)
      matrix.values()[9 * static_cast<long>(matrix.starts()[i]) + 4 * k] += model.mass[i] / (kStep * kStep);
  std::vector<char> held(n, 0);
  for (const int p : cloth.state.pins)
    held[p] = 1;
  SparseCholesky factor;
  factor.setPattern(matrix);
  bool good = true;
  const double seconds = leastSeconds(budget, [&] { good = factor.factor(matrix, held.data()) && good; });
  return good ? seconds : std::numeric_limits<double>::quiet_NaN();
}

struct Parts
{
  double assembly = 0, solve = 0, evaluation = 0;   ///< [s]
};

Parts partsOf(const ClothSetup& cloth, const ClothOptions& options, double budget)
{
  ClothSystem system(*cloth.model, options.solver == ClothSolver::cholesky);
  ClothLinearSolver solver(options, system);
  PointVector x, v, ahead, d;
  toPoints(cloth.state.x, x);
  toPoints(cloth.state.v, v);
  ahead = x;
  for (std::size_t i = 0; i < x.size(); ++i)
    ahead[i] += kStep * v[i];
  system.hold(cloth.state);
  system.beginStage({kStep, &ahead, &x, &x, &x, &cloth.state.v}, cloth.inputs);
  solver.beginStage();
  Parts parts;
  parts.assembly = leastSeconds(budget, [&] { system.evaluateHessian(x, HessianKind::semidefinite); });
  long iterations = 0, factorizations = 0;
  parts.solve = leastSeconds(budget, [&] {
    toPoints(kStep * cloth.state.v, d);
    for (const int p : cloth.state.pins)
      point(d, p).setZero();
    solver.solve(d, iterations, factorizations);
  });
  parts.evaluation = leastSeconds(budget, [&] { system.evaluate(x); });
  return parts;
}

/// How far apart two solutions are after each step, in the mean over vertices and steps [m].
struct Trajectory
{
  std::vector<Eigen::Matrix3Xd> x;   ///< after each 10 ms
  double stretch = 0, seconds = 0;   ///< largest; median CPU time of a step
  int iterations = 0, linear_iterations = 0;
};

Trajectory follow(ClothSetup cloth, const ClothOptions& options, int steps, int parts)
{
  ClothStepper stepper(cloth.model, options);
  Trajectory result;
  std::vector<double> seconds;
  for (int k = 0; k < steps * parts; ++k)
  {
    const double start = threadSeconds();
    const StepReport report = stepper.step(cloth.state, cloth.inputs, kStep / parts);
    seconds.push_back(threadSeconds() - start);
    if (!report.ok)
      throw std::runtime_error("implicit_step: " + report.message);
    result.stretch = std::max(result.stretch, report.max_strain);
    result.iterations += report.iterations;
    result.linear_iterations += report.linear_iterations;
    if ((k + 1) % parts == 0)
      result.x.push_back(cloth.state.x);
  }
  std::sort(seconds.begin(), seconds.end());
  result.seconds = seconds[seconds.size() / 2];
  return result;
}

/// What each way to solve a step leaves beside the error of the step's length, over the same fall and swing.
void compareSolvers(StudyContext& context, int side, double membrane)
{
  const bool stiff = membrane != kMembrane;
  const int steps = context.quick() ? 30 : 60;
  const ClothSetup sheet = pinnedSheet(side, membrane);
  ClothOptions options;
  context.progress(0, 1, "solvers, short steps");
  const Trajectory fine = follow(sheet, options, steps, 8);
  options.one_newton_step = true;
  options.solver = ClothSolver::cholesky;
  context.progress(0, 1, "solvers, factorised");
  const Trajectory exact = follow(sheet, options, steps, 1);
  const auto line = [&](const char* name, double tolerance, const Trajectory& t) {
    Row& row = context.row();
    row.set("vertices", side * side)
        .set("membrane_N_m", membrane)
        .set("newton", name)
        .set("step_ms", 1e3 * t.seconds)
        .set("iterations", static_cast<double>(t.iterations) / steps)
        .set("linear_iterations", static_cast<double>(t.linear_iterations) / steps)
        .set("largest_stretch", t.stretch)
        .set("error_mm", 1e3 * rmsDistance(t.x, fine.x))
        .set("solver_error_mm", 1e3 * rmsDistance(t.x, exact.x));
    if (tolerance > 0)
      row.set("tolerance", tolerance);
  };
  context.row()
      .set("vertices", side * side)
      .set("membrane_N_m", membrane)
      .set("newton", "full, an eighth of the step")
      .set("largest_stretch", fine.stretch);
  line("one step, cholesky", 0, exact);
  double over_factorised = 0, over_step = 0;
  options.solver = ClothSolver::gauss_seidel;
  for (const double tolerance : stiff ? std::vector<double>{5e-3, 1e-3} : std::vector<double>{0.05, 0.02, 5e-3, 1e-3})
  {
    context.progress(0, 1, "solvers, iterations");
    options.linear_tolerance = tolerance;
    const Trajectory t = follow(sheet, options, steps, 1);
    line("one step, gauss_seidel", tolerance, t);
    if (tolerance == ClothOptions{}.linear_tolerance)
    {
      over_factorised = std::max(over_factorised, rmsDistance(t.x, fine.x) / rmsDistance(exact.x, fine.x));
      over_step = std::max(over_step, rmsDistance(t.x, exact.x) / rmsDistance(exact.x, fine.x));
    }
  }
  context.metric(stiff ? "error_over_factorised_stiff" : "error_over_factorised", over_factorised);
  context.metric(stiff ? "solver_error_over_step_error_stiff" : "solver_error_over_step_error", over_step);
  options.linear_tolerance = ClothOptions{}.linear_tolerance;
  options.one_newton_step = false;
  for (const ClothSolver solver : {ClothSolver::gauss_seidel, ClothSolver::cholesky})
  {
    options.solver = solver;
    line((std::string("full, ") + nameOf(solver)).c_str(), 0, follow(sheet, options, steps, 1));
  }
}

}   // namespace

void runImplicitStep(StudyContext& context)
{
  const std::vector<int> sides = context.quick() ? std::vector<int>{20, 40, 80} : std::vector<int>{20, 40, 80, 160};
  Plot& plot = context.plot("implicit_step", "Sheet pinned at two corners, dt 10 ms: time of a step", "vertices",
                            "CPU time [ms]");
  std::vector<double> vertices, times;
  for (const int side : sides)
    for (const bool newton : {false, true})
    {
      if (newton && side > (context.quick() ? 40 : 80))
        continue;
      context.progress(side, sides.back(), std::to_string(side * side) + " vertices");
      ClothSetup cloth = pinnedSheet(side, kMembrane);
      ClothOptions options;
      options.one_newton_step = !newton;
      ClothStepper stepper(cloth.model, options);
      std::vector<double> seconds, factorings;
      int iterations = 0, linear = 0;
      double strain = 0;
      const int steps = newton ? 10 : context.quick() ? 30 : 60;
      for (int k = 0; k < steps; ++k)
      {
        const double start = threadSeconds();
        const StepReport report = stepper.step(cloth.state, cloth.inputs, kStep);
        seconds.push_back(threadSeconds() - start);
        if (!report.ok)
          throw std::runtime_error("implicit_step: " + report.message);
        iterations += report.iterations;
        linear += report.linear_iterations;
        strain = std::max(strain, report.max_strain);
        if (k % 10 == 5)   // between the steps: both see the same machine
          factorings.push_back(factorSeconds(cloth, 0.0));
      }
      seconds.erase(seconds.begin());   // factors what stays
      std::sort(seconds.begin(), seconds.end());
      const double median = seconds[seconds.size() / 2],
                   factoring = *std::min_element(factorings.begin(), factorings.end());
      Row& row = context.row();
      row.set("vertices", side * side)
          .set("newton", newton ? "full" : "one step")
          .set("solver", nameOf(options.solver))
          .set("step_ms", 1e3 * median)
          .set("least_ms", 1e3 * seconds.front())
          .set("iterations", static_cast<double>(iterations) / steps)
          .set("linear_iterations", static_cast<double>(linear) / steps)
          .set("factorisation_ms", 1e3 * factoring)
          .set("step_over_factorisation", median / factoring)
          .set("largest_stretch", strain);
      plot.at(newton ? "step, full Newton" : "step, one Newton step").x.push_back(side * side);
      plot.at(newton ? "step, full Newton" : "step, one Newton step").y.push_back(1e3 * median);
      if (newton)
        continue;
      plot.at("one factorisation").x.push_back(side * side);
      plot.at("one factorisation").y.push_back(1e3 * factoring);
      const Parts parts = partsOf(cloth, options, 0.05);
      row.set("assembly_ms", 1e3 * parts.assembly)
          .set("solve_ms", 1e3 * parts.solve)
          .set("evaluation_ms", 1e3 * parts.evaluation);
      // what the linear solver leaves, over what the step moves
      ClothState one = cloth.state, exact = cloth.state;
      ClothOptions direct = options;
      direct.solver = ClothSolver::cholesky;
      ClothStepper factored(cloth.model, direct);
      if (stepper.step(one, cloth.inputs, kStep).ok && factored.step(exact, cloth.inputs, kStep).ok)
        row.set("solve_error", (one.x - exact.x).norm() / (exact.x - cloth.state.x).norm());
      vertices.push_back(side * side);
      times.push_back(median);
      context.metric("step_over_factorisation_" + std::to_string(side * side), median / factoring);
    }
  for (const double membrane : {kMembrane, kStiffMembrane})
    compareSolvers(context, context.quick() ? 20 : 40, membrane);
  context.metric("growth_exponent", std::log(times.back() / times[1]) / std::log(vertices.back() / vertices[1]));
  context.note(
      "factorisation: METIS on the graph of points, CHOLMOD's analysis, wide supernodes, one thread, the same matrix, "
      "between the steps; least of all.");
  context.note(
      "rows with error_mm: over one trajectory, against full Newton with an eighth of the step; solver_error_mm: "
      "against one Newton step, factorised. "
      "The stretch is that of the two triangles at the pins: it grows as the mesh gets finer and the sheet swings "
      "through, whatever the solver.");
  context.note("solve_error: of the last step's positions against a factorised solve, over the step's motion.");
}

const StudyRegistration kImplicitStepRegistration{
    "implicit_step", "a sheet pinned at two corners: a step and its parts beside one factorisation of its matrix",
    runImplicitStep};

}   // namespace slender::study
