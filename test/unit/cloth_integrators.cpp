// Integrators of cloth: order, exactness, energy, restarts, and the constant matrix of imex.
#include <gtest/gtest.h>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/dynamics/integrator.h"
#include "test/support/cloths.h"
#include "test/support/pinned_cloth.h"

namespace slender::test {
namespace {

/// Soft enough for its ripples to be resolved; everything at work. Swings from two corners.
Cloth swinging(BendingModel bending)
{
  ClothModel model =
      buildCloth("sheet", gridMesh(0.5, 0.5, 5, 5, GridPattern::alternating), 0.2, isotropicMembrane(3e3, 0.3, 1e-3));
  model.bending = bending;
  model.bending_modulus = 1e-4;
  model.mass_damping = 0.3;
  model.stiffness_damping = 5e-3;
  model.wind_coefficient = 0.3;
  Cloth cloth(std::move(model));
  cloth.pin({0, 5});
  cloth.inputs.wind = Vector3d(0.3, 0.5, 1);
  for (Eigen::Index i = 0; i < cloth.state.x.cols();
       ++i)   // from rest it would start with a jump of the acceleration at the pins
    cloth.state.v.col(i) = Vector3d(0, 0, 0.8 * cloth.state.x(1, i) * cloth.state.x(1, i));
  return cloth;
}

Matrix3Xd positionsAfter(Cloth cloth, const ClothOptions& o, double end, int steps)
{
  ClothStepper stepper(cloth.model, o);
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = stepper.step(cloth.state, cloth.inputs, end / steps);
    EXPECT_TRUE(report.ok) << report.message;
  }
  return cloth.state.x;
}

ClothOptions with(Integrator integrator)
{
  ClothOptions o;
  o.integrator = integrator;
  o.linear_tolerance = 1e-6;
  o.newton.tolerance = 1e-10;
  return o;
}

TEST(ClothIntegrators, HaveTheirOrder)
{
  for (const BendingModel bending : {BendingModel::isometric_nonconforming, BendingModel::hinge})
  {
    const double end = 0.16;
    const Matrix3Xd fine = positionsAfter(swinging(bending), with(Integrator::tr_bdf2), end, 640);
    const auto error = [&](const ClothOptions& o, int steps) {
      return (positionsAfter(swinging(bending), o, end, steps) - fine).norm();
    };
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2})
      for (const bool one_newton_step : {false, true})
      {
        ClothOptions o = with(integrator);
        o.one_newton_step = one_newton_step;
        const double rate = std::log2(error(o, 40) / error(o, 80));
        EXPECT_NEAR(rate, order(integrator), 0.25) << toString(integrator) << one_newton_step << toString(bending);
      }
    if (bending == BendingModel::hinge)
      continue;
    const double rate = std::log2(error(with(Integrator::imex), 320) / error(with(Integrator::imex), 640));
    EXPECT_NEAR(rate, 1.0, 0.2);
    EXPECT_LT(error(with(Integrator::tr_bdf2), 40), 0.1 * error(with(Integrator::implicit_euler), 40));
  }
}

TEST(ClothIntegrators, TrBdf2FallsExactly)
{
  for (const BendingModel bending : {BendingModel::none, BendingModel::hinge, BendingModel::isometric_conforming})
    for (const bool one_newton_step : {false, true})
    {
      ClothModel model = buildCloth("sheet", gridMesh(0.5, 0.4, 8, 0, GridPattern::alternating), 0.2,
                                    isotropicMembrane(1e6, 0.3, 1e-3));
      model.bending = bending;
      model.bending_modulus = 1e-4;
      model.stiffness_damping = 1e-3;
      Cloth cloth(std::move(model));
      const Vector3d v(1, 0.5, 2);
      cloth.state.v.colwise() = v;
      ClothOptions o;
      o.integrator = Integrator::tr_bdf2;
      o.one_newton_step = one_newton_step;
      ClothStepper stepper(cloth.model, o);
      double t = 0;
      for (const double h : {0.01, 0.03, 0.02, 0.05})
      {
        ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, h).ok);
        t += h;
      }
      const Vector3d moved = t * v + 0.5 * t * t * cloth.inputs.gravity;
      EXPECT_LT((cloth.state.x - (cloth.model->rest.vertices.colwise() + moved)).cwiseAbs().maxCoeff(), 1e-10);
      EXPECT_LT((cloth.state.v.colwise() - (v + t * cloth.inputs.gravity)).cwiseAbs().maxCoeff(), 1e-8);
    }
}

/// Undamped: implicit Euler eats the swing, TR-BDF2 hardly does, and neither gains.
TEST(ClothIntegrators, TrBdf2KeepsTheEnergyOfWhatItResolves)
{
  const auto lost = [](Integrator integrator) {
    ClothModel model =
        buildCloth("sheet", gridMesh(0.5, 0.5, 5, 5, GridPattern::alternating), 0.2, isotropicMembrane(1e5, 0.3, 1e-3));
    model.bending_modulus = 1e-4;
    Cloth cloth(std::move(model));
    cloth.inputs.gravity.setZero();
    for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)   // a wave of the membrane, about 40 steps long
      cloth.state.v.col(i) = Vector3d(0.05 * std::cos(2 * M_PI * cloth.state.x(0, i) / 0.5), 0, 0);
    ClothOptions o;
    o.integrator = integrator;
    ClothStepper stepper(cloth.model, o);
    const double start = stepper.energies(cloth.state, Vector3d::Zero()).total();
    double energy = start;
    for (int k = 0; k < 100; ++k)
    {
      EXPECT_TRUE(stepper.step(cloth.state, cloth.inputs, 5e-4).ok);
      const double next = stepper.energies(cloth.state, Vector3d::Zero()).total();
      EXPECT_LT(next, start * (1 + 1e-3));
      energy = next;
    }
    return 1.0 - energy / start;
  };
  EXPECT_GT(lost(Integrator::implicit_euler), 0.3);
  EXPECT_LT(lost(Integrator::tr_bdf2), 0.1 * lost(Integrator::implicit_euler));
}

TEST(ClothIntegrators, PinsCarryTheWeight)
{
  for (const Integrator integrator : {Integrator::tr_bdf2, Integrator::imex})
  {
    Cloth cloth = swinging(BendingModel::isometric_nonconforming);
    cloth.model->wind_coefficient = 0;
    cloth.model->mass_damping = 5;
    ClothStepper stepper(cloth.model, with(integrator));
    const double h = integrator == Integrator::imex ? 2e-3 : 0.02;
    for (int k = 0; k < static_cast<int>(6 / h); ++k)
      ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, h).ok);
    const double weight = 9.81 * cloth.model->totalMass();
    EXPECT_LT((stepper.pinForces().rowwise().sum() - Vector3d(0, 0, -weight)).norm(), 1e-4 * weight)
        << toString(integrator);
  }
}

/// All vertices held and accelerated: the pins feel the weight and the inertia, whatever the integrator.
TEST(ClothIntegrators, PinsFeelTheInertiaOfWhatTheyMove)
{
  for (const Integrator integrator :
       {Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::imex, Integrator::symplectic_euler})
  {
    Cloth cloth(buildCloth("sheet", gridMesh(0.3, 0.3, 4, 4, GridPattern::alternating), 0.2,
                           isotropicMembrane(1e5, 0.3, 1e-3)));
    std::vector<int> all;
    for (int i = 0; i < cloth.model->vertices(); ++i)
      all.push_back(i);
    cloth.pin(all);
    ClothStepper stepper(cloth.model, with(integrator));
    const double h = 0.005;
    for (int k = 1; k <= 4; ++k)
    {
      cloth.inputs.pins = cloth.model->rest.vertices;
      cloth.inputs.pins.row(0).array() += 0.5 * 2.0 * (k * h) * (k * h);   // 2 m/s^2
      ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, h).ok);
    }
    const Vector3d force = stepper.pinForces().rowwise().sum() / cloth.model->totalMass();
    EXPECT_LT((force - Vector3d(-2, 0, -9.81)).norm(), 1e-6) << toString(integrator) << force.transpose();
  }
}

TEST(ClothIntegrators, RestartBitEqual)
{
  for (const Integrator integrator : {Integrator::tr_bdf2, Integrator::imex})
    for (const double tolerance : {0.0, 1e-5})
    {
      if (integrator == Integrator::imex && tolerance > 0)
        continue;
      ClothOptions o = with(integrator);
      o.error_tolerance = tolerance;
      const double h = integrator == Integrator::imex ? 1e-3 : 5e-3;
      Cloth a = swinging(BendingModel::isometric_nonconforming);
      ClothStepper one(a.model, o);
      for (int k = 0; k < 3; ++k)
        ASSERT_TRUE(one.step(a.state, a.inputs, h).ok);
      ClothState saved = a.state;
      ClothStepper two(a.model, o);
      for (int k = 0; k < 3; ++k)
      {
        ASSERT_TRUE(one.step(a.state, a.inputs, h).ok);
        ASSERT_TRUE(two.step(saved, a.inputs, h).ok);
      }
      EXPECT_EQ(a.state.x, saved.x);
      EXPECT_EQ(a.state.v, saved.v);
      EXPECT_EQ(a.state.next_step, saved.next_step);
    }
}

TEST(ClothIntegrators, KeepTheErrorAsked)
{
  const double end = 0.2;
  const Matrix3Xd fine =
      positionsAfter(swinging(BendingModel::isometric_nonconforming), with(Integrator::tr_bdf2), end, 800);
  for (const Integrator integrator : {Integrator::tr_bdf2, Integrator::implicit_euler})
  {
    double previous = 0;
    int substeps = 0;
    for (const double tolerance : {1e-3, 1e-5})
    {
      ClothOptions o = with(integrator);
      o.error_tolerance = tolerance;
      Cloth cloth = swinging(BendingModel::isometric_nonconforming);
      ClothStepper stepper(cloth.model, o);
      StepReport total;
      for (int k = 0; k < 4; ++k)
      {
        const StepReport report = stepper.step(cloth.state, cloth.inputs, end / 4);
        ASSERT_TRUE(report.ok) << report.message;
        EXPECT_LE(report.error_estimate, tolerance);
        total.merge(report);
      }
      const double error = (cloth.state.x - fine).colwise().norm().maxCoeff();
      EXPECT_LT(error, total.substeps * tolerance) << toString(integrator);   // local errors may all add up
      if (previous > 0)
      {
        EXPECT_LT(error, 0.3 * previous);
        EXPECT_GT(total.substeps, 2 * substeps);
      }
      previous = error;
      substeps = total.substeps;
    }
  }
}

/// A strip that hardly has a membrane: bending of any stiffness does not limit the step; the explicit step blows up at
/// once.
TEST(ClothIntegrators, ImexBendingIsUnconditionallyStable)
{
  for (const double modulus : {1e-3, 1.0, 1e3})
  {
    ClothModel model = buildCloth("strip", gridMesh(1.0, 0.1, 20, 2, GridPattern::alternating), 0.2,
                                  isotropicMembrane(1.0, 0.3, 1e-3));
    model.bending_modulus = modulus;
    for (const Integrator integrator : {Integrator::imex, Integrator::symplectic_euler})
    {
      Cloth cloth(model);
      cloth.inputs.gravity.setZero();
      Random random(3);
      for (Eigen::Index i = 0; i < cloth.state.v.cols(); ++i)
        cloth.state.v.col(i) = Vector3d(0, 0, 0.01 * random.vector(1.0).z());
      ClothStepper stepper(cloth.model, with(integrator));
      const double start = stepper.energies(cloth.state, Vector3d::Zero()).total();
      bool good = true;
      for (int k = 0; k < 200 && good; ++k)
        good = stepper.step(cloth.state, cloth.inputs, 0.02).ok &&
               stepper.energies(cloth.state, Vector3d::Zero()).total() < 1.01 * start;
      EXPECT_EQ(good, integrator == Integrator::imex) << modulus;
    }
  }
}

/// One free vertex mode: a step of imex is (m/h^2 + k) d = m v/h - k x for the bending's own modes.
TEST(ClothIntegrators, ImexStepIsItsFormula)
{
  ClothModel model =
      buildCloth("strip", gridMesh(0.5, 0.2, 5, 2, GridPattern::alternating), 0.2, isotropicMembrane(1e-9, 0.3, 1e-3));
  model.bending_modulus = 2e-3;
  model.mass_damping = 0.7;
  model.stiffness_damping = 3e-3;
  Cloth cloth(model);
  cloth.inputs.gravity = Vector3d(0.3, 0, -2);
  Random random(5);
  for (Eigen::Index i = 0; i < cloth.state.x.cols(); ++i)
  {
    cloth.state.x.col(i) += random.vector(0.01);
    cloth.state.v.col(i) = random.vector(0.1);
  }
  cloth.pin({0});
  cloth.inputs.pins.col(0) += Vector3d(1e-3, 0, 2e-3);
  const ClothState before = cloth.state;
  const double h = 0.01;
  ClothStepper stepper(cloth.model, with(Integrator::imex));
  ASSERT_TRUE(stepper.step(cloth.state, cloth.inputs, h).ok);
  const auto element = IsometricElement::nonconforming;
  const MatrixXd k =
      MatrixXd(isometricBending(model.rest, model.topology, element,
                                2e-3 * bendingCalibration(model.rest, model.topology, element, model.warp))
                   .toEigen());
  const MatrixXd m = model.mass.asDiagonal();
  const Matrix3Xd d = cloth.state.x - before.x;
  Matrix3Xd residual = d * (m * (1 / (h * h) + 0.7 / h) + (1 + 3e-3 / h) * k) - before.v * m / h + before.x * k -
                       cloth.inputs.gravity * model.mass.transpose();
  EXPECT_LT((stepper.pinForces().col(0) + residual.col(0)).norm(), 1e-9 * residual.col(0).norm());
  residual.col(0).setZero();
  EXPECT_LT(residual.norm(), 1e-8 * (before.v * m / h).norm());
  EXPECT_LT((cloth.state.v - d / h).norm(), 1e-12);
}

TEST(ClothIntegrators, RefuseWhatTheyCannot)
{
  Cloth hinged = swinging(BendingModel::hinge);
  EXPECT_THROW(ClothStepper(hinged.model, with(Integrator::imex)), std::invalid_argument);
  ClothOptions o = with(Integrator::symplectic_euler);
  o.error_tolerance = 1e-4;
  EXPECT_THROW(ClothStepper(hinged.model, o), std::invalid_argument);
}

}   // namespace
}   // namespace slender::test
