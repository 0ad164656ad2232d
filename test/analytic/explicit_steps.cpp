// Explicit steps: the isotropic formulation, inextensible rods, bodies, and torques handed to them (thesis 4.5, 4.6.1).
#include <gtest/gtest.h>

#include "test/support/groups.h"

namespace slender::test {
namespace {

const Vector3d kNone = Vector3d::Zero();
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
    for (auto& model : g.model.rods)
    {
      auto changed = std::make_shared<RodModel>(*model);
      changed->isotropic = kind.isotropic;
      changed->inextensible = kind.inextensible;
      model = changed;
    }
    RodGroup group(g.model, kExplicit);
    const Vector3d p = g.momentum(), l = g.angularMomentum();
    int iterations = 0;
    double error = 0;
    for (int k = 0; k < 4000; ++k)
    {
      const StepReport report = group.step(g.state, g.inputs, 2e-5);
      ASSERT_TRUE(report.ok) << report.message;
      iterations = std::max(iterations, report.projection_iterations);
      error = std::max(error, report.constraint_error);
    }
    EXPECT_LT((g.momentum() - p).norm(), 1e-11 * p.norm()) << nameOf(kind);
    // Forces and constraints act at the start's positions, so each step keeps it; the general frames' last Newton step leaves little.
    EXPECT_LT((g.angularMomentum() - l).norm(), 1e-9 * l.norm()) << nameOf(kind);
    EXPECT_LE(iterations, kind.inextensible ? 5 : 0);
    EXPECT_LE(error, 1e-8);
    for (const Weld& w : g.model.welds)
    {
      const GraspState& grasp = g.state.rods[w.rod].grasps[w.grasp];
      const Pose expected = g.state.bodies[w.body].X_WB * w.X_BG;
      EXPECT_LT((g.state.rods[w.rod].x.col(grasp.first_node) - expected * grasp.nodes_G[0]).norm(), 1e-12);
    }
  }
}

TEST(ExplicitSteps, TorsionalPendulum)
{
  // T = 2 pi sqrt(J L / beta), as in RigidBodies.TorsionalPendulum: here the torque is handed over explicitly (thesis 4.5.3)
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
    g.weld(0, 10, 10, g.addBody(bodyOf(1.0, {inertia, 0.6 * inertia, 0.6 * inertia}), {Vector3d(length, 0, 0), Eigen::Quaterniond::Identity()}, spin));
    g.setGravity(kNone);
    RodGroup group(g.model, kExplicit);
    const double period = 2 * M_PI * std::sqrt(inertia * length / beta);
    const int per_period = 20000;
    double time = 0, last = 0;
    int found = 0;
    for (int k = 0; k < 2.6 * per_period && found < 3; ++k)
    {
      const double before = g.state.bodies[0].velocity.angular.x();
      const StepReport report = group.step(g.state, g.inputs, period / per_period);
      ASSERT_TRUE(report.ok) << nameOf(kind) << " " << report.message;
      time += period / per_period;
      const double after = g.state.bodies[0].velocity.angular.x();
      if (before > 0 && after <= 0 && ++found)
      {
        const double crossing = time - period / per_period * (1 - before / (before - after));
        if (found > 1)
        {
          EXPECT_NEAR(crossing - last, period, 1e-6 * period) << nameOf(kind);   // (omega h)^2 / 24 = 4e-9, and the general frames' lag
        }
        last = crossing;
      }
    }
    EXPECT_GE(found, 3);
  }
}

TEST(ExplicitSteps, InextensibleRodLosesNoEnergyAndNoLength)
{
  // A rope swinging from one end: constraints do no work, gravity's is given back. The error of the energy is the step's.
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
        ASSERT_NEAR((rod.state.x.col(j + 1) - rod.state.x.col(j)).squaredNorm() / std::pow(rod.model->rest_length[j], 2), 1.0, 1e-8);
      // what changes the momentum is the weight and what the gripper does
      const Vector3d expected = before + h * (rod.model->totalMass() * rod.inputs.gravity - stepper.wrenches()[0].force);
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
    rod.inputs.grasps[1].X_WG.orientation = Eigen::AngleAxisd(angle, Vector3d::UnitX()) * rod.inputs.grasps[0].X_WG.orientation;
    const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
    ASSERT_TRUE(report.ok) << report.message;
    const double total = rod.state.twist.sum() + rod.state.grasps[0].section_twist[1] + rod.state.grasps[1].section_twist[0];
    ASSERT_NEAR(total, angle, 1e-9 * (1 + angle));
  }
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
  rod.inputs.grasps[1].X_WG.orientation = Eigen::AngleAxisd(M_PI, Vector3d::UnitZ()) * rod.inputs.grasps[1].X_WG.orientation;
  const StepReport report = stepper.step(rod.state, rod.inputs, 1e-4);
  EXPECT_FALSE(report.ok);
  EXPECT_FALSE(report.message.empty());
}

TEST(ExplicitSteps, ContactIsRefused)
{
  Group g = tee();
  g.model.contact.rods.push_back({});
  EXPECT_THROW(RodGroup(g.model, kExplicit), std::invalid_argument);
}

}  // namespace
}  // namespace slender::test
