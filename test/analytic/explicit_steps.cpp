// Explicit steps: the isotropic formulation, inextensible rods, bodies, and torques handed to them (thesis 4.5, 4.6.1).
#include <gtest/gtest.h>

#include "slender_sim/geometry/rotation.h"
#include "test/support/groups.h"

namespace slender::test {
namespace {

const TimeConfig kExplicit = withIntegrator(Integrator::symplectic_euler);

struct Kind
{
  bool isotropic, inextensible;
};
const Kind kKinds[] = {{false, false}, {true, false}, {false, true}, {true, true}};

std::string nameOf(const Kind& kind)
{
  return std::string(kind.isotropic ? "isotropic" : "general") + (kind.inextensible ? " projected" : " stiff");
}

TEST(ExplicitSteps, MomentaAreConserved)
{
  for (const Kind& kind : kKinds)
  {
    Group g = tee();
    for (WorldModel::Rod& rod : g.model.rods)
    {
      auto changed = std::make_shared<RodModel>(*rod.model);
      changed->isotropic = kind.isotropic;
      changed->inextensible = kind.inextensible;
      rod.model = changed;
    }
    World world = g.world(kExplicit, 2e-5);
    std::vector<Pose> start;   // of the grasps in the body
    for (const RodState& rod : g.state.rods)
      start.push_back(g.state.bodies[0].X_WB.inverse() * rod.grasps[0].X_WG);
    const Vector3d p = g.momentum(), l = g.angularMomentum();
    int iterations = 0;
    double error = 0;
    for (int k = 0; k < 4000; ++k)
    {
      const StepReport report = world.step(g.state, g.inputs);
      ASSERT_TRUE(report.ok) << report.message;
      iterations = std::max(iterations, report.projection_iterations);
      error = std::max(error, report.constraint_error);
    }
    EXPECT_LT((g.momentum() - p).norm(), 1e-11 * p.norm()) << nameOf(kind);
    // Forces and constraints act at the start's positions, so each step keeps it; the general frames' last Newton step
    // leaves little.
    EXPECT_LT((g.angularMomentum() - l).norm(), 1e-9 * l.norm()) << nameOf(kind);
    EXPECT_LE(iterations, kind.inextensible ? 5 : 0);
    EXPECT_LE(error, 1e-8);
    for (std::size_t r = 0; r < g.state.rods.size(); ++r)
    {
      const GraspState& grasp = g.state.rods[r].grasps[0];
      const Pose expected = g.state.bodies[0].X_WB * start[r];
      EXPECT_LT((g.state.rods[r].x.col(grasp.first_node) - expected * grasp.nodes_G[0]).norm(), 1e-12);
    }
  }
}

TEST(ExplicitSteps, TorsionalPendulum)
{
  // T = 2 pi sqrt(J L / beta), as in RigidBodies.TorsionalPendulum: here the torque is handed over explicitly
  // (thesis 4.5.3)
  for (const Kind& kind : kKinds)
  {
    const double length = 1.0, beta = 2e-3, inertia = 1e-3;
    Rod rod = straightRod(11, length, modulusSection(0.05, beta, 100.0, 1e-2));
    rod.model->isotropic = kind.isotropic;
    rod.model->inextensible = kind.inextensible;
    rod.hold(0, 0);
    Group g;
    g.addRod(rod);
    Twist spin;
    spin.angular << 5.0, 0, 0;   // amplitude 3.5 rad: more than half a turn must be counted
    g.weld(0, 10, 10,
           g.addBody(bodyOf(1.0, {inertia, 0.6 * inertia, 0.6 * inertia}),
                     {Vector3d(length, 0, 0), Eigen::Quaterniond::Identity()}, spin));
    g.setGravity(Vector3d::Zero());
    const double period = 2 * M_PI * std::sqrt(inertia * length / beta);
    const int per_period = 20000;
    World world = g.world(kExplicit, period / per_period);
    double time = 0, last = 0;
    int found = 0;
    for (int k = 0; k < 2.6 * per_period && found < 3; ++k)
    {
      const double before = g.state.bodies[0].velocity.angular.x();
      const StepReport report = world.step(g.state, g.inputs);
      ASSERT_TRUE(report.ok) << nameOf(kind) << " " << report.message;
      time += period / per_period;
      const double after = g.state.bodies[0].velocity.angular.x();
      if (before > 0 && after <= 0 && ++found)
      {
        const double crossing = time - period / per_period * (1 - before / (before - after));
        if (found > 1)
        {
          // (omega h)^2 / 24 = 4e-9, and the general frames' lag
          EXPECT_NEAR(crossing - last, period, 1e-6 * period) << nameOf(kind);
        }
        last = crossing;
      }
    }
    EXPECT_GE(found, 3);
  }
}

TEST(ExplicitSteps, InextensibleRodLosesNoEnergyAndNoLength)
{
  // A rope swinging from one end: constraints do no work, gravity's is given back. The error of the energy is the
  // step's.
  double drift[2];
  for (int fine = 0; fine < 2; ++fine)
  {
    Rod rod = straightRod(31, 1.0, modulusSection(1e-4, 1e-4, 1.0, 0.1));
    rod.model->isotropic = rod.model->inextensible = true;
    rod.inputs.gravity << 0, 0, -9.81;
    rod.hold(0, 0, false);
    RodStepper stepper(rod.model, kExplicit);
    const double start = stepper.energies(rod.state, rod.inputs.gravity).total();
    const double h = fine ? 2.5e-4 : 5e-4;
    drift[fine] = 0;
    for (int k = 0; k < 1.0 / h; ++k)
    {
      const Vector3d before = rod.momentum();
      const StepReport report = stepper.step(rod.state, rod.inputs, h);
      ASSERT_TRUE(report.ok) << report.message;
      ASSERT_LE(report.projection_iterations, 5);
      for (int j = 0; j < rod.model->edges(); ++j)
        ASSERT_NEAR(
            (rod.state.x.col(j + 1) - rod.state.x.col(j)).squaredNorm() / std::pow(rod.model->rest_length[j], 2), 1.0,
            1e-8);
      // what changes the momentum is the weight and what the gripper does
      const Vector3d expected =
          before + h * (rod.model->totalMass() * rod.inputs.gravity - stepper.wrenches()[0].force);
      ASSERT_LT((rod.momentum() - expected).norm(), 1e-12);
      drift[fine] = std::max(drift[fine], std::abs(stepper.energies(rod.state, rod.inputs.gravity).total() - start));
    }
    EXPECT_LT(drift[fine], 0.02 * rod.weight());   // of 1/2 L of fall
  }
  EXPECT_LT(drift[1], 0.65 * drift[0]);
}

TEST(ExplicitSteps, TurnsAreCounted)
{
  // beta / B so small that the straight rod stays stable (see Twist.AThousandTurnsAreCounted)
  Rod rod = straightRod(50, 1.0, modulusSection(1e-2, 1e-6, 1.0, 1.0));
  rod.model->isotropic = true;
  rod.hold(0, 0);
  rod.hold(49, 49);
  RodStepper stepper(rod.model, kExplicit);
  for (int k = 1; k <= 2500; ++k)
  {
    const double angle = 2.5 * (k <= 1250 ? k : 2500 - k);
    rod.inputs.grasps[1].X_WG.orientation =
        Eigen::AngleAxisd(angle, Vector3d::UnitX()) * rod.inputs.grasps[0].X_WG.orientation;
    const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
    ASSERT_TRUE(report.ok) << report.message;
    const double total =
        rod.state.twist.sum() + rod.state.grasps[0].section_twist[1] + rod.state.grasps[1].section_twist[0];
    ASSERT_NEAR(total, angle, 1e-9 * (1 + angle));
  }
}

TEST(ExplicitSteps, AReleasedPartKeepsItsTurns)
{
  // An edge inside the rod is turned and let go: what twists on one side of it cancels what twists on the other.
  for (const Kind& kind : kKinds)
  {
    Rod rod = straightRod(31, 1.0, modulusSection(1e-2, 1e-6, 10.0, 1.0));
    rod.model->isotropic = kind.isotropic;
    rod.model->inextensible = kind.inextensible;
    rod.hold(0, 0);
    rod.hold(30, 30);
    rod.hold(3, 4);
    RodStepper stepper(rod.model, kExplicit);
    for (int k = 1; k <= 400; ++k)
    {
      rod.inputs.grasps[2].X_WG.orientation =
          Eigen::AngleAxisd(16 * M_PI * k / 400, Vector3d::UnitX()) * rod.inputs.grasps[0].X_WG.orientation;
      const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
      ASSERT_TRUE(report.ok) << nameOf(kind) << " " << report.message;
    }
    rod.state.grasps[2].active = false;
    rod.state.forgetHistory();
    const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
    ASSERT_TRUE(report.ok) << nameOf(kind) << " " << report.message;
    const double total =
        rod.state.twist.sum() + rod.state.grasps[0].section_twist[1] + rod.state.grasps[1].section_twist[0];
    EXPECT_NEAR(total, 0.0, 1e-9) << nameOf(kind);
  }
}

TEST(ExplicitSteps, ARodHeldEverywhereKeepsItsTwists)
{
  const Matrix3Xd nodes = straightNodes(12, 1.0);
  Rod rod(openRod(nodes, modulusSection(1e-2, 1e-6, 10.0, 1.0)), nodes, 20.0);
  rod.model->isotropic = true;
  rod.hold(0, 11);
  const Eigen::VectorXd twist = rod.state.twist;
  RodStepper stepper(rod.model, kExplicit);
  ASSERT_TRUE(stepper.step(rod.state, rod.inputs, 1e-4).ok);
  EXPECT_LT((rod.state.twist - twist).norm(), 1e-12);
}

TEST(ExplicitSteps, NodesAtOnePlaceAreRefused)
{
  // two pins are told to go to the same place: the edge between them has no tangent
  for (const Kind& kind : kKinds)
  {
    Rod rod = straightRod(11, 1.0, modulusSection(1e-4, 1e-4, 10.0, 0.1));
    rod.model->isotropic = kind.isotropic;
    rod.model->inextensible = kind.inextensible;
    rod.hold(3, 3, false);
    rod.hold(4, 4, false);
    rod.inputs.grasps[1].X_WG.position = rod.inputs.grasps[0].X_WG.position;
    RodStepper stepper(rod.model, kExplicit);
    const RodState before = rod.state;
    const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
    EXPECT_FALSE(report.ok) << nameOf(kind);
    EXPECT_FALSE(report.message.empty()) << nameOf(kind);
    EXPECT_TRUE(bitEqual(before, rod.state)) << nameOf(kind);
  }
}

TEST(ExplicitSteps, EnergiesAreThoseOfTheFormulation)
{
  // Eight turns on a coil of 40 nodes: the general formulation's mean curvature would lose a third of the bending
  // energy.
  const Matrix3Xd nodes = helixNodes(40, 0.1, 0.3, 3);
  Rod rod(openRod(nodes, modulusSection(1.345, 0.789, 1e4, 1.0), true), nodes);
  rod.model->isotropic = true;
  rod.inputs.gravity.setZero();
  rod.hold(0, 0);
  rod.hold(39, 39);
  rod.state.grasps[0].section_twist[1] += 16 * M_PI;
  RodStepper stepper(rod.model, kExplicit);
  double start = 0;
  for (int k = 0; k < 10000; ++k)
  {
    ASSERT_TRUE(stepper.step(rod.state, rod.inputs, 1e-5).ok);
    if (k == 0)
      start = stepper.energies(rod.state, Vector3d::Zero()).total();
  }
  const RodEnergies end = stepper.energies(rod.state, Vector3d::Zero());
  EXPECT_GT(end.kinetic, 0.05 * start);            // twist has become motion
  EXPECT_NEAR(end.total(), start, 5e-4 * start);   // symplectic: swings by about omega h; measured 7e-5
}

/// A body under a hanging rod that is `stretch` times as long as at rest.
Group pendulum(const Kind& kind, int nodes, double stretch)
{
  const double length = 0.5;
  const Matrix3Xd rest = straightNodes(nodes, length, Vector3d::Zero(), -Vector3d::UnitZ());
  Rod rod(openRod(rest, modulusSection(1e-4, 1e-4, 100.0, 0.01)), Matrix3Xd(stretch * rest));
  rod.model->isotropic = kind.isotropic;
  rod.model->inextensible = true;
  rod.hold(0, 0);
  Group g;
  g.addRod(rod);
  g.weld(0, nodes - 1, nodes - 1,
         g.addBody(bodyOf(0.1, {1e-4, 2e-4, 2e-4}),
                   {Vector3d(0, 0, -stretch * length - 0.02), Eigen::Quaterniond::Identity()}));
  g.setGravity({0, 0, -9.81});
  return g;
}

TEST(ExplicitSteps, AStraightRodCarriesItsBody)
{
  for (const Kind& kind : {kKinds[2], kKinds[3]})
    for (int nodes : {3, 4, 5, 21})
    {
      Group g = pendulum(kind, nodes, 1.0);
      World world = g.world(kExplicit, 1e-4);
      for (int k = 0; k < 200; ++k)
      {
        const StepReport report = world.step(g.state, g.inputs);
        ASSERT_TRUE(report.ok) << nameOf(kind) << " " << nodes << " " << report.message;
      }
      EXPECT_NEAR(world.rodWrenches(0)[0].force.z(), -9.81 * (0.1 + 0.005), 1e-8) << nameOf(kind) << " " << nodes;
      EXPECT_NEAR(g.state.bodies[0].X_WB.position.z(), -0.52, 1e-9);
    }
}

TEST(ExplicitSteps, ABodyUnderAStretchedRodStartsWhereItCanHang)
{
  for (const Kind& kind : {kKinds[2], kKinds[3]})
  {
    Group g = pendulum(kind, 21, 1.01);
    World world = g.world(kExplicit, 1e-4);
    const StepReport report = world.step(g.state, g.inputs);
    ASSERT_TRUE(report.ok) << nameOf(kind) << " " << report.message;
    EXPECT_NEAR(g.state.bodies[0].X_WB.position.z(), -0.52, 1e-8);
    // not thrown with 50 m/s: what is left is the projection's tolerance over the step
    EXPECT_LT(g.state.bodies[0].velocity.linear.norm(), 0.5 * 1e-8 / 1e-4);
    EXPECT_LT(g.state.rods[0].v.colwise().norm().maxCoeff(), 0.5 * 1e-8 / 1e-4);
  }
}

TEST(ExplicitSteps, LoadsAndDampingOfBodiesAreThoseOfImplicitSteps)
{
  // the same motion, to first order in the step: half the step, half the difference
  Group start = tee();
  RigidBodyModel& body = start.model.bodies[0].body;
  body.force << 0.1, 0.2, -0.1;
  body.torque << 1e-3, -2e-3, 1e-3;
  body.linear_damping = 5;
  body.angular_damping = 10;
  start.setGravity({1, 2, -9.81});
  for (std::size_t r = 0; r < start.model.rods.size(); ++r)
  {
    auto changed = std::make_shared<RodModel>(*start.model.rods[r].model);
    changed->drag.setConstant(changed->nodes(), 0.01);
    changed->mass_damping = 1;
    start.model.rods[r].model = changed;
    start.inputs.rods[r].wind << 3, 0, 0;
  }
  const auto run = [&](Integrator integrator, double h) {
    Group g = start;
    World world = g.world(withIntegrator(integrator), h);
    for (int k = 0; k < std::lround(0.02 / h); ++k)
      EXPECT_TRUE(world.step(g.state, g.inputs).ok);
    return g.state.bodies[0].X_WB;
  };
  const Pose exact = run(Integrator::implicit_midpoint, 4e-5), a = run(Integrator::symplectic_euler, 2e-5),
             b = run(Integrator::symplectic_euler, 1e-5);
  EXPECT_LT((b.position - exact.position).norm(), 4e-6);
  EXPECT_LT(rotationVector(b.orientation * exact.orientation.conjugate()).norm(), 2e-5);
  EXPECT_LT((2 * b.position - a.position - exact.position).norm(), 0.02 * (a.position - exact.position).norm());
}

TEST(ExplicitSteps, GroupsGoOnBitByBit)
{
  Group g = tee();
  for (WorldModel::Rod& rod : g.model.rods)
  {
    auto changed = std::make_shared<RodModel>(*rod.model);
    changed->inextensible = true;
    rod.model = changed;
  }
  const int far =
      g.addBody(bodyOf(0.01, {2e-6, 3e-6, 4e-6}), {Vector3d(g.state.rods[0].x.col(8)), Eigen::Quaterniond::Identity()});
  g.weld(0, 8, 8, far);
  World world = g.world(kExplicit, 2e-5);
  for (int k = 0; k < 2000; ++k)
    ASSERT_TRUE(world.step(g.state, g.inputs).ok);
  Group other = g;
  World fresh = other.world(kExplicit, 2e-5);
  for (int k = 0; k < 300; ++k)
  {
    ASSERT_TRUE(world.step(g.state, g.inputs).ok);
    ASSERT_TRUE(fresh.step(other.state, other.inputs).ok);
  }
  for (std::size_t r = 0; r < g.state.rods.size(); ++r)
    EXPECT_TRUE(bitEqual(g.state.rods[r], other.state.rods[r])) << r;
  for (std::size_t b = 0; b < g.state.bodies.size(); ++b)
    EXPECT_EQ(g.state.bodies[b].X_WB.orientation.coeffs(), other.state.bodies[b].X_WB.orientation.coeffs()) << b;
}

TEST(ExplicitSteps, ImpossibleGraspsAreNamed)
{
  Rod rod = straightRod(21, 1.0, modulusSection(1e-4, 1e-4, 1.0, 0.1));
  rod.model->inextensible = true;
  rod.hold(3, 3, false);
  rod.hold(17, 17, false);
  RodStepper stepper(rod.model, kExplicit);
  rod.inputs.grasps[1].X_WG.position.x() += 1e-3;
  const RodState before = rod.state;
  const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.failure, StepFailure::overstretched);
  EXPECT_NE(report.message.find("nodes 3 and 17"), std::string::npos) << report.message;
  EXPECT_TRUE(bitEqual(before, rod.state));
}

TEST(ExplicitSteps, TwistThatCannotBeCountedIsRefused)
{
  Rod rod = straightRod(21, 1.0, modulusSection(1e-4, 1e-4, 1.0, 0.1));
  rod.model->isotropic = true;
  rod.hold(0, 0);
  rod.hold(20, 20);
  RodStepper stepper(rod.model, kExplicit);
  // the section turns about an axis across the rod and back: its frame comes back turned by half a turn about the rod
  rod.inputs.grasps[1].X_WG.orientation =
      Eigen::AngleAxisd(M_PI, Vector3d::UnitZ()) * rod.inputs.grasps[1].X_WG.orientation;
  const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
  EXPECT_FALSE(report.ok);
  EXPECT_FALSE(report.message.empty());
}

TEST(ExplicitSteps, ContactIsRefused)
{
  Group g = tee();
  g.model.rods[0].contact.emplace();
  EXPECT_THROW(g.world(kExplicit, 1e-4), std::invalid_argument);

  Group ball;
  ball.addBody(bodyOf(1.0, {1e-3, 1e-3, 1e-3}), {});
  ball.model.bodies[0].shape = Sphere{0.1};
  ball.model.contact.gap = 1e-3;
  EXPECT_NO_THROW(World(ball.model, ball.state));
  ball.model.time = kExplicit;
  EXPECT_NO_THROW(World(ball.model, ball.state));   // it meets nothing
  ball.addObstacle(Plane{}, {Vector3d(0, 0, -1), Eigen::Quaterniond::Identity()});
  EXPECT_THROW(World(ball.model, ball.state), std::invalid_argument);
}

/// Rods and bodies that no weld joins do not change each other's projection.
TEST(ExplicitSteps, BystandersChangeNothing)
{
  Group g[2] = {tee(), tee()};
  Rod rod = straightRod(11, 1.0, modulusSection(1e-4, 1e-4, 10.0, 0.1));
  Twist spin;
  spin.angular << 30, 20, 10;
  const int far = g[1].addRod(rod);
  g[1].weld(far, 10, 10,
            g[1].addBody(bodyOf(0.1, {1e-4, 1e-4, 2e-4}), {rod.state.x.col(10), Eigen::Quaterniond::Identity()}, spin));
  for (Group& group : g)
  {
    for (WorldModel::Rod& changed : group.model.rods)
    {
      auto model = std::make_shared<RodModel>(*changed.model);
      model->inextensible = true;
      changed.model = model;
    }
    World world = group.world(kExplicit, 2e-5);
    for (int k = 0; k < 500; ++k)
    {
      const StepReport report = world.step(group.state, group.inputs);
      ASSERT_TRUE(report.ok) << report.message;
    }
  }
  for (std::size_t r = 0; r < g[0].state.rods.size(); ++r)
    EXPECT_TRUE(bitEqual(g[0].state.rods[r], g[1].state.rods[r])) << r;
}

}   // namespace
}   // namespace slender::test
