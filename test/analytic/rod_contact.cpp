// Rods against obstacles, bodies, each other and themselves.
#include <gtest/gtest.h>

#include "slender_sim/geometry/rotation.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/groups.h"

namespace slender::test {
namespace {

/// Rope of the given number of nodes lying along x at height z.
Rod rope(int n, double length, double radius, double z, double youngs = 1e6)
{
  Rod rod(openRod(straightNodes(n, length, Vector3d(0, 0, z)), roundSection(radius, youngs, 1000.0)),
          straightNodes(n, length, Vector3d(0, 0, z)));
  rod.inputs.gravity << 0, 0, -9.81;
  return rod;
}

void touch(Group& g, double gap, double friction = 0.3)
{
  for (WorldModel::Rod& rod : g.model.rods)
    rod.contact = ContactProperties{true, true, true, friction};
  g.model.contact.gap = gap;
}

double contactForce(const World& world, int axis)
{
  double sum = 0;
  for (const ContactForce& contact : world.contacts())
    sum += contact.force[axis];
  return sum;
}

TEST(RodContact, RopeComesToRestOnTheFloor)
{
  const double radius = 0.004;
  // multistep methods carry the velocity before an impact beyond it and bounce; implicit Euler does not
  for (Integrator integrator : {Integrator::implicit_euler, Integrator::bdf2, Integrator::tr_bdf2})
  {
    Group g;
    g.addRod(rope(21, 0.4, radius, 0.05));
    g.addObstacle(Plane{}, {});
    touch(g, 0.1 * radius);
    World world = g.world(withIntegrator(integrator), 2e-3);
    for (int k = 0; k < 400; ++k)
    {
      const StepReport report = world.step(g.state, g.inputs);
      ASSERT_TRUE(report.ok) << toString(integrator) << " step " << k << ": " << report.message;
      ASSERT_EQ(report.cut_steps, 0) << toString(integrator) << " step " << k << ": a wrong matrix makes Newton fail";
      ASSERT_GT(g.state.rods[0].x.row(2).minCoeff(), radius) << k;
    }
    if (integrator != Integrator::implicit_euler)
    {
      // fallen from 0.05; a shorter step has a stiffer barrier, from which a rope bounces higher: here to 0.033
      EXPECT_LT(g.state.rods[0].x.row(2).maxCoeff(), 0.035) << toString(integrator);
      continue;
    }
    EXPECT_LT(g.state.rods[0].x.row(2).maxCoeff(), 1.11 * radius) << toString(integrator);
    const double weight = 9.81 * g.model.rods[0].model->totalMass();
    EXPECT_NEAR(contactForce(world, 2), weight, 0.02 * weight) << toString(integrator);
    EXPECT_LT(g.state.rods[0].v.cwiseAbs().maxCoeff(), 2e-3) << toString(integrator);
  }
}

/// Speed 0.2 s after the ground under a rope at rest became a slope.
double slide(double slope, double friction)
{
  Group g;
  g.addRod(rope(11, 0.2, 0.004, 0.00425));
  g.addObstacle(Plane{}, {});
  touch(g, 0.0008, friction);
  World world = g.world(withIntegrator(Integrator::implicit_euler), 2e-3);
  for (int k = -50; k < 100; ++k)
  {
    if (k >= 0)
      g.setGravity(9.81 * Vector3d(std::sin(slope), 0, -std::cos(slope)));
    const StepReport report = world.step(g.state, g.inputs);
    EXPECT_TRUE(report.ok) << report.message;
  }
  return (g.state.rods[0].v * g.model.rods[0].model->mass).x() / g.model.rods[0].model->totalMass();
}

TEST(RodContact, CoulombsLawOnASlope)
{
  const double mu = 0.4;
  // Just below the angle of friction the springs of friction hold, and implicit Euler has damped their vibration.
  EXPECT_LT(std::abs(slide(std::atan(0.9 * mu), mu)), 1e-9);
  const double slope = std::atan(1.5 * mu);
  const double expected = 0.2 * 9.81 * (std::sin(slope) - mu * std::cos(slope));
  EXPECT_NEAR(slide(slope, mu), expected, 0.02 * expected);   // it lifts off a little as it starts
  EXPECT_NEAR(slide(slope, 0.0), 0.2 * 9.81 * std::sin(slope), 1e-3);
}

TEST(RodContact, MovedObstaclePushesARope)
{
  // a cylinder across a rope held at both ends pushes it down by 8 cm at 1 m/s: the rope is in contact, taut, and
  // nowhere inside
  const double radius = 0.003;
  Rod rod = rope(41, 0.4, radius, 0.0, 1e5);
  rod.hold(0, 0);
  rod.hold(40, 40);
  Group g;
  g.addRod(rod);
  Pose pose{Vector3d(0.2, 0, 0.03), Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX()))};
  g.addObstacle(Cylinder{0.02, 0.2}, pose, 0.3);
  touch(g, 0.1 * radius);
  World world = g.world(withIntegrator(Integrator::tr_bdf2), 1e-3);
  double force = 0.0;
  for (int k = 1; k <= 80; ++k)
  {
    g.inputs.obstacles[0].X_WG.position.z() = 0.03 - 0.001 * k;
    const StepReport report = world.step(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    ASSERT_GT(clearance(g), 0.0) << k;
    force += contactForce(world, 2);
  }
  EXPECT_LT(g.state.rods[0].x.row(2).minCoeff(), -0.05);
  EXPECT_LT(force, 0.0);
}

/// The twist of a straight rod that may touch is the turn of its ends, whatever the solver did on the way: frames
/// belong to the same instant as positions.
TEST(RodContact, TwistFollowsTheClamps)
{
  for (Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2})
  {
    Rod rod = rope(41, 0.4, 0.003, 0.0, 1e5);
    rod.inputs.gravity.setZero();
    rod.hold(0, 0);
    rod.hold(40, 40);
    Group g;
    g.addRod(rod);
    touch(g, 3e-4);
    World world = g.world(withIntegrator(integrator), 1e-3);
    for (double turn : {1e-4, 0.01, 0.5})
    {
      g.inputs.rods[0].grasps[1].X_WG.orientation =
          fromRotationVector(Vector3d(turn, 0, 0)) * rod.inputs.grasps[1].X_WG.orientation;
      ASSERT_TRUE(world.step(g.state, g.inputs).ok);
      const RodState& state = g.state.rods[0];
      double twist = state.twist.sum();
      for (const GraspState& grasp : state.grasps)
        twist += grasp.section_twist[0] + grasp.section_twist[1];
      EXPECT_NEAR(twist, turn, 1e-12) << static_cast<int>(integrator);   // round-off of 40 joints
    }
  }
}

TEST(RodContact, CrossingRopesCarryEachOther)
{
  const double radius = 0.003;
  Rod below = rope(31, 0.3, radius, 0.0), above = rope(31, 0.3, radius, 0.02);
  below.hold(0, 0);
  below.hold(30, 30);
  for (int i = 0; i < 31; ++i)
    above.state.x.col(i) = Vector3d(0.15, above.state.x(0, i) - 0.15, 0.02);
  above = Rod(openRod(above.state.x, roundSection(radius, 1e6, 1000.0)), above.state.x);
  Group g;
  g.addRod(below);
  g.addRod(above);
  touch(g, 0.1 * radius, 0.5);
  g.setGravity(Vector3d(0, 0, -9.81));
  World world = g.world(withIntegrator(Integrator::bdf2), 1e-3);
  for (int k = 0; k < 300; ++k)
  {
    const StepReport report = world.step(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    ASSERT_GT(clearance(g), 0.0) << k;
  }
  EXPECT_GT(g.state.rods[1].x.row(2).maxCoeff(), g.state.rods[0].x(2, 15));
}

TEST(RodContact, WhipDoesNotPassAThinObstacle)
{
  // 50 m/s against a capsule of 4 mm: ten edges' length per step
  const double radius = 0.001;
  Group g;
  Rod rod = rope(101, 0.5, radius, 0.0, 1e8);
  rod.state.v.row(2).setConstant(-50.0);
  g.addRod(rod);
  g.addObstacle(Capsule{0.002, 0.4},
                {Vector3d(0.253, 0, -0.3), Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX()))}, 0.2);
  touch(g, 0.2 * radius);
  World world = g.world(withIntegrator(Integrator::implicit_euler), 1e-3);
  for (int k = 0; k < 12; ++k)
  {
    const StepReport report = world.step(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    ASSERT_GT(clearance(g), 0.0) << k;
  }
  // wrapped around it: the middle is held above while the ends go on
  EXPECT_GT(g.state.rods[0].x.row(2).maxCoeff(), -0.31);
  EXPECT_LT(g.state.rods[0].x.row(2).minCoeff(), -0.45);
}

TEST(RodContact, BodyFallsOnRopesAndStaysOnThem)
{
  // a plate across two taut ropes
  const double radius = 0.004;
  Rod left = rope(41, 0.4, radius, 0.0, 1e7), right = left;
  left.model->mass_damping = right.model->mass_damping = 20.0;
  for (Rod* rod : {&left, &right})
  {
    rod->state.x.row(1).setConstant(rod == &left ? -0.03 : 0.03);
    rod->hold(0, 0);
    rod->hold(40, 40);
  }
  Group g;
  g.addRod(left);
  g.addRod(right);
  const int plate =
      g.addBody(bodyOf(0.05, {6e-5, 3e-5, 8e-5}), {Vector3d(0.2, 0, 0.03), Eigen::Quaterniond::Identity()});
  touch(g, 0.1 * radius);
  g.model.bodies[plate].shape = Box{Vector3d(0.06, 0.12, 0.01)};
  World world = g.world(withIntegrator(Integrator::implicit_euler), 1e-3);
  double force = 0.0;
  for (int k = 0; k < 1000; ++k)
  {
    const StepReport report = world.step(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    ASSERT_GT(clearance(g), 0.0) << k;
    force += k < 500 ? 0.0 : contactForce(world, 2) / 500;
  }
  EXPECT_GT(g.state.bodies[0].X_WB.position.z(), -0.1);
  EXPECT_LT(g.state.bodies[0].velocity.linear.norm(), 0.02);
  EXPECT_NEAR(force, -0.05 * 9.81, 0.1 * 0.05 * 9.81);   // on the ropes, which still swing
}

TEST(RodContact, RestartIsBitEqual)
{
  const double radius = 0.004;
  Group g;
  g.addRod(rope(21, 0.4, radius, 0.02));
  g.addObstacle(Plane{}, {});
  touch(g, 0.1 * radius);
  g.state.rods[0].x.row(2) += 0.02 * g.state.rods[0].x.row(0);
  World one = g.world(withIntegrator(Integrator::tr_bdf2), 2e-3);
  for (int k = 0; k < 40; ++k)
    ASSERT_TRUE(one.step(g.state, g.inputs).ok);
  WorldState copy = g.state;
  World other = g.world(withIntegrator(Integrator::tr_bdf2), 2e-3);
  for (int k = 0; k < 40; ++k)
  {
    ASSERT_TRUE(one.step(g.state, g.inputs).ok);
    ASSERT_TRUE(other.step(copy, g.inputs).ok);
    ASSERT_EQ(g.state.rods[0].x, copy.rods[0].x) << k;
  }
}

/// An equilibrium has the contact forces with which it was found.
TEST(RodContact, ForcesAtAnEquilibriumBearTheWeight)
{
  Simulation simulation(parseScene(R"(
time: {step: 0.005, duration: 1}
start: equilibrium
rods:
  - name: rope
    centerline: {straight: {from: [-0.2, 0, 0.2052], to: [0.2, 0, 0.2052], edges: 40}}
    cross_section: {radius: 0.005}
    material: {density: 1100, youngs_modulus: 1.0e7, poissons_ratio: 0.45}
    contact: {friction: 0}
    grasps: {a: {edges: [0]}, b: {edges: [-1]}}
obstacles: [{name: ball, shape: {sphere: {radius: 0.05}}, pose: {position: [0.03, 0, 0.15]}}]
)"));
  const double weight = 1100 * M_PI * 0.005 * 0.005 * 0.4 * 9.81;
  double borne = simulation.world().contactLoads().obstacles[0].force.z() * -1.0;
  for (const Wrench& wrench : simulation.state().wrenches)
    borne -= wrench.force.z();
  EXPECT_NEAR(borne, weight, 1e-5 * weight);
}

}   // namespace
}   // namespace slender::test
