// A cloth as a part of an island, with the least of an island around it: one part, and Newton's method.
#include "cloth/cloth_part.h"

#include <gtest/gtest.h>

#include "slender_sim/cloth/cloth_stepper.h"
#include "test/support/cloths.h"
#include "test/support/part_driver.h"

namespace slender::test {
namespace {

constexpr double kPartStep = 0.01;    // [s]
constexpr double kTolerance = 1e-8;   // of Newton's method

/// Held at two corners, of which one moves, waving in the wind with damping and an extra force.
struct Busy
{
  std::shared_ptr<ClothModel> model;
  ClothState state;
  ClothInputs inputs;

  explicit Busy(BendingModel bending, int cells = 6)
    : model(std::make_shared<ClothModel>(buildCloth("sheet", gridMesh(0.5, 0.4, cells, 0, GridPattern::alternating),
                                                    0.2, isotropicMembrane(1e6, 0.3, 1e-3))))
  {
    model->bending = bending;
    model->bending_modulus = 1e-4;
    model->mass_damping = 0.3;
    model->stiffness_damping = 2e-4;
    model->wind_coefficient = 0.4;
    state = makeClothState(*model, model->rest.vertices);
    Random random(37);
    for (Eigen::Index i = 0; i < state.x.cols(); ++i)
    {
      state.x.col(i) += random.vector(2e-3);
      state.v.col(i) = random.vector(0.5);
    }
    pin({0, cells});
    inputs.wind = Vector3d(1, 0.3, 4);
    inputs.forces = Matrix3Xd::Zero(3, state.x.cols());
    inputs.forces.col(20) << 0.01, 0.02, -0.03;
  }
  void pin(const std::vector<int>& vertices)
  {
    pinVertices(state, vertices);
    inputs.pins.resize(3, static_cast<Eigen::Index>(state.pins.size()));
    movePins(Vector3d::Zero());
  }
  /// Where the pins are at the end of the next step; the last one moves.
  void movePins(const Vector3d& by)
  {
    for (std::size_t k = 0; k < state.pins.size(); ++k)
      inputs.pins.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
    inputs.pins.rightCols<1>() += by;
  }
};

ClothOptions partOptions(ClothSolver solver, double linear_tolerance = 1e-6)
{
  ClothOptions o;
  o.solver = solver;
  o.linear_tolerance = linear_tolerance;
  o.newton.tolerance = kTolerance;
  return o;
}

StepPlan implicitEuler()
{
  StepPlan plan;
  planStep(Integrator::implicit_euler, 1.0, kPartStep, 0.0, plan);
  return plan;
}

/// A part that has begun the stage of a step.
struct Begun
{
  ClothPart part;
  StepPlan plan = implicitEuler();

  Begun(const Busy& cloth, const ClothOptions& o) : part(cloth.model, o)
  {
    part.begin(cloth.state, cloth.inputs, kPartStep);
    EXPECT_EQ(part.beginSubstep(plan, {0.0, kPartStep, kPartStep}), StepFailure::none);
    part.beginStage(0);
  }
};

VectorXd partGradient(const Part& part)
{
  VectorXd right(part.unknowns());
  part.takeGradient(right.data());
  return -right;
}

using PartCase = std::tuple<BendingModel, ClothSolver, bool>;

class ClothPartInSteps : public ::testing::TestWithParam<PartCase>
{};

std::string nameOf(const ::testing::TestParamInfo<PartCase>& info)
{
  const auto [bending, solver, coupled] = info.param;
  const char* const solvers[] = {"cholesky", "gauss_seidel"};
  return std::string(toString(bending)) + "_" + solvers[static_cast<int>(solver)] + (coupled ? "_coupled" : "_alone");
}

/// Newton's last increment is below the tolerance in both programs, and the error that is left is no larger than that
/// increment. Forces differ by the stiffness of an element times that. Each step begins where the stepper's last one
/// ended, so that differences do not grow.
TEST_P(ClothPartInSteps, AreThoseOfAClothOnItsOwn)
{
  const auto [bending, solver, coupled] = GetParam();
  Busy cloth(bending);
  const ClothOptions o = partOptions(solver);
  ClothStepper stepper(cloth.model, o);
  ClothPart part(cloth.model, o);
  PartDriver driver(part, coupled);
  const StepPlan plan = implicitEuler();
  const double most = 2.0 * kTolerance * part.work().shortestEdge();
  const double stiffness = 8.0 * (cloth.model->membrane.c11 + cloth.model->mass.maxCoeff() / (kPartStep * kPartStep));
  int iterations = 0, own_iterations = 0;
  for (int k = 0; k < 8; ++k)
  {
    cloth.movePins(Vector3d(-0.002, 0.001, 0.003));
    ClothState reached = cloth.state;
    part.begin(reached, cloth.inputs, kPartStep);
    StepReport report;
    // in two substeps every other time
    const int parts = 1 + k % 2;
    ASSERT_TRUE(part.accepts(reached, cloth.inputs, kPartStep, report)) << report.message;
    for (int s = 0; s < parts; ++s)
    {
      const Substep substep{s * kPartStep / parts, (s + 1) * kPartStep / parts, kPartStep / parts};
      StepPlan own;
      planStep(Integrator::implicit_euler, 1.0, substep.length, 0.0, own);
      ASSERT_EQ(part.beginSubstep(own, substep), StepFailure::none);
      part.beginStage(0);
      const NewtonResult result = driver.solve(o.newton);
      ASSERT_TRUE(result.ok()) << static_cast<int>(result.failure);
      iterations += parts == 1 ? result.iterations : 0;
      part.endStage(0, true, report);
      part.acceptSubstep(substep);
    }
    part.end(reached);
    if (parts == 1)
    {
      const StepReport own = stepper.step(cloth.state, cloth.inputs, kPartStep);
      ASSERT_TRUE(own.ok) << own.message;
      own_iterations += own.iterations;
      EXPECT_LE((reached.x - cloth.state.x).colwise().norm().maxCoeff(), most) << k;
      EXPECT_LE((reached.v - cloth.state.v).colwise().norm().maxCoeff(), most / kPartStep) << k;
      EXPECT_LE((part.work().pin_forces - stepper.pinForces()).colwise().norm().maxCoeff(), stiffness * most) << k;
      EXPECT_GT(report.max_strain, 0.0);
      EXPECT_NEAR(report.max_strain, own.max_strain, 1e-6 * own.max_strain);
    }
    else   // two half steps
    {
      ClothState half = cloth.state;
      ClothInputs first = cloth.inputs;
      for (std::size_t p = 0; p < half.pins.size(); ++p)
        first.pins.col(static_cast<Eigen::Index>(p)) =
            0.5 * (half.x.col(half.pins[p]) + cloth.inputs.pins.col(static_cast<Eigen::Index>(p)));
      ASSERT_TRUE(stepper.step(half, first, 0.5 * kPartStep).ok);
      ASSERT_TRUE(stepper.step(half, cloth.inputs, 0.5 * kPartStep).ok);
      // the first half's difference moves the second half's start and velocity
      EXPECT_LE((reached.x - half.x).colwise().norm().maxCoeff(), 4.0 * most) << k;
      cloth.state = half;
    }
  }
  EXPECT_GT(own_iterations, 0);
  // They are not bought with more iterations. Half as many again are for the other rules by which Newton's method ends.
  EXPECT_LE(iterations, own_iterations + own_iterations / 2);
}

INSTANTIATE_TEST_SUITE_P(Cases, ClothPartInSteps,
                         ::testing::Combine(::testing::Values(BendingModel::none, BendingModel::hinge,
                                                              BendingModel::isometric_nonconforming,
                                                              BendingModel::isometric_conforming),
                                            ::testing::Values(ClothSolver::cholesky, ClothSolver::gauss_seidel),
                                            ::testing::Bool()),
                         nameOf);

class ClothPartDerivatives : public ::testing::TestWithParam<std::tuple<BendingModel, ClothSolver>>
{};

/// At a configuration away from the minimum, with the exact Hessian, which is definite there because the cloth is
/// stretched.
TEST_P(ClothPartDerivatives, AreThoseOfTheEnergy)
{
  const auto [bending, solver] = GetParam();
  Busy cloth(bending);
  cloth.state.x *= 1.1;
  cloth.state.v *= 0.1;
  cloth.movePins(Vector3d::Zero());
  Begun begun(cloth, partOptions(solver));
  Part& part = begun.part;
  PartDriver driver(part, true);
  driver.begin();
  const int n = part.unknowns();
  ASSERT_EQ(n, 3 * (part.points() - 2));
  Random random(5);
  VectorXd d(n);
  for (int i = 0; i < n; ++i)
    d[i] = random.vector(1e-3).x();
  driver.evaluate(true);
  driver.accept();
  part.takeDirection(d.data());   // small: from now on the Hessian is the exact one
  driver.moveAlong(1.0);
  driver.accept();
  driver.accept();   // no stress is extrapolated from an iterate to itself
  ASSERT_TRUE(driver.evaluate(true).inertia.positiveDefinite());
  const VectorXd gradient = partGradient(part);
  ASSERT_GT(gradient.norm(), 0.0);

  for (int trial = 0; trial < 5; ++trial)
  {
    VectorXd right(n);
    for (int i = 0; i < n; ++i)
      right[i] = random.vector(1.0).x();
    std::copy_n(right.data(), n, driver.matrix.solution());
    driver.matrix.solve();
    const VectorXd along = Eigen::Map<const VectorXd>(driver.matrix.solution(), n);
    part.takeDirection(along.data());
    const double size = 1e-6 / along.lpNorm<Eigen::Infinity>();
    driver.moveAlong(size);
    const double energy_ahead = driver.evaluate(false).energy();
    const VectorXd ahead = partGradient(part);
    driver.moveAlong(-size);
    const double energy_behind = driver.evaluate(false).energy();
    const VectorXd behind = partGradient(part);
    // Central differences: rounding of 1e-16 of the energy over 1e-6 m, and third derivatives times 1e-12 m^2.
    EXPECT_NEAR((energy_ahead - energy_behind) / (2 * size), gradient.dot(along),
                1e-6 * gradient.norm() * along.norm());
    EXPECT_LE(((ahead - behind) / (2 * size) - right).norm(), 2e-5 * right.norm()) << trial;
  }
}

/// The last direction was large or a shift of positions is asked for: the matrix is definite anywhere.
TEST_P(ClothPartDerivatives, TheHessianFarAwayIsDefinite)
{
  const auto [bending, solver] = GetParam();
  Busy cloth(bending);
  Random random(11);
  for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)   // crumpled, and compressed to a third
    cloth.state.x.col(i) = 0.3 * cloth.state.x.col(i) + random.vector(0.02);
  cloth.movePins(Vector3d::Zero());
  for (const bool coupled : {false, true})
  {
    Begun begun(cloth, partOptions(solver));
    PartDriver driver(begun.part, coupled);
    driver.begin();
    EXPECT_TRUE(driver.evaluate(true).inertia.positiveDefinite());
    driver.accept();
    driver.solve();
    EXPECT_LT(driver.slope(), 0.0);
    // The same matrix plus 0.7 times the weights of inertia moves the cloth by less.
    const double size = driver.incrementSize();
    HessianShift shift;
    shift.position = 0.7;
    EXPECT_TRUE(driver.evaluate(true, shift).inertia.positiveDefinite());
    driver.solve();
    EXPECT_LT(driver.incrementSize(), size);
    EXPECT_GT(driver.incrementSize(), 0.0);
  }
}

/// A step is solved from a crumpled start, where the exact Hessian is not definite at first.
TEST_P(ClothPartDerivatives, NewtonsMethodEndsFromACrumpledStart)
{
  const auto [bending, solver] = GetParam();
  Busy cloth(bending);
  Random random(11);
  for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)
    cloth.state.x.col(i) = 0.8 * cloth.state.x.col(i) + random.vector(0.01);
  cloth.movePins(Vector3d::Zero());
  for (const bool coupled : {false, true})
  {
    Begun begun(cloth, partOptions(solver));
    PartDriver driver(begun.part, coupled);
    NewtonConfig newton;
    newton.tolerance = kTolerance;
    newton.max_iterations = 100;
    const NewtonResult result = driver.solve(newton);
    EXPECT_TRUE(result.ok()) << coupled << " " << static_cast<int>(result.failure);
    EXPECT_LT(result.residual, 1e-6) << coupled;
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, ClothPartDerivatives,
                         ::testing::Combine(::testing::Values(BendingModel::hinge,
                                                              BendingModel::isometric_nonconforming),
                                            ::testing::Values(ClothSolver::cholesky, ClothSolver::gauss_seidel)));

/// Contacts with what moves as prescribed: in the part's own matrix, or in that of the island.
TEST(ClothPart, TakesContactsIntoItsOwnMatrix)
{
  constexpr int kFirstPoint = 7;
  for (const ClothSolver solver : {ClothSolver::cholesky, ClothSolver::gauss_seidel})
  {
    const Busy cloth(BendingModel::hinge);
    const auto& triangles = cloth.model->rest.triangles;
    ContactTerm term, at_pin;
    ContactRow row;
    for (int p = 0; p < 3; ++p)
    {
      term.point[p] = kFirstPoint + triangles(p, 10);
      term.weight[p] = 0.2 + 0.15 * p;
      row.point[p] = kFirstPoint + triangles(p, 20);
      row.along[p] = 0.5 - 0.1 * p;
    }
    at_pin.point[0] = kFirstPoint + cloth.state.pins[0];
    at_pin.weight[0] = 1.0;
    at_pin.force << 3, -2, 1;
    at_pin.stiffness = 500.0 * Eigen::Matrix3d::Identity();
    const Vector3d normal = Vector3d(0.2, -0.3, 0.9).normalized();
    term.solid = at_pin.solid = 0;
    term.force << 0.1, 0.2, 0.7;
    term.stiffness = 300.0 * normal * normal.transpose() + 20.0 * Eigen::Matrix3d::Identity();
    row.normal = normal;
    row.stiffness = 80.0;
    VectorXd directions[3];
    for (int k = 0; k < 3; ++k)   // own matrix, that of the island, own matrix without contacts
    {
      Begun begun(cloth, partOptions(solver, 1e-11));
      Part& part = begun.part;
      part.first_point = kFirstPoint;
      if (k < 2)
      {
        part.own_terms = {&term, &at_pin};
        part.own_rows = {&row};
      }
      PartDriver driver(part, k == 1);
      driver.begin();
      ASSERT_TRUE(driver.evaluate(true).inertia.positiveDefinite());
      driver.accept();
      driver.solve();
      VectorXd& d = directions[k];
      d.resize(3 * part.points());
      for (int i = 0; i < part.points(); ++i)
        d.segment<3>(3 * i) = part.move(i);
      EXPECT_EQ(part.move(cloth.state.pins[0]), Vector3d::Zero());
    }
    // Conjugate gradients stop at 1e-11 in the norm of their preconditioner.
    EXPECT_LE((directions[0] - directions[1]).norm(), 1e-8 * directions[1].norm());
    EXPECT_GT((directions[0] - directions[2]).norm(), 1e-3 * directions[1].norm());
  }
}

TEST(ClothPart, ShowsItsVerticesAsASurface)
{
  Busy cloth(BendingModel::hinge);
  cloth.movePins(Vector3d(0.01, 0.0, 0.02));
  Begun begun(cloth, partOptions(ClothSolver::cholesky));
  Part& part = begun.part;
  part.first_point = 3;
  part.offset = 100;
  EXPECT_FALSE(part.numberUnknowns());
  EXPECT_TRUE(part.numberUnknowns());
  const int n = static_cast<int>(cloth.state.x.cols()), pin = cloth.state.pins[1];
  ASSERT_EQ(part.points(), n);
  EXPECT_EQ(part.base(pin), Part::kPrescribed);
  EXPECT_EQ(part.base(1), 100);   // vertex 0 is pinned
  Part::Columns row;
  part.addColumns(pin, 1, 0.5, row);
  EXPECT_EQ(row.count, 0);
  part.addColumns(2, 1, 0.5, row);
  ASSERT_EQ(row.count, 1);
  EXPECT_EQ(row.index[0], 104);
  EXPECT_EQ(row.value[0], 0.5);

  // where pins are in the course of the step
  Matrix3Xd x = Matrix3Xd::Zero(3, n + 3), start = x;
  part.gatherStart(start);
  EXPECT_EQ(start.rightCols(n), cloth.state.x);
  part.gather(x);
  EXPECT_TRUE(x.col(3 + pin).isApprox(cloth.inputs.pins.col(1)));
  EXPECT_TRUE(part.heldMoves(0.2, 0.7));
  EXPECT_TRUE(part.heldMoves(1.0, 1.0));   // as long as the trial has the pin elsewhere than the base
  part.placeHeld(0.25);
  part.gather(x);
  EXPECT_TRUE(x.col(3 + pin).isApprox(0.75 * start.col(3 + pin) + 0.25 * cloth.inputs.pins.col(1)));
  part.accept();
  EXPECT_FALSE(part.heldMoves(0.25, 0.25));

  // half of the way back to a base
  part.saveBase();
  part.placeHeld(1.0);
  VectorXd d = VectorXd::Constant(part.offset + part.unknowns(), 1e-3);
  part.takeDirection(d.data());
  part.moveAlong(1.0);
  part.retreat(0.5);
  Matrix3Xd half = x;
  part.gather(half);
  EXPECT_TRUE((half.col(3 + 5) - x.col(3 + 5)).isApprox(Vector3d::Constant(0.5e-3), 1e-9));
  part.accept();
  part.restoreBase();
  part.moveAlong(0.0);
  part.gather(half);
  EXPECT_EQ(half, x);

  // Other vertices are held in another step.
  cloth.state.pins.pop_back();
  cloth.pin({4, 9});
  begun.part.begin(cloth.state, cloth.inputs, kPartStep);
  begun.part.beginSubstep(begun.plan, {0.0, kPartStep, kPartStep});
  EXPECT_FALSE(part.numberUnknowns());
  EXPECT_EQ(part.unknowns(), 3 * (n - 3));
  EXPECT_EQ(part.base(4), Part::kPrescribed);
}

TEST(ClothPart, LimitsTurnsOfEdges)
{
  const Busy cloth(BendingModel::none);
  Begun begun(cloth, partOptions(ClothSolver::cholesky));
  Part& part = begun.part;
  part.numberUnknowns();
  VectorXd d = VectorXd::Zero(part.unknowns());
  d[part.base(20) + 2] = 0.5;   // [m], far more than an edge
  part.takeDirection(d.data());
  EXPECT_EQ(part.stepLimit(), 1.0);   // without contact
  begun.part.setContact({}, kPartStep);
  d[part.base(20) + 2] = 0.0;
  part.takeDirection(d.data());
  EXPECT_EQ(part.stepLimit(), 1.0);
  d[part.base(20) + 2] = 0.5;
  part.takeDirection(d.data());
  const double edge = begun.part.work().shortestEdge();
  EXPECT_DOUBLE_EQ(part.stepLimit(), 0.7 * edge / 0.5);
  EXPECT_DOUBLE_EQ(part.incrementSize(1.0), 0.5 / edge);
}

TEST(ClothPart, RefusesWhatItCannotSolve)
{
  const auto messageOf = [](const ClothModel& model, const ClothOptions& o) -> std::string {
    try
    {
      ClothPart part(std::make_shared<ClothModel>(model), o);
      return "";
    }
    catch (const std::invalid_argument& e)
    {
      return e.what();
    }
  };
  const Busy cloth(BendingModel::none);
  ClothOptions o;
  EXPECT_EQ(messageOf(*cloth.model, o), "");
  for (const Integrator other : {Integrator::tr_bdf2, Integrator::imex, Integrator::symplectic_euler})
  {
    o.integrator = other;
    EXPECT_NE(messageOf(*cloth.model, o).find("need time.integrator: implicit_euler"), std::string::npos);
  }
  ClothModel tracking = *cloth.model;
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights(1, tracking.vertices());
  weights.insert(0, 3) = 1.0;
  tracking.averages.push_back({std::make_shared<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(weights), {}});
  EXPECT_EQ(messageOf(tracking, {}), "");
  tracking.averages[0].bounds = Eigen::VectorXd::Constant(1, 2.0);
  o = {};
  o.one_newton_step = true;
  EXPECT_NE(messageOf(tracking, o).find("max_traction"), std::string::npos);

  ClothPart part(cloth.model, {});
  ClothInputs inputs = cloth.inputs;
  inputs.pins(0, 0) = NAN;
  StepReport report;
  EXPECT_FALSE(part.accepts(cloth.state, inputs, kPartStep, report));
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("pin positions"), std::string::npos);
}

}   // namespace
}   // namespace slender::test
