// What a step promises whatever the physics: refusals leave the state alone, equal inputs give equal bits, reasons are
// given.
#include <cstring>
#include <functional>

#include <gtest/gtest.h>

#include "test/support/rods.h"
#include "test/support/special_numbers.h"

namespace slender::test {
namespace {

/// A hanging rope between two grippers, moving, damped: every part of the state is in use.
Rod movingRod(const TimeConfig& time, int warm_steps = 12)
{
  const Matrix3Xd nodes = straightNodes(24, 1.0);
  RodModel model = openRod(nodes, roundSection(0.006, 5e6, 1100));
  model.mass_damping = 0.3;
  model.stiffness_damping = 1e-4;
  model.drag = 0.01 * model.mass;
  Rod rod(model, nodes, 2.0);
  rod.hold(0, 0);
  rod.hold(22, 23);
  rod.hold(9, 9, false);
  RodStepper stepper(rod.model, time);
  for (int k = 0; k < warm_steps; ++k)
    EXPECT_TRUE(stepper.step(rod.state, rod.inputs, time.step).ok);
  rod.inputs.grasps[1].X_WG.position += Vector3d(-0.002, 0.001, 0);
  return rod;
}

TimeConfig configOf(Integrator integrator, double tolerance = 0.0)
{
  TimeConfig time = withIntegrator(integrator);
  time.step = integrator == Integrator::symplectic_euler ? 2e-5 : 2e-3;
  time.error_tolerance = tolerance;
  return time;
}

class EveryIntegrator : public ::testing::TestWithParam<Integrator>
{};

TEST_P(EveryIntegrator, RefusesNonFiniteInputAndKeepsTheState)
{
  const TimeConfig time = configOf(GetParam());
  const Rod rod = movingRod(time);
  const std::vector<std::pair<std::string, std::function<void(Rod&, double)>>> spoils = {
      {"gravity", [](Rod& r, double bad) { r.inputs.gravity[1] = bad; }},
      {"wind", [](Rod& r, double bad) { r.inputs.wind[2] = bad; }},
      {"force",
       [](Rod& r, double bad) {
         r.inputs.forces.setZero(3, 24);
         r.inputs.forces(1, 7) = bad;
       }},
      {"pose of grasp 1", [](Rod& r, double bad) { r.inputs.grasps[1].X_WG.position[0] = bad; }},
      {"pose of grasp 0", [](Rod& r, double bad) { r.inputs.grasps[0].X_WG.orientation.x() = bad; }},
      {"velocity of grasp 0",
       [](Rod& r, double bad) {
         r.inputs.grasps[0].velocity = Twist{Vector3d(0, bad, 0), Vector3d::Zero()};
       }},
      {"velocity of grasp 0",
       [](Rod& r, double bad) {
         r.inputs.grasps[0].velocity = Twist{Vector3d::Zero(), Vector3d(0, bad, 0)};
       }},
      {"state", [](Rod& r, double bad) { r.state.x(1, 3) = bad; }},
      {"state", [](Rod& r, double bad) { r.state.v(1, 3) = bad; }},
      {"state", [](Rod& r, double bad) { r.state.d1(1, 3) = bad; }},
      {"state", [](Rod& r, double bad) { r.state.twist[3] = bad; }},
      {"state", [](Rod& r, double bad) { r.state.grasps[1].X_WG.position[1] = bad; }},
  };
  for (const auto& [name, spoil] : spoils)
    for (double bad : {kNan, kInfinity, -kInfinity})
    {
      Rod spoilt = rod;
      spoil(spoilt, bad);
      RodStepper stepper(spoilt.model, time);
      for (bool statics : {false, true})
      {
        RodState state = spoilt.state;
        const StepReport report =
            statics ? stepper.solveEquilibrium(state, spoilt.inputs) : stepper.step(state, spoilt.inputs, time.step);
        EXPECT_FALSE(report.ok) << name;
        EXPECT_EQ(report.failure, StepFailure::input_not_finite) << name;
        EXPECT_NE(report.message.find(name), std::string::npos) << report.message;
        EXPECT_EQ(0, std::memcmp(state.x.data(), spoilt.state.x.data(), sizeof(double) * state.x.size()));
        EXPECT_EQ(0, std::memcmp(state.v.data(), spoilt.state.v.data(), sizeof(double) * state.v.size()));
      }
    }
}

TEST_P(EveryIntegrator, RefusesWrongCountsAndSteps)
{
  const TimeConfig time = configOf(GetParam());
  const Rod rod = movingRod(time);
  RodStepper stepper(rod.model, time);
  const auto refuses = [&](const RodInputs& inputs, double h) {
    RodState state = rod.state;
    const StepReport report = stepper.step(state, inputs, h);
    EXPECT_FALSE(report.ok);
    EXPECT_FALSE(report.message.empty());
    EXPECT_TRUE(bitEqual(state, rod.state));
  };
  for (double h : {0.0, -1e-3, kNan, kInfinity})
    refuses(rod.inputs, h);
  RodInputs few = rod.inputs;
  few.grasps.pop_back();
  refuses(few, time.step);
  RodInputs forces = rod.inputs;
  forces.forces.setZero(3, 7);
  refuses(forces, time.step);
  Rod short_state = straightRod(23, 1.0, roundSection(0.006, 5e6, 1100));
  short_state.state.grasps = rod.state.grasps;
  const StepReport wrong_rod = stepper.step(short_state.state, rod.inputs, time.step);
  EXPECT_FALSE(wrong_rod.ok);
  EXPECT_NE(wrong_rod.message.find("number of nodes"), std::string::npos);
  RodInputs long_quaternion = rod.inputs;
  long_quaternion.grasps[0].X_WG.orientation.coeffs() *= 1.1;
  refuses(long_quaternion, time.step);
}

TEST_P(EveryIntegrator, RepeatsItselfToTheBit)
{
  for (double tolerance : {0.0, 1e-6})
  {
    const TimeConfig time = configOf(GetParam(), tolerance);
    const Rod start = movingRod(time);
    Rod a = start, b = start;
    RodStepper first(a.model, time), second(b.model, time);
    for (int k = 0; k < 10; ++k)
      for (auto* run : {&a, &b})
      {
        run->inputs.grasps[0].X_WG.position.z() += 1e-4 * k;
        EXPECT_TRUE((run == &a ? first : second).step(run->state, run->inputs, time.step).ok);
      }
    EXPECT_TRUE(bitEqual(a.state, b.state));
    EXPECT_FALSE(bitEqual(a.state, start.state));
    // and the same stepper again from the start, after having been elsewhere
    Rod c = start;
    for (int k = 0; k < 10; ++k)
    {
      c.inputs.grasps[0].X_WG.position.z() += 1e-4 * k;
      first.step(c.state, c.inputs, time.step);
    }
    EXPECT_TRUE(bitEqual(a.state, c.state));
  }
}

TEST_P(EveryIntegrator, ContinuesACopiedStateToTheBit)
{
  for (double tolerance : {0.0, 1e-6})
  {
    const TimeConfig time = configOf(GetParam(), tolerance);
    Rod rod = movingRod(time);
    auto stepper = std::make_unique<RodStepper>(rod.model, time);
    for (int k = 0; k < 12; ++k)
    {
      rod.inputs.grasps[0].X_WG.position.z() += 1e-4 * k;
      RodState copy = rod.state;
      RodStepper fresh(rod.model, time);   // knows nothing but the state
      EXPECT_TRUE(stepper->step(rod.state, rod.inputs, time.step).ok);
      EXPECT_TRUE(fresh.step(copy, rod.inputs, time.step).ok);
      EXPECT_TRUE(bitEqual(rod.state, copy)) << "step " << k << " tolerance " << tolerance;
    }
  }
}

TEST_P(EveryIntegrator, RefusesAFoldedRodWithReason)
{
  const TimeConfig time = configOf(GetParam());
  Rod rod = straightRod(9, 1.0, roundSection(0.005, 1e6, 1000));
  rod.state.x.col(5) = rod.state.x.col(3) + Vector3d(1e-4, 0, 0);   // edges 3 and 4 run back on each other
  const RodState before = rod.state;
  RodStepper stepper(rod.model, time);
  const StepReport report = stepper.step(rod.state, rod.inputs, time.step);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.failure, StepFailure::folded_back);
  EXPECT_NE(report.message.find("opposite"), std::string::npos) << report.message;
  EXPECT_TRUE(bitEqual(rod.state, before));
}

TEST_P(EveryIntegrator, TeleportingGraspIsFollowedOrRefused)
{
  // Everything from a jump of a rod's length to one of a million: done (perhaps in cut steps) or refused with a reason,
  // and finite.
  for (double jump : {0.3, 1.0, 30.0, 1e6})
    for (bool frame : {true, false})
    {
      TimeConfig time = configOf(GetParam());
      Rod rod = straightRod(12, 1.0, roundSection(0.005, 1e6, 1000));
      rod.hold(0, 0, frame);
      RodStepper stepper(rod.model, time);
      stepper.step(rod.state, rod.inputs, time.step);
      const RodState before = rod.state;
      rod.inputs.grasps[0].X_WG.position += jump * Vector3d(-0.3, 0.8, 0.5);
      rod.inputs.grasps[0].X_WG.orientation =
          Eigen::AngleAxisd(3.0, Vector3d(0.2, 0.9, 0.3).normalized()) * rod.inputs.grasps[0].X_WG.orientation;
      const StepReport report = stepper.step(rod.state, rod.inputs, time.step);
      if (report.ok)
      {
        EXPECT_TRUE(rod.state.x.allFinite() && rod.state.v.allFinite() && rod.state.d1.allFinite() &&
                    rod.state.twist.allFinite());
        EXPECT_LT((rod.state.x.col(0) - rod.inputs.grasps[0].X_WG.position).norm(), 1e-12 * jump + 1e-14);
      }
      else
      {
        EXPECT_FALSE(report.message.empty());
        EXPECT_NE(report.failure, StepFailure::none);
        EXPECT_TRUE(bitEqual(rod.state, before)) << jump;
        // the stepper is not spoilt: the grasp back where it was, it goes on
        rod.inputs.grasps[0].X_WG = before.grasps[0].X_WG;
        EXPECT_TRUE(stepper.step(rod.state, rod.inputs, time.step).ok);
      }
    }
}

TEST_P(EveryIntegrator, HeldNodesFollowTheirGraspExactly)
{
  const TimeConfig time = configOf(GetParam());
  Rod rod = movingRod(time, 3);
  RodStepper stepper(rod.model, time);
  const double omega = 3.0;
  for (int k = 0; k < 20; ++k)
  {
    Pose& pose = rod.inputs.grasps[1].X_WG;
    pose.position += time.step * Vector3d(-0.1, 0.2, 0.3);
    pose.orientation = (Eigen::AngleAxisd(omega * time.step, Vector3d::UnitZ()) * pose.orientation).normalized();
    ASSERT_TRUE(stepper.step(rod.state, rod.inputs, time.step).ok);
    const GraspState& g = rod.state.grasps[1];
    EXPECT_EQ(g.X_WG.position, pose.position);
    for (int i = 22; i <= 23; ++i)
    {
      EXPECT_LT((rod.state.x.col(i) - pose * g.nodes_G[i - 22]).norm(), 1e-14);
      // velocity of the rigid motion; uniform inside the step
      const Vector3d v = k == 0 ? Vector3d(rod.state.v.col(i))
                                : Vector3d(Vector3d(-0.1, 0.2, 0.3) +
                                           omega * Vector3d::UnitZ().cross(pose.orientation * g.nodes_G[i - 22]));
      EXPECT_LT((rod.state.v.col(i) - v).norm(), 1e-10);   // quotients of 1e-16 by the step
    }
    EXPECT_LT((rod.state.d1.col(22) - pose.orientation * g.directors_G[0]).norm(), 1e-13);
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryIntegrator, ::testing::ValuesIn(allIntegrators()),
                         [](const auto& info) { return toString(info.param); });

TEST(StepCutting, CutsAndSaysSo)
{
  // One iteration is too few for a large swing: the step is cut until it is enough, or refused when cuts are forbidden.
  TimeConfig time = configOf(Integrator::implicit_euler);
  time.newton.max_iterations = 3;
  Rod rod = straightRod(20, 1.0, roundSection(0.005, 1e6, 1000));
  rod.inputs.gravity = Vector3d(0, 0, -9.81);
  rod.hold(0, 0);
  RodStepper stepper(rod.model, time);
  StepReport total;
  for (int k = 0; k < 5; ++k)
    total.merge(stepper.step(rod.state, rod.inputs, 0.05));
  EXPECT_TRUE(total.ok) << total.message;
  EXPECT_GT(total.cut_steps, 0);
  EXPECT_GT(total.substeps, 5);
  time.newton.max_cuts = 0;
  RodStepper strict(rod.model, time);
  const RodState before = rod.state;
  const StepReport refused = strict.step(rod.state, rod.inputs, 0.2);
  EXPECT_FALSE(refused.ok);
  EXPECT_EQ(refused.failure, StepFailure::newton_diverged);
  EXPECT_NE(refused.message.find("max_iterations"), std::string::npos) << refused.message;
  EXPECT_NE(refused.message.find("rod"), std::string::npos);
  EXPECT_TRUE(bitEqual(rod.state, before));
}

TEST(StepCutting, ExplicitBlowUpIsRefused)
{
  TimeConfig time = configOf(Integrator::symplectic_euler);
  Rod rod = straightRod(20, 1.0, roundSection(0.005, 1e9, 1000));
  rod.inputs.gravity = Vector3d(0, 0, -9.81);
  rod.hold(0, 0);
  RodStepper stepper(rod.model, time);
  StepReport report;
  RodState before = rod.state;
  for (int k = 0; k < 2000 && report.ok; ++k)
  {
    before = rod.state;
    report = stepper.step(rod.state, rod.inputs, 5e-3);   // a thousand times the stable step
  }
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("shorter step"), std::string::npos) << report.message;
  EXPECT_TRUE(bitEqual(rod.state, before));
  EXPECT_TRUE(rod.state.x.allFinite());
}

TEST(StepReport, Merges)
{
  StepReport a, b;
  a.substeps = 1;
  a.residual = 1e-9;
  b.ok = false;
  b.failure = StepFailure::folded_back;
  b.message = "why";
  b.substeps = 2;
  b.iterations = 5;
  b.residual = 1e-8;
  b.stable = false;
  a.merge(b);
  EXPECT_FALSE(a.ok);
  EXPECT_EQ(a.failure, StepFailure::folded_back);
  EXPECT_EQ(a.message, "why");
  EXPECT_EQ(a.substeps, 3);
  EXPECT_EQ(a.iterations, 5);
  EXPECT_EQ(a.residual, 1e-8);
  EXPECT_FALSE(a.stable);
}

}   // namespace
}   // namespace slender::test
