#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/geometry/mesh_shapes.h"
#include "test/support/groups.h"

namespace slender::test {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Cloths : Group
{
  void add(const std::string& name, int n, double size, const Vector3d& corner, const ClothOptions& options = {})
  {
    ClothModel cloth =
        buildCloth(name, gridMesh(size, size, n, n, GridPattern::alternating), 0.2, isotropicMembrane(1e6, 0.3, 5e-4));
    cloth.bending_modulus = 1e-6;
    cloth.stiffness_damping = 1e-3;
    addCloth(std::make_shared<ClothModel>(cloth), makeClothState(cloth, cloth.rest.vertices.colwise() + corner),
             options, impulseContact(4e-3));
  }
  const ClothModel& cloth(int k) const { return *model.cloths[static_cast<std::size_t>(k)].model; }
};

TEST(ImpulseCloths, ContactForcesBalanceMomentum)
{
  // two cloths that fall onto a ball and onto each other, one of them held: the forces of every step are its change of
  // momentum
  Cloths c;
  ClothOptions options;
  options.linear_tolerance = 1e-8;
  c.add("upper", 6, 0.3, {-0.15, -0.15, 0.112}, options);
  c.add("lower", 6, 0.3, {-0.14, -0.15, 0.106}, options);
  c.addObstacle(Sphere{0.1}, {});
  pinVertices(c.state.cloths[0], {0});
  c.inputs.cloths[0].pins = c.state.cloths[0].x.col(0);
  World world = c.world({}, 0.005);
  double most = 0.0, supported = 0.0;
  int repulsions = 0;
  for (int k = 0; k < 60; ++k)
  {
    const WorldState before = c.state;
    const StepReport report = world.step(c.state, c.inputs);
    ASSERT_TRUE(report.ok);
    repulsions = report.repulsions;
    for (int i = 0; i < 2; ++i)
    {
      const ClothModel& model = c.cloth(i);
      const auto& x = c.state.cloths[static_cast<std::size_t>(i)];
      const Matrix3Xd contact = world.contactForces({ObjectRef::cloth, i});
      Vector3d forces = -world.pinForces(i).rowwise().sum(), change(0, 0, 0);
      for (int v = 0; v < model.vertices(); ++v)
      {
        change += model.mass[v] / 0.005 * (x.v.col(v) - before.cloths[static_cast<std::size_t>(i)].v.col(v));
        forces += model.mass[v] * c.inputs.cloths[static_cast<std::size_t>(i)].gravity + contact.col(v);
        most = std::max(most, contact.col(v).norm());
        supported += contact(2, v) / 60;
      }
      // answers to contacts are solved to that
      EXPECT_LT((change - forces).norm(), 1e-3 * model.totalMass() * 9.81) << k << " " << i;
    }
  }
  EXPECT_GT(repulsions, 0);
  EXPECT_GT(most, 0.01);
  EXPECT_GT(supported, 0.3 * 2 * c.cloth(0).totalMass() * 9.81);
}

TEST(ImpulseCloths, ComesToRestOnAFloor)
{
  Cloths c;
  c.add("upper", 6, 0.3, {0, 0, 0.012});
  c.add("lower", 6, 0.3, {0.02, 0.01, 0.006});
  c.addObstacle(Plane{}, {});
  World world = c.world({}, 0.005);
  world.checkCloths(c.state);
  double speed = 0.0;
  int repulsions = 0;
  for (int k = 0; k < 200; ++k)
  {
    const StepReport report = world.step(c.state, c.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    ASSERT_NO_THROW(world.checkCloths(c.state)) << k;
    repulsions = report.repulsions;
    speed = std::max(c.state.cloths[0].v.cwiseAbs().maxCoeff(), c.state.cloths[1].v.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(repulsions, 0);
  EXPECT_LT(speed, 5e-3);
  // half a thickness above the floor, a thickness apart
  EXPECT_NEAR(c.state.cloths[1].x.row(2).mean(), 2e-3, 4e-4);
  EXPECT_NEAR(c.state.cloths[0].x.row(2).mean(), 6e-3, 1e-3);
}

TEST(ImpulseCloths, AFastSolidIsStoppedByNothingButCarriesCloth)
{
  Cloths c;
  c.add("cloth", 8, 0.4, {-0.2, -0.2, 0});
  c.addObstacle(Sphere{0.05}, {{0, 0, -0.1}, Quaterniond::Identity()});
  for (ClothInputs& in : c.inputs.cloths)
    in.gravity.setZero();
  World world = c.world({}, 0.005);
  for (int k = 0; k < 10; ++k)   // at 20 m/s
  {
    c.inputs.obstacles[0].X_WG.position.z() += 0.1;
    const StepReport report = world.step(c.state, c.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    ASSERT_NO_THROW(world.checkCloths(c.state));
    ASSERT_EQ(c.state.obstacles[0].position, c.inputs.obstacles[0].X_WG.position);
  }
  double top = -1e9;
  for (int i = 0; i < c.state.cloths[0].x.cols(); ++i)
    top = std::max(top, c.state.cloths[0].x(2, i));
  EXPECT_GT(top, c.state.obstacles[0].position.z() + 0.05);
}

TEST(ImpulseCloths, SqueezedClothIsRefusedAndTheStateKept)
{
  Cloths c;
  c.add("cloth", 4, 0.1, {-0.05, -0.05, 0});
  c.addObstacle(Box{{0.2, 0.2, 0.02}}, {{0, 0, 0.02}, Quaterniond::Identity()});
  c.addObstacle(Box{{0.2, 0.2, 0.02}}, {{0, 0, -0.02}, Quaterniond::Identity()});
  World world = c.world({}, 0.01);
  c.inputs.obstacles[0].X_WG.position.z() = 0.009;
  c.inputs.obstacles[1].X_WG.position.z() = -0.009;
  const WorldState before = c.state;
  const StepReport report = world.step(c.state, c.inputs);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.failure, StepFailure::squeezed);
  EXPECT_NE(report.message.find("prescribed"), std::string::npos) << report.message;
  EXPECT_GT(report.cut_steps, 0);
  EXPECT_EQ(c.state.cloths[0].x, before.cloths[0].x);
  EXPECT_EQ(c.state.cloths[0].v, before.cloths[0].v);
  EXPECT_EQ(c.state.obstacles[0].position, before.obstacles[0].position);
}

/// What one step cannot do, because a solid turns by more than a quarter, shorter ones can.
TEST(ImpulseCloths, HalvesStepsWhereNeeded)
{
  Cloths c;
  c.add("cloth", 6, 0.2, {-0.1, -0.1, 0.003});
  c.addObstacle(Box{{0.5, 0.5, 0.1}}, {{0, 0, -0.05}, Quaterniond::Identity()});
  World world = c.world({}, 0.01);
  for (int k = 0; k < 5; ++k)
    ASSERT_TRUE(world.step(c.state, c.inputs).ok);
  c.inputs.obstacles[0].X_WG.orientation = Quaterniond(Eigen::AngleAxisd(2.5, Vector3d::UnitZ()));
  c.inputs.obstacles[0].X_WG.position.z() += 0.02;
  const StepReport report = world.step(c.state, c.inputs);
  ASSERT_TRUE(report.ok) << report.message;
  EXPECT_NO_THROW(world.checkCloths(c.state));
  EXPECT_GT(c.state.cloths[0].x.row(2).minCoeff(), 0.02);
}

/// Whatever solves them: a load shared by the inertia of an integrator's stage would be worth something else in each
/// cloth.
TEST(ImpulseCloths, ContactKeepsMomentumAcrossIntegrators)
{
  ClothOptions euler, second, controlled;
  second.integrator = controlled.integrator = Integrator::tr_bdf2;
  controlled.error_tolerance = 1e-5;
  for (const auto& options : {std::vector<ClothOptions>{euler, second}, {controlled, euler}, {second, controlled}})
  {
    Cloths c;
    c.add("lower", 8, 0.3, {0, 0, 0}, options[0]);
    c.add("upper", 8, 0.3, {0.1, 0.07, 0.02}, options[1]);
    for (int k = 0; k < 2; ++k)
    {
      c.inputs.cloths[k].gravity.setZero();
      c.state.cloths[k].v.row(2).setConstant(k == 0 ? 1.0 : -1.0);
    }
    World world = c.world({}, 2e-3);
    const auto momentum = [&]() -> Vector3d {
      return c.state.cloths[0].v * c.cloth(0).mass + c.state.cloths[1].v * c.cloth(1).mass;
    };
    const Vector3d before = momentum();
    for (int k = 0; k < 20; ++k)
    {
      const StepReport report = world.step(c.state, c.inputs);
      ASSERT_TRUE(report.ok) << report.message;
    }
    // of 1 m/s; what the linear solver leaves
    EXPECT_LT((momentum() - before).norm(), 1e-3 * c.cloth(0).totalMass());
    EXPECT_LT(std::abs(c.state.cloths[0].v.row(2).mean()), 0.5);   // they have met
  }
}

/// Largest gain of energy in a step of a cloth that lands on a ball, over its weight times the ball's radius.
double largestGain(Integrator integrator, bool one_newton_step, double error_tolerance)
{
  Cloths c;
  ClothOptions options;
  options.integrator = integrator;
  options.one_newton_step = one_newton_step;
  options.error_tolerance = error_tolerance;
  c.add("cloth", 12, 0.3, {-0.15, -0.15, 0.053}, options);
  c.addObstacle(Sphere{0.05}, {});
  World world = c.world({}, 0.005);
  const auto energy = [&] { return world.clothEnergies(0, c.state.cloths[0], c.inputs.cloths[0].gravity).total(); };
  double largest = 0.0;
  int repulsions = 0;
  for (int k = 0; k < 30; ++k)   // until its own folds meet
  {
    const double before = energy();
    const StepReport report = world.step(c.state, c.inputs);
    EXPECT_TRUE(report.ok) << report.message;
    repulsions = report.repulsions;
    largest = std::max(largest, energy() - before);
  }
  EXPECT_GT(repulsions, 0);
  return largest / (c.cloth(0).totalMass() * 9.81 * 0.05);
}

/// Contact holds stiff cloth away from its balance, which steps by tr_bdf2 would answer with five times the speed that
/// takes it back.
TEST(ImpulseCloths, ContactAddsNoEnergyToStepsOfSecondOrder)
{
  for (const bool one_newton_step : {false, true})
    // tr_bdf2 throughout: 0.2 to 0.3
    EXPECT_LT(largestGain(Integrator::tr_bdf2, one_newton_step, 0.0), 0.01) << one_newton_step;
}

/// Parts of a step would let go with as many times that speed: no more than the same steps undivided.
TEST(ImpulseCloths, ContactAddsNoEnergyToControlledSteps)
{
  for (const bool one_newton_step : {false, true})
  {
    const double undivided = largestGain(Integrator::implicit_euler, one_newton_step, 0.0);
    EXPECT_LT(undivided, 0.02);   // as contact first stretches it
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2})
      for (const double tolerance : {1e-4, 1e-5})
        // rounding decides which vertices touch first, and moves either by a quarter
        EXPECT_LT(largestGain(integrator, one_newton_step, tolerance), 1.25 * undivided)
            << toString(integrator) << " " << tolerance;
  }
}

TEST(ImpulseCloths, RefusesIntersectionsAtTheStart)
{
  Cloths c;
  c.add("first", 4, 0.2, {0, 0, 0});
  c.add("second", 4, 0.2, {0.05, 0.05, 0.01});
  c.addObstacle(Sphere{0.05}, {{0, 0, 1}, Quaterniond::Identity()});
  World world = c.world({}, 0.01);
  EXPECT_NO_THROW(world.checkCloths(c.state));
  for (int i = 0; i < 25; ++i)
    c.state.cloths[1].x(2, i) = c.state.cloths[1].x(0, i) - 0.1;
  try
  {
    world.checkCloths(c.state);
    ADD_FAILURE();
  }
  catch (const std::invalid_argument& e)
  {
    EXPECT_NE(std::string(e.what()).find("' at vertex "), std::string::npos) << e.what();
  }
}

/// Shorter steps would not help.
TEST(ImpulseCloths, WhatMeetsAtTheStartIsRefusedAtOnce)
{
  Cloths c;
  c.add("cloth", 4, 0.2, {-0.1, -0.1, 0.01});
  c.addObstacle(Plane{}, {});
  World world = c.world({}, 0.005);
  c.state.cloths[0].x(2, 3) = -0.01;
  const StepReport report = world.step(c.state, c.inputs);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.cut_steps, 0);
  EXPECT_EQ(report.message.find("shorter step"), std::string::npos) << report.message;
}

TEST(ImpulseCloths, LayersMuchThickerThanEdgesAreRefused)
{
  Cloths c;
  c.add("quilt", 20, 0.1, {0, 0, 0});   // edges of 5 mm, and diagonals
  c.model.cloths[0].contact->thickness = 0.019;
  EXPECT_NO_THROW(c.world({}, 0.005));
  c.model.cloths[0].contact->thickness = 0.025;
  try
  {
    World world = c.world({}, 0.005);
    ADD_FAILURE();
  }
  catch (const std::invalid_argument& e)
  {
    EXPECT_NE(std::string(e.what()).find("cloth 'quilt': contact: thickness 0.025"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("use at most 0.02 m"), std::string::npos) << e.what();
  }
}

/// Not as if something had squeezed them.
TEST(ImpulseCloths, ExplicitStepsThatAreTooLongAreSaidToBe)
{
  for (const Integrator integrator : {Integrator::imex, Integrator::symplectic_euler})
  {
    Cloths c;
    ClothOptions options;
    options.integrator = integrator;
    options.newton.max_cuts = 2;
    c.add("cloth", 8, 0.2, {-0.1, -0.1, 0.053}, options);
    c.addObstacle(Sphere{0.05}, {});
    World world = c.world({}, 8.0 * ClothStepper(c.model.cloths[0].model, options).stableStep());
    StepReport report;
    for (int k = 0; k < 200 && report.ok; ++k)
      report = world.step(c.state, c.inputs);
    ASSERT_FALSE(report.ok);
    EXPECT_EQ(report.failure, StepFailure::state_not_finite);
    EXPECT_NE(report.message.find("too long for its membrane"), std::string::npos) << report.message;
  }
}

/// The estimate is the limit: oscillations of the cloth at rest grow beyond it and stay below.
TEST(ImpulseCloths, StableStepIsTheLimitOfExplicitSteps)
{
  Cloths c;
  c.add("cloth", 8, 0.2, {0, 0, 0});
  for (const Integrator integrator : {Integrator::imex, Integrator::symplectic_euler})
  {
    ClothOptions options;
    options.integrator = integrator;
    ClothStepper stepper(c.model.cloths[0].model, options);
    const auto speedAfter = [&](double share) {
      ClothState state = c.state.cloths[0];
      for (Eigen::Index i = 0; i < state.x.cols(); ++i)
        state.v.col(i) = 1e-6 * Vector3d(std::sin(7.0 * i), std::cos(5.0 * i), std::sin(3.0 * i));
      ClothInputs inputs;
      inputs.gravity.setZero();
      for (int k = 0; k < 300; ++k)
        if (!stepper.step(state, inputs, share * stepper.stableStep()).ok)
          return 1e9;
      return state.v.cwiseAbs().maxCoeff();
    };
    EXPECT_LT(speedAfter(0.95), 1e-5);
    EXPECT_GT(speedAfter(1.1), 1e-3);
  }
  EXPECT_TRUE(std::isinf(ClothStepper(c.model.cloths[0].model, {}).stableStep()));
}

/// An explicit cloth beside it answers with its masses, the other as ever.
TEST(ImpulseCloths, AnExplicitClothLeavesLoadsOfOthersShared)
{
  Cloths c;
  c.add("cloth", 4, 0.1, {0, 0, 0});
  ClothOptions options;
  options.integrator = Integrator::symplectic_euler;
  ClothStepper stepper(c.model.cloths[0].model, options);
  ClothState state = c.state.cloths[0];
  pinVertices(state, {3});
  ClothInputs inputs;
  inputs.pins = state.x.col(3);
  const double h = 1e-5;
  ASSERT_TRUE(stepper.step(state, inputs, h).ok);
  const Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Constant(3, state.x.cols(), 2.0);
  Eigen::Matrix3Xd moved(3, state.x.cols()), pins, averages;
  ASSERT_TRUE(stepper.respond(force, h, moved, pins, averages));
  EXPECT_NEAR(moved(1, 5), 2.0 * h * h / c.cloth(0).mass[5], 1e-15);
  EXPECT_EQ(moved.col(3), Vector3d(0, 0, 0));
}

/// A step length from a state file that is far below min_step.
TEST(ImpulseCloths, ErrorControlDoesNotStartBelowItsShortestStep)
{
  Cloths c;
  c.add("cloth", 4, 0.1, {0, 0, 0});
  ClothOptions options;
  options.error_tolerance = 1e-4;
  ClothStepper stepper(c.model.cloths[0].model, options);
  c.state.cloths[0].next_step = 1e-300;
  const StepReport report = stepper.step(c.state.cloths[0], c.inputs.cloths[0], 0.005);
  EXPECT_TRUE(report.ok) << report.message;
  EXPECT_EQ(milliseconds(2.5e-9), "2.5e-06 ms");
}

}   // namespace
}   // namespace slender::test
