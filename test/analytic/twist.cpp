// Twist: turns counted exactly, torques, loops.
#include <gtest/gtest.h>

#include "test/support/rods.h"

namespace slender::test {
namespace {

TEST(Twist, AThousandTurnsAreCounted)
{
  // beta / B so small that the straight rod stays stable: the torque at 1000 turns is a tenth of what buckles it (8.99
  // B / L).
  const double bend = 1.0, twist = 1e-4, length = 1.0;
  for (Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::generalized_alpha})
  {
    const int n = 14;
    Rod rod = straightRod(n, length, modulusSection(bend, twist, 1e4, 1.0));
    rod.hold(0, 0);
    rod.hold(n - 1, n - 1);
    RodStepper stepper(rod.model, withIntegrator(integrator));
    const double per_step = 2.5;   // rad
    const int steps = static_cast<int>(2000 * M_PI / per_step);
    for (int k = 1; k <= steps; ++k)
    {
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(per_step * k, Vector3d::UnitX()));
      rod.inputs.grasps[1].X_WG.orientation = turn * Eigen::Quaterniond(rod.inputs.grasps[0].X_WG.orientation);
      const StepReport report = stepper.step(rod.state, rod.inputs, 0.01);
      ASSERT_TRUE(report.ok) << report.message;
      if (k % 100 == 0 || k == steps)
      {
        // the frames carry no inertia: at each step the twist is uniform, torque beta angle / L on one gripper and
        // against the other (generalised alpha balances forces 1 / (1 + rho) of the way through the step, and reports
        // that torque)
        const double at = integrator == Integrator::generalized_alpha ? k - 1 + 1 / 1.8 : k;
        const double torque = twist * per_step * at / length;
        EXPECT_NEAR(stepper.wrenches()[1].torque.x(), -torque, 1e-9 * torque) << k;
        EXPECT_NEAR(stepper.wrenches()[0].torque.x(), torque, 1e-9 * torque) << k;
        const double total =
            rod.state.twist.sum() + rod.state.grasps[0].section_twist[1] + rod.state.grasps[1].section_twist[0];
        EXPECT_NEAR(total, per_step * k, 1e-9 * per_step * k);
      }
    }
    // and all the way back: nothing is left
    for (int k = steps - 1; k >= 0; --k)
    {
      rod.inputs.grasps[1].X_WG.orientation =
          Eigen::AngleAxisd(per_step * k, Vector3d::UnitX()) * rod.inputs.grasps[0].X_WG.orientation;
      ASSERT_TRUE(stepper.step(rod.state, rod.inputs, 0.01).ok);
    }
    EXPECT_LT(rod.state.twist.cwiseAbs().maxCoeff(), 1e-9);
    ASSERT_TRUE(stepper.step(rod.state, rod.inputs, 0.01).ok);
    EXPECT_LT(stepper.wrenches()[0].torque.norm(), 1e-12);
  }
}

TEST(Twist, StaticTorqueOfAnUnevenRod)
{
  // Twists of parts in series: sum of (length / beta) torque = angle, with unequal edges and moduli, and a held edge in
  // between.
  const int n = 8;
  Matrix3Xd nodes = Matrix3Xd::Zero(3, n);
  nodes.row(0) << 0.0, 0.1, 0.25, 0.3, 0.5, 0.65, 0.7, 0.9;
  std::vector<RodSection> sections;
  for (int j = 0; j + 1 < n; ++j)
    sections.push_back(modulusSection(1.0, 0.01 * (1 + j % 3), 1e3, 1.0));
  const RodModel model = buildRod("r", nodes, false, sections, Vector3d::Zero(), true);
  Rod rod(model, nodes);
  rod.inputs.gravity.setZero();
  rod.hold(0, 0);
  rod.hold(n - 1, n - 1);
  const double angle = 2.0;
  rod.inputs.grasps[1].X_WG.orientation =
      Eigen::AngleAxisd(angle, Vector3d::UnitX()) * rod.inputs.grasps[1].X_WG.orientation;
  RodStepper stepper(rod.model, TimeConfig{});
  const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
  ASSERT_TRUE(report.ok) << report.message;
  double compliance = 0;
  for (int j = 0; j + 1 < n; ++j)
    compliance += (nodes(0, j + 1) - nodes(0, j)) / sections[j].twist_modulus;
  // The joint's modulus is the mean of its edges' and not their mean compliance: with steps of modulus this is only
  // first order; here 15 %
  EXPECT_NEAR(stepper.wrenches()[0].torque.x() * compliance / angle, 1.0, 0.15);
  EXPECT_NEAR(stepper.wrenches()[0].torque.x() + stepper.wrenches()[1].torque.x(), 0.0, 1e-12);
  EXPECT_LT(stepper.wrenches()[0].force.norm(), 1e-9);
}

TEST(Twist, StaticTurnsAddUp)
{
  // ten static solutions, each almost half a turn on: no turn is lost or gained
  const double twist = 1e-3, turn = 3.1;
  Rod rod = straightRod(21, 1.0, modulusSection(1.0, twist, 1e4, 1.0));
  rod.hold(0, 0);
  rod.hold(20, 20);
  RodStepper stepper(rod.model, TimeConfig{});
  for (int k = 1; k <= 10; ++k)
  {
    rod.inputs.grasps[1].X_WG.orientation =
        Eigen::AngleAxisd(turn * k, Vector3d::UnitX()) * rod.inputs.grasps[0].X_WG.orientation;
    const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_NEAR(stepper.wrenches()[0].torque.x(), twist * turn * k, 1e-9) << k;
  }
}

TEST(Twist, FramesOfAHeldCentrelineJumpOverABend)
{
  // A flat rod pinned along a V and turned at one end: nothing but frames can move. The bend keeps the twist on the
  // turned side, until at 18.1 rad (19.35 for the smooth rod) a whole turn slips over it at once. Every solution must
  // be one.
  const int edges = 48;
  Matrix3Xd nodes = Matrix3Xd::Zero(3, edges + 1);
  for (int j = 0; j < edges; ++j)
  {
    const double a = 0.5 * M_PI * std::min(1.0, std::max(0.0, (j + 0.5 - 22) / 4));
    nodes.col(j + 1) = nodes.col(j) + Vector3d(std::cos(a), 0, std::sin(a)) / edges;
  }
  RodSection flat = modulusSection(1.0, 1.6 / 1.3, 1e6, 1.0);
  flat.bend_modulus(1, 1) = 4.0;
  const RodModel model = buildRod("V", nodes, false, uniformSections(flat, edges), Vector3d::UnitZ(), false);
  Rod rod(model, nodes);
  const RodState laid = makeRodState(model, nodes, Vector3d::UnitZ());
  rod.state.d1 = laid.d1;
  rod.state.twist = laid.twist;
  rod.inputs.gravity.setZero();
  rod.hold(0, 0);
  rod.hold(edges, edges);
  for (int i = 1; i < edges; ++i)
    rod.hold(i, i, false);
  const Eigen::Quaterniond start = rod.inputs.grasps[1].X_WG.orientation;
  TimeConfig time;
  time.newton.max_iterations = 1000;
  RodStepper stepper(rod.model, time);
  double before = 0, jump_at = 0;
  for (int k = 1; k <= 380; ++k)
  {
    rod.inputs.grasps[1].X_WG.orientation = start * Eigen::AngleAxisd(0.05 * k, Vector3d::UnitX());
    const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
    ASSERT_TRUE(report.ok) << report.message;
    ASSERT_LT(report.residual, 1e-6) << 0.05 * k;
    const double clamped = rod.state.grasps[0].section_twist[1] + rod.state.twist.head(edges / 2 + 1).sum();
    if (clamped - before > M_PI)
      jump_at = 0.05 * k;
    before = clamped;
  }
  EXPECT_NEAR(jump_at, 18.1, 0.051);
  EXPECT_NEAR(before, 2 * M_PI, 0.3);
}

TEST(Twist, ATwistedRingPressesOnNothingButItself)
{
  // A planar ring with whole turns of twist: uniform twist 2 pi k / n, torque beta 2 pi k / L, elastic energy (2 pi
  // k)^2 beta / (2 L).
  const int n = 40, turns = 1;
  const double radius = 0.2, bend = 1.0, twist = 0.5;
  const RodModel model = buildRod("ring", ringNodes(n, radius), true,
                                  uniformSections(modulusSection(bend, twist, 1e5, 1.0), n), Vector3d::Zero(), true);
  Rod rod(model, ringNodes(n, radius), 2 * M_PI * turns);
  rod.inputs.gravity.setZero();
  RodStepper stepper(rod.model, withIntegrator(Integrator::implicit_midpoint));
  const double length = model.rest_length.sum();
  const double expected = std::pow(2 * M_PI * turns, 2) * twist / (2 * length);
  EXPECT_NEAR(stepper.energies(rod.state, Vector3d::Zero()).twist, expected, 1e-12 * expected);
  for (int k = 0; k < 50; ++k)
    ASSERT_TRUE(stepper.step(rod.state, rod.inputs, 1e-3).ok);
  // below Zajac's threshold 2 pi sqrt 3 B / beta = 3.5 turns it stays plane and keeps its turns
  EXPECT_LT(rod.state.x.row(2).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(rod.state.twist.sum(), 2 * M_PI * turns, 1e-9);
  EXPECT_NEAR(rod.state.twist.maxCoeff() - rod.state.twist.minCoeff(), 0.0, 1e-8);
}

TEST(Twist, ARingBeyondZajacsThresholdLeavesItsPlane)
{
  // Linking number is what a loop keeps: with beta / B = 2 the threshold is 2 pi sqrt 3 / 2 = 0.87 turns, so one turn
  // must writhe.
  const int n = 40;
  const double radius = 0.2;
  const RodModel model = buildRod("ring", ringNodes(n, radius), true,
                                  uniformSections(modulusSection(1.0, 2.0, 1e5, 1.0), n), Vector3d::Zero(), true);
  Rod rod(model, ringNodes(n, radius), 2 * M_PI);
  rod.inputs.gravity.setZero();
  for (int i = 0; i < n; ++i)
    rod.state.x(2, i) += 1e-4 * std::sin(4 * M_PI * i / n);
  RodStepper stepper(rod.model, withIntegrator(Integrator::implicit_euler));
  for (int k = 0; k < 800; ++k)
  {
    const StepReport report = stepper.step(rod.state, rod.inputs, 0.02);
    ASSERT_TRUE(report.ok) << report.message;
  }
  EXPECT_GT(rod.state.x.row(2).cwiseAbs().maxCoeff(), 0.02);
  EXPECT_LT(rod.state.twist.sum(), 0.95 * 2 * M_PI);   // twist has become writhe
}

}   // namespace
}   // namespace slender::test
