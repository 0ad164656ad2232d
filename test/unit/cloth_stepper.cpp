#include "slender_sim/cloth/cloth_stepper.h"

#include <gtest/gtest.h>

#include "cloth/shifted_matrix.h"
#include "test/support/cloths.h"
#include "test/support/pinned_cloth.h"

namespace slender::test {
namespace {

constexpr BendingModel kBendings[] = {BendingModel::none, BendingModel::hinge, BendingModel::isometric_nonconforming,
                                      BendingModel::isometric_conforming};

ClothModel stiffSheet(BendingModel bending, int cells = 8, GridPattern pattern = GridPattern::alternating)
{
  ClothModel model = buildCloth("sheet", gridMesh(0.5, 0.4, cells, 0, pattern), 0.2, isotropicMembrane(1e6, 0.3, 1e-3));
  model.bending = bending;
  model.bending_modulus = 1e-4;
  return model;
}

/// Held at two corners, waving, with everything at work.
Cloth busy(BendingModel bending)
{
  ClothModel model = stiffSheet(bending);
  model.mass_damping = 0.3;
  model.stiffness_damping = 2e-4;
  model.wind_coefficient = 0.4;
  Cloth cloth(std::move(model));
  Random random(37);
  for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)
  {
    cloth.state.x.col(i) += random.vector(2e-3);
    cloth.state.v.col(i) = random.vector(0.5);
  }
  cloth.pin({0, 8});
  cloth.inputs.pins.col(1) += Vector3d(-0.002, 0.001, 0.003);
  cloth.inputs.wind = Vector3d(1, 0.3, 4);
  cloth.inputs.forces = Matrix3Xd::Zero(3, cloth.state.x.cols());
  cloth.inputs.forces.col(20) << 0.01, 0.02, -0.03;
  return cloth;
}

ClothOptions solverOptions(ClothSolver solver)
{
  ClothOptions o;
  o.solver = solver;
  o.linear_tolerance = 1e-6;
  return o;
}

TEST(ClothStepper, FallsFreely)
{
  for (const BendingModel bending : kBendings)
  {
    Cloth cloth(stiffSheet(bending));
    ClothStepper stepper(cloth.model, {});
    const double h = 0.01;
    for (int k = 0; k < 5; ++k)
      ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, h).ok);
    Matrix3Xd expected = cloth.model->rest.vertices;
    expected.row(2).array() -= 9.81 * h * h * 15;   // implicit Euler: 1 + 2 + ... + 5
    EXPECT_LT((cloth.state.x - expected).norm(), 1e-11);
  }
}

TEST(ClothStepper, BalancesForcesWhateverActs)
{
  for (const BendingModel bending : kBendings)
    for (const ClothSolver solver : {ClothSolver::cholesky, ClothSolver::gauss_seidel})
    {
      Cloth cloth = busy(bending);
      ClothStepper stepper(cloth.model, solverOptions(solver));
      const StepReport report = stepper.step(cloth.state, cloth.inputs, 5e-3);
      ASSERT_TRUE(report.ok) << report.message;
      EXPECT_LT(report.residual, 1e-8) << toString(bending);
      EXPECT_LT(report.iterations, 20);
      EXPECT_EQ(report.substeps, 1);
      EXPECT_EQ(cloth.state.x.col(8), cloth.inputs.pins.col(1));
      EXPECT_GT(report.max_strain, 1e-4);
    }
}

TEST(ClothStepper, SolversAgree)
{
  for (const BendingModel bending : kBendings)
  {
    Cloth a = busy(bending), b = busy(bending);
    ClothStepper direct(a.model, solverOptions(ClothSolver::cholesky)),
        iterative(b.model, solverOptions(ClothSolver::gauss_seidel));
    for (int k = 0; k < 4; ++k)
    {
      ASSERT_TRUE(direct.step(a.state, a.inputs, 5e-3).ok);
      ASSERT_TRUE(iterative.step(b.state, b.inputs, 5e-3).ok);
    }
    EXPECT_LT((a.state.x - b.state.x).norm(), 1e-8) << toString(bending);
    EXPECT_LT((direct.pinForces() - iterative.pinForces()).norm(), 1e-5 * direct.pinForces().norm());
  }
}

/// All methods go to the same motion as the step gets short.
TEST(ClothStepper, MethodsConverge)
{
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
  {
    const auto run = [&](Integrator integrator, bool one_newton_step, int steps) {
      Cloth cloth = busy(bending);
      for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)   // smooth, and fast where it is free
      {
        cloth.state.x.col(i) = cloth.model->rest.vertices.col(i);
        cloth.state.v.col(i) = Vector3d(0, 0, cloth.state.x(0, i) * (0.5 - cloth.state.x(0, i)) * 20);
      }
      cloth.pin({0, 8});
      ClothOptions o;
      o.integrator = integrator;
      o.one_newton_step = one_newton_step;
      ClothStepper stepper(cloth.model, o);
      for (int k = 0; k < steps; ++k)
      {
        const StepReport report = stepper.step(cloth.state, cloth.inputs, 0.02 / steps);
        EXPECT_TRUE(report.ok) << report.message;
      }
      return cloth.state.x;
    };
    const Matrix3Xd reference = run(Integrator::symplectic_euler, false, 8000);
    const double size = (reference - stiffSheet(bending).rest.vertices).norm();
    const auto error = [&](Integrator integrator, bool one, int steps) {
      return (run(integrator, one, steps) - reference).norm() / size;
    };
    const double coarse = error(Integrator::implicit_euler, false, 40),
                 fine = error(Integrator::implicit_euler, false, 160);
    EXPECT_LT(fine, 0.02);
    EXPECT_LT(fine, 0.4 * coarse);
    EXPECT_LT(error(Integrator::implicit_euler, true, 160), 0.03);
    EXPECT_LT(error(Integrator::symplectic_euler, false, 2000), 0.005);
  }
}

TEST(ClothStepper, PinsCarryTheWeight)
{
  for (const BendingModel bending : kBendings)
  {
    Cloth cloth(stiffSheet(bending));
    cloth.model->mass_damping = 5.0;
    cloth.pin({0, 8, 40});
    ClothStepper stepper(cloth.model, {});
    for (int k = 0; k < 200; ++k)
      ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, 0.05).ok);
    const double weight = 9.81 * cloth.model->totalMass();
    EXPECT_LT((stepper.pinForces().rowwise().sum() - Vector3d(0, 0, -weight)).norm(), 1e-6 * weight)
        << toString(bending);
  }
}

TEST(ClothStepper, UnforcedMotionLosesEnergy)
{
  for (const BendingModel bending : kBendings)
    for (const bool one_newton_step : {false, true})
    {
      Cloth cloth = busy(bending);
      cloth.state.pins.clear();
      cloth.inputs = {};
      cloth.inputs.gravity.setZero();
      ClothOptions o;
      o.one_newton_step = one_newton_step;
      ClothStepper stepper(cloth.model, o);
      double energy = stepper.energies(cloth.state, Vector3d::Zero()).total();
      for (int k = 0; k < 30; ++k)
      {
        ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, 2e-3).ok);
        const double next = stepper.energies(cloth.state, Vector3d::Zero()).total();
        EXPECT_LE(next, energy * (1 + 1e-12)) << toString(bending);
        energy = next;
      }
    }
}

TEST(ClothStepper, WindPushesTowardsItsVelocity)
{
  ClothModel model = stiffSheet(BendingModel::isometric_nonconforming);
  model.wind_coefficient = 2.0;
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::symplectic_euler})
  {
    Cloth cloth(model);
    cloth.inputs.gravity.setZero();
    cloth.inputs.wind = Vector3d(3, 0, 1.5);   // along the sheet it slips past
    ClothOptions o;
    o.integrator = integrator;
    ClothStepper stepper(cloth.model, o);
    const double h = 1e-4, rate = 2.0 / 0.2;
    for (int k = 0; k < 1000; ++k)
      ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, h).ok);
    for (Eigen::Index i = 0; i < cloth.state.v.cols(); ++i)
      EXPECT_LT((cloth.state.v.col(i) - Vector3d(0, 0, 1.5 * (1 - std::exp(-rate * 0.1)))).norm(), 1e-3);
  }
}

TEST(ClothStepper, RestartsBitEqual)
{
  for (const ClothSolver solver : {ClothSolver::cholesky, ClothSolver::gauss_seidel})
  {
    Cloth a = busy(BendingModel::hinge), b = busy(BendingModel::hinge);
    ClothStepper one(a.model, solverOptions(solver)), two(b.model, solverOptions(solver));
    for (int k = 0; k < 3; ++k)
      ASSERT_TRUE(one.step(a.state, a.inputs, k == 1 ? 3e-3 : 5e-3).ok);
    ASSERT_TRUE(two.step(b.state, b.inputs, 5e-3).ok);
    ASSERT_TRUE(two.step(b.state, b.inputs, 3e-3).ok);
    ClothStepper three(b.model, solverOptions(solver));
    ASSERT_TRUE(three.step(b.state, b.inputs, 5e-3).ok);
    EXPECT_EQ(a.state.x, b.state.x);
    EXPECT_EQ(a.state.v, b.state.v);
  }
}

TEST(ClothStepper, KeepsItsRestAngles)
{
  // a quarter of a cylinder at rest stays one
  TriangleMesh mesh = gridMesh(1.0, 0.5, 12, 6, GridPattern::irregular);
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    mesh.vertices.col(i) << std::sin(1.5 * mesh.vertices(0, i)), mesh.vertices(1, i),
        std::cos(1.5 * mesh.vertices(0, i));
  ClothModel model = buildCloth("shell", mesh, 0.2, isotropicMembrane(1e6, 0.3, 1e-3));
  model.bending = BendingModel::hinge;
  model.bending_modulus = 0.1;
  Cloth cloth(model);
  cloth.inputs.gravity.setZero();
  ClothStepper stepper(cloth.model, {});
  ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, 0.02).ok);
  EXPECT_LT((cloth.state.x - mesh.vertices).norm(), 1e-12);
}

TEST(ClothStepper, RoughStartsGiveNoNaN)
{
  Random random(41);
  int done = 0, refused = 0;
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
    for (const bool one_newton_step : {false, true})
      for (const double modulus : {1e-1, 1e4, 1e9})
        for (int kind = 0; kind < 4; ++kind)
        {
          ClothModel model = buildCloth("c", gridMesh(0.5, 0.5, 5, 5, GridPattern::alternating), 0.2,
                                        isotropicMembrane(modulus, 0.3, 1e-3));
          model.bending = bending;
          model.bending_modulus = 1e-4;
          Cloth cloth(model);
          for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)
          {
            if (kind == 0)   // anywhere
              cloth.state.x.col(i) = random.vector(0.5);
            if (kind == 1)   // all in one point
              cloth.state.x.col(i).setZero();
            if (kind == 2)   // turned over and squeezed to needles
              cloth.state.x.col(i) = cloth.state.x.col(i).cwiseProduct(Vector3d(-1, 1e-6, 1));
          }
          cloth.pin({0});
          if (kind == 3)   // yanked
            cloth.inputs.pins.col(0) += Vector3d(10, 0, 0);
          ClothOptions o;
          o.one_newton_step = one_newton_step;
          ClothStepper stepper(cloth.model, o);
          StepReport report;
          for (int k = 0; k < 3 && report.ok; ++k)
          {
            const ClothState before = cloth.state;
            report = stepper.step(cloth.state, cloth.inputs, 0.1);
            EXPECT_TRUE(cloth.state.x.allFinite() && cloth.state.v.allFinite());
            if (!report.ok)
            {
              EXPECT_EQ(cloth.state.x, before.x);
              EXPECT_FALSE(report.message.empty());
            }
            ++(report.ok ? done : refused);
          }
        }
  EXPECT_GT(done, 10 * refused) << done << " " << refused;   // all in one point, or needles a million times too stiff
}

TEST(ClothStepper, RefusesBadInputAndLeavesTheStateAlone)
{
  Cloth cloth = busy(BendingModel::hinge);
  ClothStepper stepper(cloth.model, {});
  const ClothState before = cloth.state;
  const auto refused = [&](const ClothInputs& inputs, double duration, const char* what) {
    const StepReport report = stepper.step(cloth.state, inputs, duration);
    EXPECT_EQ(report.failure, StepFailure::input_not_finite);
    EXPECT_NE(report.message.find(what), std::string::npos) << report.message;
    EXPECT_EQ(cloth.state.x, before.x);
  };
  refused(cloth.inputs, 0.0, "step length");
  ClothInputs bad = cloth.inputs;
  bad.pins(1, 1) = NAN;
  refused(bad, 0.01, "pin positions");
  bad = cloth.inputs;
  bad.pins.resize(3, 1);
  refused(bad, 0.01, "number of pin positions");
  bad = cloth.inputs;
  bad.wind.x() = INFINITY;
  refused(bad, 0.01, "wind");
  bad = cloth.inputs;
  bad.forces.resize(3, 4);
  refused(bad, 0.01, "number of forces");

  ClothOptions o;
  o.integrator = Integrator::symplectic_euler;
  ClothStepper explicit_stepper(cloth.model, o);
  StepReport report;
  ClothState last = cloth.state;
  for (int k = 0; k < 1000 && report.ok; ++k)
  {
    last = cloth.state;
    report = explicit_stepper.step(cloth.state, cloth.inputs, 0.02);   // far too long
  }
  EXPECT_EQ(report.failure, StepFailure::state_not_finite);
  EXPECT_EQ(cloth.state.x, last.x);

  o.integrator = Integrator::bdf2;
  EXPECT_THROW(ClothStepper(cloth.model, o), std::invalid_argument);
  EXPECT_THROW(pinVertices(cloth.state, {-1}), std::invalid_argument);
  EXPECT_THROW(buildCloth("c", cloth.model->rest, 0.0, cloth.model->membrane), std::invalid_argument);
  EXPECT_THROW(makeClothState(*cloth.model, Matrix3Xd::Zero(3, 4)), std::invalid_argument);
}

TEST(ShiftedMatrix, SaysWhenItCannotBeFactored)
{
  const ClothModel model =
      buildCloth("cloth", gridMesh(0.1, 0.1, 4, 4, GridPattern::alternating), 0.2, isotropicMembrane(1e6, 0.3, 5e-4));
  ShiftedMatrix matrix(constantStiffness(model, clothTerms(model)));
  const std::vector<char> held(model.vertices(), 0);
  EXPECT_TRUE(matrix.factor(std::vector<double>(model.vertices(), 1.0), 1.0, held));
  EXPECT_FALSE(matrix.factor(std::vector<double>(model.vertices(), -1e9), 1.0, held));
}

}   // namespace
}   // namespace slender::test
