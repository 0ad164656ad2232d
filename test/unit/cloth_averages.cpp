// Cloth whose averages are prescribed.
#include <limits>

#include <gtest/gtest.h>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/tracking/weak_constraints.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

struct Tracked
{
  Subdivision fine;
  std::shared_ptr<ClothModel> model;
  std::unique_ptr<WeakConstraints> constraints;
  Matrix3Xd guide;   // at rest
  ClothState state;
  ClothInputs inputs;

  explicit Tracked(BendingModel bending = BendingModel::hinge, int levels = 2)
  {
    const TriangleMesh coarse = gridMesh(1.0, 1.0, 4, 4, GridPattern::alternating);
    fine = subdivide(coarse, levels);
    guide = coarse.vertices;
    constraints =
        std::make_unique<WeakConstraints>(subdivisionBasis(fine), hatMassMatrix(coarse), hatMassMatrix(fine.mesh));
    model =
        std::make_shared<ClothModel>(buildCloth("tracked", fine.mesh, 0.2, orthotropicMembrane(500, 500, 0.3, 190)));
    model->bending = bending;
    model->bending_modulus = 1e-4;
    model->stiffness_damping = 1e-3;
    model->averages = {{std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(constraints->matrix()), {}}};
    state = makeClothState(*model, fine.mesh.vertices);
  }

  StepReport step(ClothStepper& stepper, const Matrix3Xd& q, double h)
  {
    inputs.averages = constraints->averages(q);
    inputs.pins.resize(3, static_cast<Eigen::Index>(state.pins.size()));
    for (std::size_t k = 0; k < state.pins.size(); ++k)
      inputs.pins.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
    return stepper.step(state, inputs, h);
  }
};

ClothOptions trackingOptions(bool one_newton_step)
{
  ClothOptions o;
  o.one_newton_step = one_newton_step;
  o.linear_tolerance = one_newton_step ? 1e-2 : 1e-4;
  return o;
}

TEST(ClothAverages, AreExactWhateverTheGuideDoes)
{
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
    for (const bool one : {true, false})
    {
      Tracked t(bending);
      pinVertices(t.state, {7});
      ClothStepper stepper(t.model, trackingOptions(one));
      Random random(8);
      for (int k = 1; k <= 12; ++k)
      {
        Matrix3Xd q = t.guide;
        for (Eigen::Index i = 0; i < q.cols(); ++i)
          q.col(i) += Vector3d(0, 0, 0.05 * std::sin(0.4 * k + 3 * q(0, i))) + random.vector(0.01);
        const StepReport report = t.step(stepper, q, 0.01);
        ASSERT_TRUE(report.ok) << report.message;
        EXPECT_LT(t.constraints->error(t.inputs.averages, t.state.x), 1e-14) << one << " step " << k;
        EXPECT_TRUE(t.state.x.col(7) == t.fine.mesh.vertices.col(7));
        EXPECT_LT(report.residual, one ? 1e9 : 1e-6) << "step " << k;   // what the averages do not balance
      }
    }
}

TEST(ClothAverages, CarryTheClothWithTheForcesOfMechanics)
{
  // a guide that is moved rigidly with constant acceleration carries the cloth rigidly; forces are m (a - g), of each
  // its share
  Tracked t;
  ClothStepper stepper(t.model, trackingOptions(false));
  const Vector3d a(3, -2, 1);
  const double h = 0.01;
  // both begin at the speed that implicit Euler's parabola has one step before
  for (int k = 1; k <= 20; ++k)
  {
    const Matrix3Xd q = t.guide.colwise() + Vector3d(0.5 * h * h * k * (k + 1) * a);
    const StepReport report = t.step(stepper, q, h);
    ASSERT_TRUE(report.ok) << report.message;
  }
  const Matrix3Xd expected = t.fine.mesh.vertices.colwise() + Vector3d(0.5 * h * h * 20 * 21 * a);
  // hats' weights are not those of the mass: it bends a little
  EXPECT_LT((t.state.x - expected).cwiseAbs().maxCoeff(), 2e-5);
  const Vector3d total = stepper.averageForces().rowwise().sum(), law = t.model->totalMass() * (a - t.inputs.gravity);
  EXPECT_LT((total - law).norm(), 1e-4 * law.norm());
}

TEST(ClothAverages, HoldersBearTheirShare)
{
  // at rest, with vertices held that averages are taken over, guide and grippers bear the weight together; also where
  // forces are at their bounds
  for (const bool bounded : {false, true})
  {
    Tracked t;
    t.model->mass_damping = 10;
    const Vector3d weight = t.model->totalMass() * t.inputs.gravity;
    if (bounded)
    {
      t.model->averages[0].bounds.setConstant(t.constraints->count(), std::numeric_limits<double>::infinity());
      t.model->averages[0].bounds[7] = 0.3 * weight.norm() / 16;   // of what its hat weighs
    }
    pinVertices(t.state, {7, 40});
    ClothOptions o = trackingOptions(true);
    o.linear_tolerance = 1e-4;
    ClothStepper stepper(t.model, o);
    for (int k = 0; k < 300; ++k)
    {
      const StepReport report = t.step(stepper, t.guide, 0.01);
      ASSERT_TRUE(report.ok) << report.message;
    }
    EXPECT_EQ(bounded, !t.state.at_bound.empty());
    EXPECT_LT(t.state.v.colwise().norm().maxCoeff(), 1e-3);
    const Vector3d borne = stepper.pinForces().rowwise().sum() - stepper.averageForces().rowwise().sum();
    // without the share of the two held vertices 0.005
    EXPECT_LT((borne - weight).norm(), 1e-3 * weight.norm()) << bounded;
  }
}

TEST(ClothAverages, AreStationaryUnderTheConstraints)
{
  // gradient of the step's energy = C^T forces: checked by an independent energy, by differences along random
  // directions with C d = 0
  Tracked t(BendingModel::hinge, 1);
  t.model->stiffness_damping = 0.0;
  ClothOptions o = trackingOptions(false);
  o.newton.tolerance = 1e-10;
  o.linear_tolerance = 1e-8;
  ClothStepper stepper(t.model, o);
  Matrix3Xd q = t.guide;
  for (Eigen::Index i = 0; i < q.cols(); ++i)
    q(2, i) += 0.05 * std::cos(5 * q(0, i));
  const ClothState before = t.state;
  const double h = 0.02;
  ASSERT_TRUE(t.step(stepper, q, h).ok);
  const auto energy = [&](const Matrix3Xd& x) {
    ClothState s = t.state;
    s.x = x;
    const ClothEnergies e = stepper.energies(s, t.inputs.gravity);
    double kinetic = 0.0;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      kinetic += 0.5 * t.model->mass[i] * (x.col(i) - before.x.col(i) - h * before.v.col(i)).squaredNorm() / (h * h);
    return e.membrane + e.bending + e.gravity + kinetic;
  };
  Random random(2);
  const Matrix3Xd forces = stepper.averageForces();
  for (int k = 0; k < 5; ++k)
  {
    Matrix3Xd d(3, t.state.x.cols());
    for (Eigen::Index i = 0; i < d.cols(); ++i)
      d.col(i) = random.vector();
    const double eps = 1e-5, slope = (energy(t.state.x + eps * d) - energy(t.state.x - eps * d)) / (2 * eps);
    const double work = (forces.array() * Matrix3Xd(d * t.constraints->matrix().transpose()).array()).sum();
    EXPECT_NEAR(slope, work, 1e-5 * std::abs(work)) << k;
  }
}

TEST(ClothAverages, StayExactWhereTheyTearAtTheCloth)
{
  // two functions that differ at one vertex only are to be where two parts of the guide are: the cloth there is
  // strained hundredfold
  const TriangleMesh coarse = gridMesh(0.4, 0.4, 3, 3, GridPattern::alternating);
  const Subdivision fine = subdivide(coarse, 2);
  TestFunctions apart = subdivisionBasis(fine, {5, 10});
  const TestFunctions one = subdivisionBasis(fine, {5});
  std::vector<Eigen::Triplet<double>> entries;
  for (int row = 0; row < 2; ++row)
    for (TestFunctions::Values::InnerIterator entry(one.tracked, 0); entry; ++entry)
      entries.emplace_back(row, static_cast<int>(entry.col()), entry.value());
  apart.tracked.setFromTriplets(entries.begin(), entries.end());
  apart.tracked.coeffRef(1, 5) += 0.1;
  apart.tracked.makeCompressed();
  const WeakConstraints constraints(apart, hatMassMatrix(coarse), hatMassMatrix(fine.mesh));
  auto model = std::make_shared<ClothModel>(buildCloth("torn", fine.mesh, 0.2, isotropicMembrane(1e5, 0.3, 1e-3)));
  model->bending = BendingModel::hinge;
  model->bending_modulus = 1e-5;
  model->stiffness_damping = 1e-3;
  model->averages = {{std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(constraints.matrix()), {}}};
  ClothOptions o;
  o.one_newton_step = true;
  ClothStepper stepper(model, o);
  ClothState state = makeClothState(*model, fine.mesh.vertices);
  ClothInputs inputs;
  inputs.averages = constraints.averages(coarse.vertices);
  StepReport report;
  for (int k = 1; k <= 40; ++k)
  {
    report = stepper.step(state, inputs, 0.01);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    ASSERT_LT(constraints.error(inputs.averages, state.x), 1e-11) << k;
  }
  EXPECT_LT(report.max_strain, 1000.0);   // exact solutions of the steps: 688
  EXPECT_GT(report.max_strain, 100.0);
}

/// A sheet of 289 vertices whose quarters are averaged over.
std::shared_ptr<ClothModel> quarteredSheet(BendingModel bending)
{
  const TriangleMesh mesh = gridMesh(1.0, 1.0, 16, 16, GridPattern::alternating);
  auto model = std::make_shared<ClothModel>(buildCloth("tracked", mesh, 0.2, orthotropicMembrane(500, 500, 0.3, 190)));
  model->bending = bending;
  model->bending_modulus = 1e-4;
  model->stiffness_damping = 1e-3;
  auto quarters = std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(4, mesh.vertices.cols());
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    quarters->coeffRef((mesh.vertices(0, i) > 0.5 ? 1 : 0) + (mesh.vertices(1, i) > 0.5 ? 2 : 0), i) = 1.0;
  model->averages = {{quarters, {}}};
  return model;
}

TEST(ClothAverages, TheToleranceIsAccurateEnough)
{
  // few averages of many vertices, a gripper, air and bending of both kinds
  for (const BendingModel bending : {BendingModel::hinge, BendingModel::isometric_nonconforming})
  {
    const auto model = quarteredSheet(bending);
    const auto quarters = model->averages[0].weights;
    ClothState state = makeClothState(*model, model->rest.vertices);
    pinVertices(state, {0});
    ClothInputs inputs;
    inputs.pins = state.x.col(0);
    const auto stepperOf = [&](double tolerance) {
      ClothOptions o = trackingOptions(true);
      o.linear_tolerance = tolerance;
      return ClothStepper(model, o);
    };
    ClothStepper exact = stepperOf(1e-12), fine = stepperOf(1e-5), swept = stepperOf(5e-3);   // in both precisions
    double error = 0.0, motion = 0.0;
    int iterations = 0;
    const Matrix3Xd rest = state.x * quarters->transpose();
    for (int k = 1; k <= 20; ++k)
    {
      inputs.averages = rest;
      for (int i = 0; i < 4; ++i)
        // times the vertices of an average
        inputs.averages.col(i) += 72.0 * Vector3d(0.002 * k, 0.0, 0.05 * std::sin(0.3 * k + i));
      ClothState a = state, b = state, c = state;
      ASSERT_TRUE(exact.step(a, inputs, 0.01).ok);
      ASSERT_TRUE(fine.step(b, inputs, 0.01).ok);
      const StepReport report = swept.step(c, inputs, 0.01);
      ASSERT_TRUE(report.ok);
      iterations += report.linear_iterations;
      for (const ClothState* each : {&a, &b, &c})
        EXPECT_LT((each->x * quarters->transpose() - inputs.averages).cwiseAbs().maxCoeff(),
                  1e-13 * inputs.averages.cwiseAbs().maxCoeff());
      EXPECT_LT((b.x - a.x).norm(), 1e-3 * (a.x - state.x).norm()) << k;
      EXPECT_LT((swept.averageForces() - exact.averageForces()).norm(), 0.2 * exact.averageForces().norm()) << k;
      error += (c.x - a.x).squaredNorm();
      motion += (a.x - state.x).squaredNorm();
      state = a;
    }
    // free cloth of this size, by sweeps: 0.03 of a step's fall
    EXPECT_LT(std::sqrt(error), 0.02 * std::sqrt(motion));
    EXPECT_LT(iterations, 20 * 40);
  }
}

TEST(ClothAverages, AreExactWhereTheyNearlyDependOnEachOther)
{
  const auto model = quarteredSheet(BendingModel::hinge);
  Eigen::SparseMatrix<double, Eigen::RowMajor> mix(4, 4);
  mix.setIdentity();
  mix.coeffRef(1, 1) = 1e-4;
  mix.coeffRef(1, 0) = 1.0 - 1e-4;
  model->averages = {
      {std::make_shared<Eigen::SparseMatrix<double, Eigen::RowMajor>>(mix * *model->averages[0].weights), {}}};
  const auto& weights = *model->averages[0].weights;
  ClothStepper stepper(model, trackingOptions(true));
  ClothState state = makeClothState(*model, model->rest.vertices);
  ClothInputs inputs;
  const Matrix3Xd rest = state.x * weights.transpose();
  for (int k = 1; k <= 10; ++k)
  {
    inputs.averages = rest.colwise() + Vector3d(0.2 * k, 0.0, 3.0 * std::sin(0.3 * k));
    inputs.averages.col(2) += Vector3d(0.0, 0.0, 1.0 * k);
    const StepReport report = stepper.step(state, inputs, 0.01);
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_LT((state.x * weights.transpose() - inputs.averages).cwiseAbs().maxCoeff(),
              1e-13 * inputs.averages.cwiseAbs().maxCoeff())
        << k;
  }
}

TEST(ClothAverages, NeedNoLoadToBeMoved)
{
  // the first motion of a sheet at rest, nothing else acts: the tolerance counts from that motion
  ClothOptions exactly = trackingOptions(true);
  exactly.linear_tolerance = 1e-10;
  const auto model = quarteredSheet(BendingModel::hinge);
  ClothInputs inputs;
  inputs.gravity.setZero();
  inputs.averages = model->rest.vertices * model->averages[0].weights->transpose();
  inputs.averages.row(2) += Eigen::RowVector4d(0.5, -0.3, 0.2, 0.1);
  ClothState a = makeClothState(*model, model->rest.vertices), b = a;
  ClothStepper swept(model, trackingOptions(true)), exact(model, exactly);
  const StepReport report = swept.step(a, inputs, 0.01);
  ASSERT_TRUE(report.ok && exact.step(b, inputs, 0.01).ok);
  EXPECT_LT(report.linear_iterations, 60);
  EXPECT_LT((a.x - b.x).norm(), 0.05 * (b.x - model->rest.vertices).norm()) << report.linear_iterations;
}

TEST(ClothAverages, RefuseWhatCannotBe)
{
  Tracked t;
  ClothOptions o = trackingOptions(false);
  o.integrator = Integrator::symplectic_euler;
  EXPECT_THROW(ClothStepper(t.model, o), std::invalid_argument);
  o = trackingOptions(false);
  o.solver = ClothSolver::cholesky;
  EXPECT_THROW(ClothStepper(t.model, o), std::invalid_argument);
  // held vertices that leave nothing of an average
  Tracked held;
  pinVertices(held.state, [&] {
    std::vector<int> all;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(*held.model->averages[0].weights, 0); entry;
         ++entry)
      all.push_back(static_cast<int>(entry.col()));
    return all;
  }());
  ClothStepper stuck(held.model, trackingOptions(true));
  const StepReport refused = held.step(stuck, held.guide, 0.01);
  EXPECT_FALSE(refused.ok);
  EXPECT_NE(refused.message.find("hold fewer vertices"), std::string::npos) << refused.message;
  ClothStepper stepper(t.model, trackingOptions(true));
  const ClothState before = t.state;
  t.inputs.averages = Matrix3Xd::Zero(3, 3);
  StepReport report = stepper.step(t.state, t.inputs, 0.01);
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("number of averages"), std::string::npos) << report.message;
  t.inputs.averages = Matrix3Xd::Constant(3, t.constraints->count(), NAN);
  EXPECT_FALSE(stepper.step(t.state, t.inputs, 0.01).ok);
  EXPECT_TRUE(t.state.x == before.x);
}

}   // namespace
}   // namespace slender::test
