// Quadratic isometric bending beside nonlinear hinges, as thesis table 2.1: what a gradient, a Hessian and whole steps
// cost.
//
// Implicit steps are compared twice. Solved as ClothStepper does, both models take the same conjugate gradients: small
// meshes by symmetric sweeps, large ones by the constant n x n factor of mass and rest membrane, in which there is no
// bending at these stiffnesses, so that hinges lose nothing with it. Either way most of a step is the solution, and the
// ratio is near 1 (implicit_step_speedup_min): the isometric model saves the assembly of its Hessian, not the solution.
// Hinges solved as is usual are compared besides: factored in every step, or by conjugate gradients preconditioned by
// the inverse diagonal blocks or by their own Hessian at rest, to the same error; whichever is fastest
// (..._over_usual_hinge_solvers_min).
#include <cmath>

#include <Eigen/LU>

#include "study/cloth/cloth_cases.h"
#include "slender_sim/energy/hinge_term.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/point_kernel.h"
#include "slender_sim/linalg/sparse_cholesky.h"
#include "slender_sim/study/study.h"
#include "cloth/cloth_linear_solver.h"

namespace slender::study {

namespace {

/// Thesis table 2.1 [ms]: hinge and isometric model.
struct Published
{
  int vertices;
  bool regular;
  double gradient[2], hessian[2], explicit_step[2], implicit_step[2];
};

constexpr Published kDrape[] = {{400, true, {0.937, 0.081}, {12.8, 0.237}, {3.81, 2.63}, {28.6, 11.0}},
                                {1600, true, {3.45, 0.338}, {54.2, 0.963}, {6.64, 2.90}, {138, 62.7}},
                                {6400, true, {16.4, 2.19}, {218, 3.87}, {27.5, 11.9}, {470, 168}},
                                {25600, true, {66.6, 9.15}, {890, 15.7}, {112, 48.8}, {1730, 505}},
                                {450, false, {1.10, 0.098}, {15.2, 0.266}, {2.16, 0.964}, {33.9, 13.6}},
                                {2100, false, {5.43, 0.494}, {77.2, 1.28}, {9.53, 4.35}, {219, 103}},
                                {6500, false, {17.6, 2.32}, {246, 3.99}, {31.4, 15.2}, {557, 219}},
                                {22500, false, {67.8, 9.68}, {888, 13.6}, {140, 76.5}, {1880, 612}}};
constexpr Published kFlag[] = {{400, true, {0.975, 0.085}, {13.4, 0.251}, {1.73, 0.780}, {27.6, 9.53}},
                               {1600, true, {3.99, 0.341}, {54.8, 0.974}, {7.05, 3.26}, {106, 32.9}},
                               {6400, true, {16.0, 2.14}, {212, 3.79}, {27.7, 13.3}, {420, 127}},
                               {25600, true, {64.0, 8.75}, {849, 14.99}, {112, 53.4}, {1680, 490}},
                               {450, false, {1.10, 0.099}, {15.2, 0.267}, {1.97, 0.900}, {33.5, 12.5}},
                               {2100, false, {5.43, 0.490}, {77.4, 1.30}, {9.80, 4.54}, {155, 50.4}},
                               {6500, false, {17.8, 2.31}, {247, 3.96}, {32.7, 16.1}, {513, 166}},
                               {22500, false, {68.7, 9.28}, {887, 13.7}, {134, 70.0}, {1880, 608}}};

constexpr double kImplicitStep = 0.01, kExplicitStep = 2e-5;   // [s]

ClothSetup sheet(const TriangleMesh& mesh, BendingModel bending, bool flag)
{
  ClothModel model = buildCloth("sheet", mesh, 0.15, isotropicMembrane(1e6, 0.3, 1e-3));
  model.bending = bending;
  model.bending_modulus = 1e-4;
  if (flag)
    model.wind_coefficient = 0.6;
  else
    model.mass_damping = 1.0;
  ClothSetup cloth(std::move(model));
  cloth.pin(verticesWhere(mesh, [flag](const Eigen::Vector3d& p) {
    return flag ? p.x() < 1e-9 : (p.x() < 1e-9 || p.x() > 1 - 1e-9) && (p.y() < 1e-9 || p.y() > 1 - 1e-9);
  }));
  cloth.inputs.gravity = flag ? Eigen::Vector3d(0, -9.81, 0) : Eigen::Vector3d(0, 0, -9.81);
  if (flag)
    cloth.inputs.wind = Eigen::Vector3d(5, 0, 0.7);
  return cloth;
}

ClothOptions linearized()
{
  ClothOptions options;
  options.one_newton_step = true;
  return options;
}

/// Least CPU time of a step [s] over consecutive ones from the state given; NaN if one is refused.
double stepSeconds(const ClothSetup& cloth, const ClothOptions& options, double h, int steps)
{
  ClothStepper stepper(cloth.model, options);
  ClothState state = cloth.state;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < steps; ++k)
  {
    const double start = threadSeconds();
    if (!stepper.step(state, cloth.inputs, h).ok)
      return std::numeric_limits<double>::quiet_NaN();
    if (k > 0)   // the first one factors the preconditioner
      least = std::min(least, threadSeconds() - start);
  }
  return least;
}

/// Least time [s] in which as many bytes can be read, from two streams.
double readSeconds(double bytes)
{
  const int points = static_cast<int>(bytes / 64);
  const PointVector a(4 * static_cast<std::size_t>(points), 1.0), b = a;
  volatile double sum = 0;
  return leastSeconds(0.05, [&] { sum = pointKernels().dot(points, a.data(), b.data()); });
}

/// Time [s] of assembly and solution only, by conjugate gradients; infinite where that takes longer than a limit.
struct UsualSolvers
{
  double block_diagonal, rest_hessian;
};

/// Each with the loosest tolerance that leaves no more error, in the norm of the matrix, than the step's own solution
/// does.
UsualSolvers usualSolvers(const ClothSetup& hinged, double limit)
{
  constexpr int kTimed = 5;   // iterations
  const int n = hinged.model->vertices();
  ClothOptions options = linearized();
  ClothSystem system(*hinged.model, false);
  ClothLinearSolver solver(options, system);
  PointVector x, ahead, rest, guess, right(4 * n, 0.0), product(4 * n, 0.0), correction(4 * n, 0.0), exact(4 * n, 0.0),
      away(4 * n, 0.0);
  toPoints(hinged.state.x, x);
  toPoints(hinged.model->rest.vertices, rest);
  toPoints(kImplicitStep * hinged.state.v, guess);
  ahead = x;
  for (std::size_t i = 0; i < x.size(); ++i)
    ahead[i] += guess[i];
  for (const int p : hinged.state.pins)
    point(guess, p).setZero();
  system.hold(hinged.state);
  system.beginStage({kImplicitStep, &ahead, &x, &x, &x, &hinged.state.v}, hinged.inputs);
  solver.beginStage();
  const std::vector<char>& held = system.held();
  const auto clearHeld = [&](PointVector& v) {
    for (const int p : hinged.state.pins)
      point(v, p).setZero();
  };
  const auto apply = [&](const PointVector& p, PointVector& ap) {
    system.applyMatrix(p, ap);
    clearHeld(ap);
  };
  const auto assemble = [&] {
    system.evaluateHessian(x, HessianKind::semidefinite);
    system.applyMatrix(guess, product);
    for (std::size_t i = 0; i < right.size(); ++i)
      right[i] = -system.gradient()[i] - product[i];
    clearHeld(right);
  };

  SparseCholesky at_rest, here;
  at_rest.setPattern(system.matrix());
  here.setPattern(system.matrix());
  system.evaluateHessian(rest, HessianKind::semidefinite);
  bool factored = at_rest.factor(system.matrix(), held.data());
  assemble();
  factored = here.factor(system.matrix(), held.data()) && factored;
  if (!factored)
    throw std::runtime_error("ibm_vs_hinge: the hinges' matrix is not positive definite");
  here.solvePoints(right.data(), exact.data());
  const auto error = [&](const PointVector& c) {
    for (std::size_t i = 0; i < away.size(); ++i)
      away[i] = c[i] - exact[i];
    apply(away, product);
    return std::sqrt(pointKernels().dot(n, away.data(), product.data()));
  };
  PointVector moved = guess;
  long iterations = 0, factorizations = 0;
  solver.solve(moved, iterations, factorizations);
  for (std::size_t i = 0; i < moved.size(); ++i)
    moved[i] -= guess[i];
  const double allowed = error(moved);

  std::vector<Eigen::Matrix3d> inverse(n);
  ConjugateGradients cg;
  cg.resize(4 * static_cast<std::size_t>(n));
  const auto seconds = [&](auto prepare, auto precondition) {
    prepare();
    const auto iterationsWithin = [&](double tolerance, int most) {
      return cg.solve(right, correction, tolerance, most, apply, precondition).iterations;
    };
    const double each = leastSeconds(0.0, [&] { iterationsWithin(0.0, kTimed); }) / kTimed;
    const int most = static_cast<int>(std::ceil(limit / each));
    double tolerance = 0.1;
    while (iterationsWithin(tolerance, most) < most && error(correction) > allowed)
      tolerance *= 0.5;
    if (error(correction) > allowed)
      return std::numeric_limits<double>::infinity();
    return leastSeconds(0.0, [&] {
      assemble();
      prepare();
      iterationsWithin(tolerance, most);
    });
  };
  UsualSolvers result;
  result.block_diagonal = seconds(
      [&] {
        for (int i = 0; i < n; ++i)
          inverse[i] = Eigen::Map<const Eigen::Matrix3d>(system.matrix().values() +
                                                         9 * static_cast<std::size_t>(system.matrix().starts()[i]))
                           .inverse();
      },
      [&](const PointVector& r, PointVector& z) {
        for (int i = 0; i < n; ++i)
          point(z, i) = inverse[i] * point(r, i);
      });
  result.rest_hessian =
      seconds([] {}, [&](const PointVector& r, PointVector& z) { at_rest.solvePoints(r.data(), z.data()); });
  return result;
}

struct BendingCosts
{
  double gradient[2], hessian[2], explicit_step[2], implicit_step[2];   ///< hinge, isometric [s]
  double factored_step;                                                 ///< implicit, hinges, by Cholesky [s]
  UsualSolvers usual;                                                   ///< likewise, by conjugate gradients
  double product_over_bound;
  double small_bend_difference;   ///< of the two gradients at small bend angles, over the gradient [-]
};

/// Difference of the two models' gradients where the mesh is bent a little, over the gradient's norm. Isometric bending
/// is the small-angle limit of these hinges, so the difference is of the order of the slope.
double gradientDifference(const TriangleMesh& mesh, HingeTerm& hinges, const PointMatrix& matrix)
{
  Eigen::Matrix3Xd bent = mesh.vertices;
  for (int i = 0; i < bent.cols(); ++i)
    bent(2, i) += 1e-4 * std::sin(3.0 * bent(0, i) + 2.0 * bent(1, i));   // slopes of at most 3.6e-4
  PointVector x, by_hinges(4 * bent.cols(), 0.0), by_matrix(4 * bent.cols(), 0.0);
  toPoints(bent, x);
  hinges.addGradient(x.data(), by_hinges.data());
  matrix.addProduct(1.0, x.data(), by_matrix.data());
  double difference = 0.0, size = 0.0;
  for (std::size_t i = 0; i < by_hinges.size(); ++i)
  {
    difference += std::pow(by_hinges[i] - by_matrix[i], 2);
    size += std::pow(by_matrix[i], 2);
  }
  return std::sqrt(difference / size);
}

constexpr int kStepsShared = 1000;   // of a scene, over which the constant matrix's assembly is spread

BendingCosts measureBending(const TriangleMesh& mesh, bool flag)
{
  BendingCosts costs{};
  ClothSetup isometric = sheet(mesh, BendingModel::isometric_nonconforming, flag);
  {   // some way into the motion
    ClothStepper stepper(isometric.model, linearized());
    for (int k = 0; k < 15; ++k)
      if (!stepper.step(isometric.state, isometric.inputs, kImplicitStep).ok)
        throw std::runtime_error("ibm_vs_hinge: the sheet's motion failed");
  }
  ClothSetup hinged = sheet(mesh, BendingModel::hinge, flag);
  hinged.state.x = isometric.state.x;
  hinged.state.v = isometric.state.v;

  const MeshTopology& t = hinged.model->topology;
  const auto element = IsometricElement::nonconforming;
  const int n = hinged.model->vertices();
  PointMatrix matrix;
  costs.hessian[1] =
      leastSeconds(0.0,
                   [&] {
                     matrix = isometricBending(mesh, t, element,
                                               1e-4 * bendingCalibration(mesh, t, element, Eigen::Vector3d::UnitX()));
                   }) /
      kStepsShared;
  const double coefficient = 1e-4 * bendingCalibration(mesh, t, element, Eigen::Vector3d::UnitX());
  HingeTerm hinges(t.hinges, hingeStiffness(mesh, t, coefficient), hinged.state.rest_angles);
  costs.small_bend_difference = gradientDifference(mesh, hinges, matrix);
  BlockMatrix blocks(n, {t.hinges});
  hinges.setPattern(blocks);
  PointVector x, gradient(4 * n, 0.0);
  toPoints(isometric.state.x, x);
  for (double& cost : costs.gradient)
    cost = std::numeric_limits<double>::infinity();
  costs.hessian[0] = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k)   // in turn: others use the machine too
  {
    costs.gradient[0] =
        std::min(costs.gradient[0], leastSeconds(0.02, [&] { hinges.addGradient(x.data(), gradient.data()); }));
    costs.gradient[1] =
        std::min(costs.gradient[1], leastSeconds(0.02, [&] { matrix.addProduct(1.0, x.data(), gradient.data()); }));
    costs.hessian[0] = std::min(costs.hessian[0], leastSeconds(0.02, [&] {
                                  blocks.setZero();
                                  hinges.addHessian(HessianKind::exact, x.data(), gradient.data(), blocks.values());
                                }));
  }
  costs.product_over_bound = costs.gradient[1] / readSeconds(matrix.bytes());

  ClothOptions explicit_options;
  explicit_options.integrator = Integrator::symplectic_euler;
  const ClothSetup* setups[] = {&hinged, &isometric};
  for (int k = 0; k < 2; ++k)
    costs.explicit_step[k] = costs.implicit_step[k] = costs.factored_step = std::numeric_limits<double>::infinity();
  ClothOptions factored = linearized();
  factored.solver = ClothSolver::cholesky;
  for (int round = 0; round < 2; ++round)
  {
    costs.factored_step = std::min(costs.factored_step, stepSeconds(hinged, factored, kImplicitStep, 3));
    for (int k = 0; k < 2; ++k)
    {
      costs.explicit_step[k] =
          std::min(costs.explicit_step[k], stepSeconds(*setups[k], explicit_options, kExplicitStep, 10));
      costs.implicit_step[k] =
          std::min(costs.implicit_step[k], stepSeconds(*setups[k], linearized(), kImplicitStep, 6));
    }
  }
  costs.usual = usualSolvers(hinged, costs.factored_step);
  return costs;
}

TriangleMesh meshOf(const Published& size)
{
  if (size.regular)
  {
    const int side = static_cast<int>(std::lround(std::sqrt(size.vertices)));
    return gridMesh(1.0, 1.0, side - 1, side - 1, GridPattern::alternating);
  }
  return gridMesh(1.0, 1.0, static_cast<int>(std::lround(std::sqrt(size.vertices * std::sqrt(0.75)))) - 1, 0,
                  GridPattern::irregular);
}

}   // namespace

void runIbmVsHinge(StudyContext& context)
{
  useOneBlasThread();
  Plot& plot = context.plot("ibm_vs_hinge", "Hinges over isometric bending: time", "vertices", "ratio");
  double gradient = 1e300, hessian = 0, implicit = 1e300, factored = 1e300, over_usual = 1e300, bound = 0,
         bend_difference = 0;
  for (const bool flag : {false, true})
    for (const Published& p : flag ? kFlag : kDrape)
    {
      if (context.quick() && (p.vertices > 7000 || flag != p.regular))
        continue;
      context.progress(p.vertices, 25600, flag ? "flag" : "hung sheet");
      const TriangleMesh mesh = meshOf(p);
      const BendingCosts c = measureBending(mesh, flag);
      const struct
      {
        const char* what;
        const double *here, *published;
      } lines[] = {{"gradient", c.gradient, p.gradient},
                   {"Hessian", c.hessian, p.hessian},
                   {"explicit step", c.explicit_step, p.explicit_step},
                   {"implicit step", c.implicit_step, p.implicit_step}};
      for (const auto& line : lines)
      {
        context.row()
            .set("scene", flag ? "flag" : "hung sheet")
            .set("mesh", p.regular ? "regular" : "irregular")
            .set("vertices", static_cast<double>(mesh.vertices.cols()))
            .set("part", line.what)
            .set("hinge_ms", 1e3 * line.here[0])
            .set("isometric_ms", 1e3 * line.here[1])
            .set("ratio", line.here[0] / line.here[1])
            .set("thesis_hinge_ms", line.published[0])
            .set("thesis_isometric_ms", line.published[1])
            .set("thesis_ratio", line.published[0] / line.published[1]);
        Series& series =
            plot.at(std::string(line.what) + (flag ? ", flag" : ", hung sheet") + (p.regular ? "" : ", irregular"));
        series.x.push_back(static_cast<double>(mesh.vertices.cols()));
        series.y.push_back(line.here[0] / line.here[1]);
      }
      const std::pair<const char*, double> usual[] = {
          {"implicit step, hinges factored", c.factored_step},
          {"implicit step, hinges by block-diagonal CG", c.usual.block_diagonal},
          {"implicit step, hinges by CG with their rest Hessian", c.usual.rest_hessian}};
      double fastest = std::numeric_limits<double>::infinity();
      for (const auto& [part, seconds] : usual)
      {
        fastest = std::min(fastest, seconds);
        Row& row = context.row();
        row.set("scene", flag ? "flag" : "hung sheet")
            .set("mesh", p.regular ? "regular" : "irregular")
            .set("vertices", static_cast<double>(mesh.vertices.cols()))
            .set("part", part)
            .set("isometric_ms", 1e3 * c.implicit_step[1]);
        if (std::isfinite(seconds))
          row.set("hinge_ms", 1e3 * seconds).set("ratio", seconds / c.implicit_step[1]);
      }
      context.row()
          .set("scene", flag ? "flag" : "hung sheet")
          .set("mesh", p.regular ? "regular" : "irregular")
          .set("vertices", static_cast<double>(mesh.vertices.cols()))
          .set("part", "product over reading its bytes")
          .set("ratio", c.product_over_bound);
      bend_difference = std::max(bend_difference, c.small_bend_difference);
      gradient = std::min(gradient, c.gradient[0] / c.gradient[1]);
      hessian = std::max(hessian, c.hessian[1] / c.hessian[0]);
      implicit = std::min(implicit, c.implicit_step[0] / c.implicit_step[1]);
      factored = std::min(factored, c.factored_step / c.implicit_step[1]);
      over_usual = std::min(over_usual, fastest / c.implicit_step[1]);
      if (p.vertices >
          20000)   // smaller ones stay in the cache next to the processor, where its arithmetic is the bound
        bound = std::max(bound, c.product_over_bound);
    }
  context.metric("small_bend_gradient_difference", bend_difference);
  context.metric("gradient_speedup_min", gradient);
  context.metric("hessian_cost_ratio_max", hessian);
  context.metric("implicit_step_speedup_min", implicit);
  context.metric("implicit_step_speedup_over_factored_hinges_min", factored);
  context.metric("implicit_step_speedup_over_usual_hinge_solvers_min", over_usual);
  if (bound > 0)
    context.metric("product_over_bandwidth_bound", bound);
  context.note("Isometric Hessian: assembled once, spread over 1,000 steps; a step then does nothing for it.");
  context.note(
      "implicit step (implicit_step_speedup_min): both by conjugate gradients to the same tolerance, preconditioned by "
      "sweeps.");
  context.note(
      "implicit_step_speedup_over_usual_hinge_solvers_min: over the fastest of hinges factored in every step, by CG "
      "with their diagonal blocks, and by CG with their Hessian at rest; the last two to the error of the step's own "
      "solution, assembly and solution only; no figure: slower than factoring.");
  context.note("hung sheet: from four corners, damped; the thesis's drape and its collisions are not in these steps.");
  context.note(
      "bandwidth bound: least time of reading as many bytes as a product must move (matrix, x, y), in the same run; "
      "the metric is of the largest meshes.");
}

const StudyRegistration kIbmVsHingeRegistration{
    "ibm_vs_hinge",
    "isometric bending beside hinges, as thesis table 2.1: gradient, Hessian, explicit and implicit steps",
    runIbmVsHinge};

}   // namespace slender::study
