#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/cloth/cloth_group.h"
#include "slender_sim/geometry/mesh_shapes.h"

namespace slender::test {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Cloths
{
  ClothGroupModel model;
  ClothGroupState state;
  ClothGroupInputs inputs;

  void add(const std::string& name, int n, double size, const Vector3d& corner, double friction = 0.3)
  {
    ClothModel cloth =
        buildCloth(name, gridMesh(size, size, n, n, GridPattern::alternating), 0.2, isotropicMembrane(1e6, 0.3, 5e-4));
    cloth.bending_modulus = 1e-6;
    cloth.stiffness_damping = 1e-3;
    model.cloths.push_back(std::make_shared<ClothModel>(cloth));
    ContactProperties contact;
    contact.thickness = 4e-3;
    contact.friction = friction;
    model.contact.push_back(contact);
    state.cloths.push_back(makeClothState(cloth, cloth.rest.vertices.colwise() + corner));
    inputs.cloths.emplace_back();
  }
  void addSolid(const Shape& shape, const Pose& pose = {})
  {
    model.solids.push_back({shape, -1.0, {}});
    state.solids.push_back(pose);
    inputs.solids.push_back(pose);
  }
};

TEST(ClothGroup, ContactForcesBalanceMomentum)
{
  // two cloths that fall onto a ball and onto each other, one of them held: the forces of every step are its change of
  // momentum
  Cloths c;
  c.add("upper", 6, 0.3, {-0.15, -0.15, 0.112});
  c.add("lower", 6, 0.3, {-0.14, -0.15, 0.106});
  c.addSolid(Sphere{0.1});
  pinVertices(c.state.cloths[0], {0});
  c.inputs.cloths[0].pins = c.state.cloths[0].x.col(0);
  ClothOptions options;
  options.linear_tolerance = 1e-8;
  ClothGroup group(c.model, options);
  double most = 0.0, supported = 0.0;
  for (int k = 0; k < 60; ++k)
  {
    const ClothGroupState before = c.state;
    ASSERT_TRUE(group.step(c.state, c.inputs, 0.005).ok);
    for (int i = 0; i < 2; ++i)
    {
      const ClothModel& model = *c.model.cloths[static_cast<std::size_t>(i)];
      const auto& x = c.state.cloths[static_cast<std::size_t>(i)];
      Vector3d forces = -group.pinForces(i).rowwise().sum(), change(0, 0, 0);
      for (int v = 0; v < model.vertices(); ++v)
      {
        change += model.mass[v] / 0.005 * (x.v.col(v) - before.cloths[static_cast<std::size_t>(i)].v.col(v));
        forces += model.mass[v] * c.inputs.cloths[static_cast<std::size_t>(i)].gravity + group.contactForces(i).col(v);
        most = std::max(most, group.contactForces(i).col(v).norm());
        supported += group.contactForces(i)(2, v) / 60;
      }
      // answers to contacts are solved to that
      EXPECT_LT((change - forces).norm(), 1e-3 * model.totalMass() * 9.81) << k << " " << i;
    }
  }
  EXPECT_GT(group.collisions().repulsions, 0);
  EXPECT_GT(most, 0.01);
  EXPECT_GT(supported, 0.3 * 2 * c.model.cloths[0]->totalMass() * 9.81);
}

TEST(ClothGroup, ComesToRestOnAFloor)
{
  Cloths c;
  c.add("upper", 6, 0.3, {0, 0, 0.012});
  c.add("lower", 6, 0.3, {0.02, 0.01, 0.006});
  c.addSolid(Plane{});
  ClothGroup group(c.model, {});
  group.checkIntersections(c.state);
  double speed = 0.0;
  for (int k = 0; k < 200; ++k)
  {
    const StepReport report = group.step(c.state, c.inputs, 0.005);
    ASSERT_TRUE(report.ok) << report.message;
    ASSERT_EQ(group.intersections(c.state), 0u) << k;
    speed = std::max(c.state.cloths[0].v.cwiseAbs().maxCoeff(), c.state.cloths[1].v.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(group.collisions().repulsions, 0);
  EXPECT_LT(speed, 5e-3);
  // half a thickness above the floor, a thickness apart
  EXPECT_NEAR(c.state.cloths[1].x.row(2).mean(), 2e-3, 4e-4);
  EXPECT_NEAR(c.state.cloths[0].x.row(2).mean(), 6e-3, 1e-3);
}

TEST(ClothGroup, AFastSolidIsStoppedByNothingButCarriesCloth)
{
  Cloths c;
  c.add("cloth", 8, 0.4, {-0.2, -0.2, 0});
  c.addSolid(Sphere{0.05}, {{0, 0, -0.1}, Quaterniond::Identity()});
  for (ClothInputs& in : c.inputs.cloths)
    in.gravity.setZero();
  ClothGroup group(c.model, {});
  for (int k = 0; k < 10; ++k)   // at 20 m/s
  {
    c.inputs.solids[0].position.z() += 0.1;
    const StepReport report = group.step(c.state, c.inputs, 0.005);
    ASSERT_TRUE(report.ok) << report.message;
    ASSERT_EQ(group.intersections(c.state), 0u);
    ASSERT_EQ(c.state.solids[0].position, c.inputs.solids[0].position);
  }
  double top = -1e9;
  for (int i = 0; i < c.state.cloths[0].x.cols(); ++i)
    top = std::max(top, c.state.cloths[0].x(2, i));
  EXPECT_GT(top, c.state.solids[0].position.z() + 0.05);
}

TEST(ClothGroup, SqueezedClothIsRefusedAndTheStateKept)
{
  Cloths c;
  c.add("cloth", 4, 0.1, {-0.05, -0.05, 0});
  c.addSolid(Box{{0.2, 0.2, 0.02}}, {{0, 0, 0.02}, Quaterniond::Identity()});
  c.addSolid(Box{{0.2, 0.2, 0.02}}, {{0, 0, -0.02}, Quaterniond::Identity()});
  ClothGroup group(c.model, {});
  c.inputs.solids[0].position.z() = 0.009;
  c.inputs.solids[1].position.z() = -0.009;
  const ClothGroupState before = c.state;
  const StepReport report = group.step(c.state, c.inputs, 0.01);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.failure, StepFailure::squeezed);
  EXPECT_NE(report.message.find("prescribed"), std::string::npos) << report.message;
  EXPECT_GT(report.cut_steps, 0);
  EXPECT_EQ(c.state.cloths[0].x, before.cloths[0].x);
  EXPECT_EQ(c.state.cloths[0].v, before.cloths[0].v);
  EXPECT_EQ(c.state.solids[0].position, before.solids[0].position);
}

/// What one step cannot do, because a solid turns by more than a quarter, shorter ones can.
TEST(ClothGroup, HalvesStepsWhereNeeded)
{
  Cloths c;
  c.add("cloth", 6, 0.2, {-0.1, -0.1, 0.003});
  c.addSolid(Box{{0.5, 0.5, 0.1}}, {{0, 0, -0.05}, Quaterniond::Identity()});
  ClothGroup group(c.model, {});
  for (int k = 0; k < 5; ++k)
    ASSERT_TRUE(group.step(c.state, c.inputs, 0.01).ok);
  c.inputs.solids[0].orientation = Quaterniond(Eigen::AngleAxisd(2.5, Vector3d::UnitZ()));
  c.inputs.solids[0].position.z() += 0.02;
  const StepReport report = group.step(c.state, c.inputs, 0.01);
  ASSERT_TRUE(report.ok) << report.message;
  EXPECT_EQ(group.intersections(c.state), 0u);
  EXPECT_GT(c.state.cloths[0].x.row(2).minCoeff(), 0.02);
}

/// Whatever solves them: a load shared by the inertia of an integrator's stage would be worth something else in each
/// cloth.
TEST(ClothGroup, ContactKeepsMomentumAcrossIntegrators)
{
  ClothOptions euler, second, controlled;
  second.integrator = controlled.integrator = Integrator::tr_bdf2;
  controlled.error_tolerance = 1e-5;
  for (const auto& options : {std::vector<ClothOptions>{euler, second}, {controlled, euler}, {second, controlled}})
  {
    Cloths c;
    c.add("lower", 8, 0.3, {0, 0, 0});
    c.add("upper", 8, 0.3, {0.1, 0.07, 0.02});
    c.model.options = options;
    for (int k = 0; k < 2; ++k)
    {
      c.inputs.cloths[k].gravity.setZero();
      c.state.cloths[k].v.row(2).setConstant(k == 0 ? 1.0 : -1.0);
    }
    ClothGroup group(c.model, {});
    const auto momentum = [&]() -> Vector3d {
      return c.state.cloths[0].v * c.model.cloths[0]->mass + c.state.cloths[1].v * c.model.cloths[1]->mass;
    };
    const Vector3d before = momentum();
    for (int k = 0; k < 20; ++k)
    {
      const StepReport report = group.step(c.state, c.inputs, 2e-3);
      ASSERT_TRUE(report.ok) << report.message;
    }
    // of 1 m/s; what the linear solver leaves
    EXPECT_LT((momentum() - before).norm(), 1e-3 * c.model.cloths[0]->totalMass());
    EXPECT_LT(std::abs(c.state.cloths[0].v.row(2).mean()), 0.5);   // they have met
  }
}

/// Largest gain of energy in a step of a cloth that lands on a ball, over its weight times the ball's radius.
double largestGain(Integrator integrator, bool one_newton_step, double error_tolerance)
{
  Cloths c;
  c.add("cloth", 12, 0.3, {-0.15, -0.15, 0.053});
  c.addSolid(Sphere{0.05});
  ClothOptions options;
  options.integrator = integrator;
  options.one_newton_step = one_newton_step;
  options.error_tolerance = error_tolerance;
  ClothGroup group(c.model, options);
  const auto energy = [&] { return group.stepper(0).energies(c.state.cloths[0], c.inputs.cloths[0].gravity).total(); };
  double largest = 0.0;
  for (int k = 0; k < 30; ++k)   // until its own folds meet
  {
    const double before = energy();
    const StepReport report = group.step(c.state, c.inputs, 0.005);
    EXPECT_TRUE(report.ok) << report.message;
    largest = std::max(largest, energy() - before);
  }
  EXPECT_GT(group.collisions().repulsions, 0);
  return largest / (c.model.cloths[0]->totalMass() * 9.81 * 0.05);
}

/// Contact holds stiff cloth away from its balance, which steps by tr_bdf2 would answer with five times the speed that
/// takes it back.
TEST(ClothGroup, ContactAddsNoEnergyToStepsOfSecondOrder)
{
  for (const bool one_newton_step : {false, true})
    // tr_bdf2 throughout: 0.2 to 0.3
    EXPECT_LT(largestGain(Integrator::tr_bdf2, one_newton_step, 0.0), 0.01) << one_newton_step;
}

/// Parts of a step would let go with as many times that speed: no more than the same steps undivided.
TEST(ClothGroup, ContactAddsNoEnergyToControlledSteps)
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

TEST(ClothGroup, RefusesIntersectionsAtTheStart)
{
  Cloths c;
  c.add("first", 4, 0.2, {0, 0, 0});
  c.add("second", 4, 0.2, {0.05, 0.05, 0.01});
  c.addSolid(Sphere{0.05}, {{0, 0, 1}, Quaterniond::Identity()});
  ClothGroup group(c.model, {});
  EXPECT_NO_THROW(group.checkIntersections(c.state));
  for (int i = 0; i < 25; ++i)
    c.state.cloths[1].x(2, i) = c.state.cloths[1].x(0, i) - 0.1;
  try
  {
    group.checkIntersections(c.state);
    ADD_FAILURE();
  }
  catch (const std::invalid_argument& e)
  {
    EXPECT_NE(std::string(e.what()).find("' at vertex "), std::string::npos) << e.what();
  }
  c.model.contact.pop_back();
  EXPECT_THROW(ClothGroup(c.model, {}), std::invalid_argument);
  EXPECT_THROW(group.step(c.state, ClothGroupInputs(), 0.01), std::invalid_argument);
}

/// Shorter steps would not help.
TEST(ClothGroup, WhatMeetsAtTheStartIsRefusedAtOnce)
{
  Cloths c;
  c.add("cloth", 4, 0.2, {-0.1, -0.1, 0.01});
  c.addSolid(Plane{});
  ClothGroup group(c.model, {});
  c.state.cloths[0].x(2, 3) = -0.01;
  const StepReport report = group.step(c.state, c.inputs, 0.005);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.cut_steps, 0);
  EXPECT_EQ(report.message.find("shorter step"), std::string::npos) << report.message;
}

TEST(ClothGroup, LayersMuchThickerThanEdgesAreRefused)
{
  Cloths c;
  c.add("quilt", 20, 0.1, {0, 0, 0});   // edges of 5 mm, and diagonals
  c.model.contact[0].thickness = 0.019;
  EXPECT_NO_THROW(ClothGroup(c.model, {}));
  c.model.contact[0].thickness = 0.025;
  try
  {
    ClothGroup group(c.model, {});
    ADD_FAILURE();
  }
  catch (const std::invalid_argument& e)
  {
    EXPECT_NE(std::string(e.what()).find("cloth 'quilt': contact: thickness 0.025"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("use at most 0.02 m"), std::string::npos) << e.what();
  }
}

/// Not as if something had squeezed them.
TEST(ClothGroup, ExplicitStepsThatAreTooLongAreSaidToBe)
{
  for (const Integrator integrator : {Integrator::imex, Integrator::symplectic_euler})
  {
    Cloths c;
    c.add("cloth", 8, 0.2, {-0.1, -0.1, 0.053});
    c.addSolid(Sphere{0.05});
    ClothOptions options;
    options.integrator = integrator;
    options.newton.max_cuts = 2;
    ClothGroup group(c.model, options);
    const double stable = group.stepper(0).stableStep();
    StepReport report;
    for (int k = 0; k < 200 && report.ok; ++k)
      report = group.step(c.state, c.inputs, 8.0 * stable);
    ASSERT_FALSE(report.ok);
    EXPECT_EQ(report.failure, StepFailure::state_not_finite);
    EXPECT_NE(report.message.find("too long for its membrane"), std::string::npos) << report.message;
  }
}

/// The estimate is the limit: oscillations of the cloth at rest grow beyond it and stay below.
TEST(ClothGroup, StableStepIsTheLimitOfExplicitSteps)
{
  Cloths c;
  c.add("cloth", 8, 0.2, {0, 0, 0});
  for (const Integrator integrator : {Integrator::imex, Integrator::symplectic_euler})
  {
    ClothOptions options;
    options.integrator = integrator;
    ClothStepper stepper(c.model.cloths[0], options);
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
  EXPECT_TRUE(std::isinf(ClothStepper(c.model.cloths[0], {}).stableStep()));
}

/// An explicit cloth beside it answers with its masses, the other as ever.
TEST(ClothGroup, AnExplicitClothLeavesLoadsOfOthersShared)
{
  Cloths c;
  c.add("cloth", 4, 0.1, {0, 0, 0});
  ClothOptions options;
  options.integrator = Integrator::symplectic_euler;
  ClothStepper stepper(c.model.cloths[0], options);
  ClothState state = c.state.cloths[0];
  pinVertices(state, {3});
  ClothInputs inputs;
  inputs.pins = state.x.col(3);
  const double h = 1e-5;
  ASSERT_TRUE(stepper.step(state, inputs, h).ok);
  const Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Constant(3, state.x.cols(), 2.0);
  Eigen::Matrix3Xd moved(3, state.x.cols()), pins, averages;
  ASSERT_TRUE(stepper.respond(force, h, moved, pins, averages));
  EXPECT_NEAR(moved(1, 5), 2.0 * h * h / c.model.cloths[0]->mass[5], 1e-15);
  EXPECT_EQ(moved.col(3), Vector3d(0, 0, 0));
}

/// A step length from a state file that is far below min_step.
TEST(ClothGroup, ErrorControlDoesNotStartBelowItsShortestStep)
{
  Cloths c;
  c.add("cloth", 4, 0.1, {0, 0, 0});
  ClothOptions options;
  options.error_tolerance = 1e-4;
  ClothStepper stepper(c.model.cloths[0], options);
  c.state.cloths[0].next_step = 1e-300;
  const StepReport report = stepper.step(c.state.cloths[0], c.inputs.cloths[0], 0.005);
  EXPECT_TRUE(report.ok) << report.message;
  EXPECT_EQ(milliseconds(2.5e-9), "2.5e-06 ms");
}

}   // namespace
}   // namespace slender::test
