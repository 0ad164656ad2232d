// Rigid bodies welded to rods, and bodies alone (thesis 4.5).
#include <gtest/gtest.h>

#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/geometry/rotation.h"
#include "test/support/groups.h"

namespace slender::test {
namespace {

/// End to end error of the angular velocity of a free body with three moments, after 1 s, in steps of 1/count s.
Twist tumble(Integrator integrator, int count, Pose& end)
{
  Group g;
  Twist spin;
  spin.angular << 1.0, 5.0, 0.3;
  g.addBody(bodyOf(1.0, {0.02, 0.035, 0.05}), {}, spin);
  g.setGravity(Vector3d::Zero());
  World world = g.world(withIntegrator(integrator), 1.0 / count);
  for (int k = 0; k < count; ++k)
  {
    const StepReport report = world.step(g.state, g.inputs);
    EXPECT_TRUE(report.ok) << report.message;
  }
  end = g.state.bodies[0].X_WB;
  return g.state.bodies[0].velocity;
}

TEST(RigidBodies, TumblingHasTheIntegratorsOrder)
{
  for (Integrator integrator : {Integrator::implicit_euler, Integrator::bdf2, Integrator::tr_bdf2,
                                Integrator::implicit_midpoint, Integrator::generalized_alpha})
  {
    Pose exact_pose, coarse_pose, fine_pose;
    const Twist exact = tumble(Integrator::tr_bdf2, 6400, exact_pose);
    const Twist coarse = tumble(integrator, 200, coarse_pose), fine = tumble(integrator, 400, fine_pose);
    const Vector3d spin(1.0, 5.0, 0.3), inertia(0.02, 0.035, 0.05);
    const auto momentum = [&](const Pose& x, const Twist& v) {
      return Vector3d(x.orientation * Vector3d(inertia.cwiseProduct(x.orientation.conjugate() * v.angular)));
    };
    // constant: 6400 steps leave 2e-7
    EXPECT_LT((momentum(exact_pose, exact) - inertia.cwiseProduct(spin)).norm(), 1e-6);
    const double ratio = (coarse.angular - exact.angular).norm() / (fine.angular - exact.angular).norm();
    const double pose_ratio = coarse_pose.orientation.angularDistance(exact_pose.orientation) /
                              fine_pose.orientation.angularDistance(exact_pose.orientation);
    // also of implicit Euler, which moves a body without torque as its angular momentum says
    EXPECT_NEAR(std::log2(ratio), 2.0, 0.2) << toString(integrator);
    EXPECT_NEAR(std::log2(pose_ratio), 2.0, 0.2) << toString(integrator);
  }
}

/// A rod whose nodes are all welded to a tumbling body, beside its centre.
Group laden(double mass_damping = 0.0)
{
  Group g;
  Twist spin;
  spin.angular << 0.1, 5.0, 0.1;
  const int body = g.addBody(bodyOf(1.0, {0.01, 0.02, 0.03}), {}, spin);
  const int n = 4;
  const Matrix3Xd nodes = straightNodes(n, 0.3);
  RodModel model = openRod(nodes, modulusSection(0.02, 0.015, 50.0, 1.0));
  model.mass_damping = mass_damping;
  Rod rod(model, nodes);
  for (int i = 0; i < n; ++i)
    rod.state.v.col(i) = spin.angular.cross(nodes.col(i));
  g.weld(g.addRod(rod), 0, n - 1, body);
  g.setGravity(Vector3d::Zero());
  return g;
}

double kineticEnergy(const Group& g)
{
  const RigidBodyState& s = g.state.bodies[0];
  const RigidBodyModel& m = g.model.bodies[0].body;
  const Vector3d w = s.X_WB.orientation.conjugate() * s.velocity.angular;
  double energy = 0.5 * m.mass * s.velocity.linear.squaredNorm() + 0.5 * w.dot(m.inertia * w);
  for (std::size_t r = 0; r < g.state.rods.size(); ++r)
    energy += 0.5 * g.state.rods[r].v.colwise().squaredNorm().dot(g.model.rods[r].model->mass);
  return energy;
}

/// Expects that 300 steps change neither angular momentum nor energy.
void expectFreeMotion(Group g, Integrator integrator, double h)
{
  World world = g.world(withIntegrator(integrator), h);
  const Vector3d momentum = g.angularMomentum();
  const double energy = kineticEnergy(g);
  double worst = 0, worst_energy = 0;
  for (int k = 0; k < 300; ++k)
  {
    const StepReport report = world.step(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    worst = std::max(worst, (g.angularMomentum() - momentum).norm() / momentum.norm());
    worst_energy = std::max(worst_energy, std::abs(kineticEnergy(g) / energy - 1.0));
  }
  EXPECT_LT(worst, 1e-12) << toString(integrator) << ", step " << h;
  EXPECT_LT(worst_energy, 2e-12) << toString(integrator) << ", step " << h;
}

TEST(RigidBodies, FreeRotationKeepsMomentumAndEnergy)
{
  // about the middle axis, which is unstable; the momentum grew by 8 % with 0.075 rad per step, the energy by 0.2 %
  for (const double turn : {0.02, 0.3, 1.0, 2.0})
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::symplectic_euler})
    {
      Group g;
      Twist spin;
      spin.angular << 0.1, 15.0, 0.1;
      g.addBody(bodyOf(1.0, {0.01, 0.02, 0.03}), {}, spin);
      g.setGravity(Vector3d::Zero());
      expectFreeMotion(g, integrator, turn / 15.0);
    }
}

TEST(RigidBodies, WhatABodyCarriesTurnsWithItsMomentum)
{
  // as one body, whose centre of mass is another one
  for (const double turn : {0.02, 0.1, 0.5})
    expectFreeMotion(laden(), Integrator::implicit_euler, turn / 5.0);
}

/// Where a damped body that tumbles is after 0.5 s in `count` steps, alone or with a damped rod.
RigidBodyState dampedEnd(Integrator integrator, int count, bool carries)
{
  Group g;
  if (carries)
    g = laden(2.0);
  else
  {
    Twist spin;
    spin.angular << 1.0, 5.0, 0.3;
    RigidBodyModel body = bodyOf(2.0, {0.1, 0.2, 0.3});
    body.angular_damping = 2.0;
    body.torque << 0.1, 0.2, 0.3;
    g.addBody(body, {}, spin);
    g.setGravity(Vector3d::Zero());
  }
  TimeConfig time = withIntegrator(integrator);
  time.newton.tolerance = 1e-11;
  World world = g.world(time, 0.5 / count);
  for (int k = 0; k < count; ++k)
  {
    const StepReport report = world.step(g.state, g.inputs);
    EXPECT_TRUE(report.ok) << report.message;
  }
  return g.state.bodies[0];
}

TEST(RigidBodies, DampingHasTheIntegratorsOrder)
{
  // Before, it was of first order: it was left out at the start of a run, and acted by the rate of half a step earlier.
  for (const bool carries : {false, true})
  {
    const RigidBodyState exact = dampedEnd(Integrator::tr_bdf2, 3200, carries);
    for (const Integrator integrator : {Integrator::implicit_euler, Integrator::bdf2, Integrator::tr_bdf2,
                                        Integrator::implicit_midpoint, Integrator::generalized_alpha})
    {
      const auto errors = [&](int count) {
        const RigidBodyState end = dampedEnd(integrator, count, carries);
        return Vector3d((end.velocity.angular - exact.velocity.angular).norm(),
                        end.X_WB.orientation.angularDistance(exact.X_WB.orientation),
                        (end.X_WB.position - exact.X_WB.position).norm());
      };
      const Vector3d coarse = errors(100), fine = errors(200);
      for (int k = 0; k < (carries ? 3 : 2); ++k)   // the centre of a body alone does not move
      {
        EXPECT_NEAR(std::log2(coarse[k] / fine[k]), order(integrator), 0.25)
            << toString(integrator) << (carries ? ", carries a rod" : "") << ": error " << k << " is " << fine[k];
      }
    }
  }
}

/// A body that is thrown: implicit Euler falls by g h t / 2 too far.
TEST(RigidBodies, ErrorControlShortensTheirSteps)
{
  const auto errorOf = [](double tolerance) {
    Group g;
    g.addBody(bodyOf(1.0, {0.01, 0.02, 0.03}), {}, {Vector3d(1, 0, 2), Vector3d(0.1, 10, 0.1)});
    TimeConfig time = withIntegrator(Integrator::implicit_euler);
    time.error_tolerance = tolerance;
    World world = g.world(time, 0.01);
    for (int k = 0; k < 50; ++k)
    {
      const StepReport report = world.step(g.state, g.inputs);
      EXPECT_TRUE(report.ok) << report.message;
      if (tolerance > 0)
        EXPECT_LE(report.error_estimate, tolerance);
    }
    return std::abs(g.state.bodies[0].X_WB.position.z() - (2 * 0.5 - 0.5 * 9.81 * 0.25));
  };
  const double fixed = errorOf(0.0), coarse = errorOf(1e-4), fine = errorOf(1e-6);
  EXPECT_NEAR(fixed, 0.5 * 9.81 * 0.01 * 0.5, 1e-6);
  // of steps as short as sqrt(2 tolerance / g)
  EXPECT_LT(coarse, 0.5 * 9.81 * 0.5 * std::sqrt(2e-4 / 9.81));
  EXPECT_LT(fine, 0.5 * 9.81 * 0.5 * std::sqrt(2e-6 / 9.81));
}

TEST(RigidBodies, TorsionalPendulum)
{
  // T = 2 pi sqrt(J L / beta); the rod's own polar inertia is not modelled, its nodes have no extent
  const double length = 1.0, beta = 2e-3, inertia = 1e-3;
  Rod rod = straightRod(11, length, modulusSection(0.05, beta, 1e4, 1e-3));
  rod.hold(0, 0);
  Group g;
  g.addRod(rod);
  Twist spin;
  spin.angular << 0.5, 0, 0;
  const int body = g.addBody(bodyOf(1.0, {inertia, 0.6 * inertia, 0.6 * inertia}),
                             {Vector3d(length, 0, 0), Eigen::Quaterniond::Identity()}, spin);
  g.weld(0, 10, 10, body);
  g.setGravity(Vector3d::Zero());
  const double period = 2 * M_PI * std::sqrt(inertia * length / beta), h = period / 400;
  World world = g.world(withIntegrator(Integrator::tr_bdf2), h);
  double time = 0, last = 0, crossing = 0;
  int found = 0;
  for (int k = 0; k < 1300 && found < 4; ++k)
  {
    const double before = g.state.bodies[0].velocity.angular.x();
    ASSERT_TRUE(world.step(g.state, g.inputs).ok);
    time += h;
    const double after = g.state.bodies[0].velocity.angular.x();
    if (before > 0 && after <= 0)
    {
      crossing = time - h + h * before / (before - after);
      if (found++ > 0)
        EXPECT_NEAR(crossing - last, period, 2e-4 * period);   // TR-BDF2's phase error at 400 steps a period is 1e-4
      last = crossing;
    }
  }
  EXPECT_GE(found, 3);
}

TEST(RigidBodies, MomentaAreConserved)
{
  // Linear momentum exactly (Newton's tolerance); angular momentum to the order of the method, as of rods.
  double error[2];
  for (int fine = 0; fine < 2; ++fine)
  {
    Group g = tee();
    TimeConfig time = withIntegrator(Integrator::tr_bdf2);
    time.newton.tolerance = 1e-11;
    World world = g.world(time, 2e-3 / (fine + 1));
    const Vector3d p = g.momentum(), l = g.angularMomentum();
    for (int k = 0; k < 100 * (fine + 1); ++k)
    {
      const StepReport report = world.step(g.state, g.inputs);
      ASSERT_TRUE(report.ok) << report.message;
      ASSERT_LE(report.iterations, 12);   // two stages, quadratic convergence
    }
    EXPECT_LT((g.momentum() - p).norm(), 1e-6 * p.norm());   // what Newton leaves in 400 stages
    error[fine] = (g.angularMomentum() - l).norm() / l.norm();
  }
  EXPECT_LT(error[0], 2e-3);
  EXPECT_LT(error[1], 0.35 * error[0]);
}

TEST(RigidBodies, WeldsHold)
{
  Group g = tee();
  World world = g.world(withIntegrator(Integrator::tr_bdf2), 4e-3);
  std::vector<Pose> start;   // of the grasps in the body
  for (const RodState& rod : g.state.rods)
    start.push_back(g.state.bodies[0].X_WB.inverse() * rod.grasps[0].X_WG);
  for (int k = 0; k < 50; ++k)
    ASSERT_TRUE(world.step(g.state, g.inputs).ok);
  for (std::size_t r = 0; r < g.state.rods.size(); ++r)
  {
    const GraspState& grasp = g.state.rods[r].grasps[0];
    const Pose expected = g.state.bodies[0].X_WB * start[r];
    for (int i = grasp.first_node; i <= grasp.last_node; ++i)
      EXPECT_LT((g.state.rods[r].x.col(i) - expected * grasp.nodes_G[i - grasp.first_node]).norm(), 1e-12);
    EXPECT_LT((grasp.X_WG.position - expected.position).norm(), 1e-12);
  }
}

TEST(RigidBodies, HeavyBodyIsAClamp)
{
  // A body a million times heavier than the rod holds it as a fixed grasp does.
  Rod held = straightRod(21, 1.0, modulusSection(0.05, 0.04, 1e3, 0.02));
  held.inputs.gravity << 0, 0, -9.81;
  Rod free = held;
  held.hold(0, 0);
  RodStepper stepper(held.model, withIntegrator(Integrator::tr_bdf2));
  Group g;
  g.addRod(free);
  RigidBodyModel heavy = bodyOf(1e6, {1e6, 1e6, 1e6});
  heavy.gravity = false;
  g.weld(0, 0, 0, g.addBody(heavy, {}));
  World world = g.world(withIntegrator(Integrator::tr_bdf2), 2e-3);
  for (int k = 0; k < 200; ++k)
  {
    ASSERT_TRUE(stepper.step(held.state, held.inputs, 2e-3).ok);
    ASSERT_TRUE(world.step(g.state, g.inputs).ok);
  }
  // the body moves by mass ratio times g t^2
  EXPECT_LT((held.state.x - g.state.rods[0].x).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(RigidBodies, DrivenBodyCarriesItsRod)
{
  // A driven body with a weld is a grasp with that motion.
  Rod held = straightRod(15, 0.7, modulusSection(0.05, 0.04, 1e3, 0.02));
  Rod free = held;
  held.hold(0, 0);
  Group g;
  g.addRod(free);
  RigidBodyModel driven = bodyOf(1.0, {1, 1, 1});
  driven.simulated = false;
  const Pose start = held.state.grasps[0].X_WG;
  g.weld(0, 0, 0, g.addBody(driven, start));
  RodStepper stepper(held.model, withIntegrator(Integrator::tr_bdf2));
  World world = g.world(withIntegrator(Integrator::tr_bdf2), 5e-3);
  for (int k = 1; k <= 100; ++k)
  {
    Pose pose = start;
    pose.position += Vector3d(0, 0.2 * std::sin(0.05 * k), 0.001 * k);
    pose.orientation = Eigen::AngleAxisd(0.02 * k, Vector3d(1, 2, 3).normalized()) * pose.orientation;
    held.inputs.grasps[0].X_WG = g.inputs.bodies[0].X_WG = pose;
    ASSERT_TRUE(stepper.step(held.state, held.inputs, 5e-3).ok);
    ASSERT_TRUE(world.step(g.state, g.inputs).ok);
  }
  EXPECT_LT((held.state.x - g.state.rods[0].x).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((stepper.wrenches()[0].force - world.rodWrenches(0)[0].force).norm(),
            1e-9 * stepper.wrenches()[0].force.norm());
}

TEST(RigidBodies, InputsWithoutTheGraspsOfWeldsAreRefused)
{
  // before, the motion of the driven body was written beyond the end of the list
  for (const Integrator integrator : {Integrator::tr_bdf2, Integrator::symplectic_euler})
  {
    Group g;
    g.addRod(straightRod(5, 0.5, modulusSection(0.05, 0.04, 1e3, 0.02)));
    RigidBodyModel driven = bodyOf(1.0, {1, 1, 1});
    driven.simulated = false;
    g.weld(0, 0, 0, g.addBody(driven, {}));
    World world = g.world(withIntegrator(integrator), 1e-4);
    g.inputs.rods[0].grasps.clear();
    const StepReport report = world.step(g.state, g.inputs);
    EXPECT_EQ(report.failure, StepFailure::input_not_finite) << report.message;
    EXPECT_NE(report.message.find("grasp targets"), std::string::npos) << report.message;
  }
}

TEST(RigidBodies, HangingBodyAtRest)
{
  // a rope between a wall and a body that hangs from another: forces balance, the wall carries the weights
  const RodSection section = modulusSection(1e-3, 1e-3, 200.0, 0.05);
  Rod rope = straightRod(21, 0.6, section);
  rope.inputs.gravity << 0, 0, -9.81;
  rope.hold(0, 0);
  Group g;
  g.addRod(rope);
  const double mass = 0.08;
  g.weld(0, 20, 20,
         g.addBody(bodyOf(mass, {1e-5, 1e-5, 1e-5}), {Vector3d(0.61, 0, 0), Eigen::Quaterniond::Identity()}));
  World world = g.world(withIntegrator(Integrator::tr_bdf2), 0.01);
  const StepReport report = world.solveEquilibrium(g.state, g.inputs);
  ASSERT_TRUE(report.ok) << report.message;
  const double weight = 9.81 * (mass + rope.model->totalMass());
  EXPECT_NEAR(world.rodWrenches(0)[0].force.z(), -weight, 1e-6 * weight);
  EXPECT_LT(world.rodWrenches(0)[0].force.head<2>().norm(), 1e-6 * weight);
  EXPECT_LT(g.state.bodies[0].X_WB.position.z(), -0.5);
  // and a step from there moves nothing
  const Vector3d at = g.state.bodies[0].X_WB.position;
  ASSERT_TRUE(world.step(g.state, g.inputs).ok);
  EXPECT_LT((g.state.bodies[0].X_WB.position - at).norm(), 1e-9);
}

TEST(RigidBodies, TurnedBodyAtRest)
{
  // a constant moment on a body under a hanging rod: angle = moment L / beta, whatever the body's inertia
  for (double inertia : {1e-5, 1e-3, 0.1, 10.0})
  {
    const double beta = 1e-4, length = 1.0;
    const Matrix3Xd nodes = straightNodes(21, length, Vector3d::Zero(), -Vector3d::UnitZ());
    Rod rod(openRod(nodes, modulusSection(1e-2, beta, 1e4, 0.01)), nodes);
    rod.hold(0, 0);
    Group g;
    g.addRod(rod);
    RigidBodyModel body = bodyOf(0.1, {inertia, inertia, inertia});
    body.torque << 0, 0, 0.5 * beta / length;
    g.weld(0, 20, 20, g.addBody(body, {Vector3d(0, 0, -length), Eigen::Quaterniond::Identity()}));
    g.setGravity({0, 0, -9.81});
    World world = g.world(withIntegrator(Integrator::implicit_euler), 0.005);
    const StepReport report = world.solveEquilibrium(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    const Vector3d turn = rotationVector(g.state.bodies[0].X_WB.orientation);
    EXPECT_NEAR(turn.z(), 0.5, 1e-4) << inertia;   // 1e-8 of the weight at an edge's length is 1e-5 of the moment
    EXPECT_LT(turn.head<2>().norm(), 1e-6) << inertia;
  }
}

TEST(RigidBodies, ImpossibleInertiaIsRefused)
{
  EXPECT_THROW(checkBody(bodyOf(1.0, {1, 1, 3})), std::invalid_argument);
  EXPECT_THROW(checkBody(bodyOf(-1.0, {1, 1, 1})), std::invalid_argument);
  EXPECT_THROW(checkBody(bodyOf(1.0, {1, 0, 1})), std::invalid_argument);
}

}   // namespace
}   // namespace slender::test
