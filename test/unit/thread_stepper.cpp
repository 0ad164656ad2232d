#include <cmath>

#include <gtest/gtest.h>

#include "test/support/threads.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

Thread pouring(double height)
{
  ThreadModel m = honey();
  m.floor.present = true;
  Thread t = Thread::fromNozzle(m, {0, 0, height}, 0.1);
  t.state.x[0] += Vector3d(2e-4, 1e-4, 0);   // a perfectly straight thread would stand on the floor as a column
  return t;
}

double volumeDrift(const Thread& t, double start)
{
  return (t.state.totalVolume() + t.state.dropped_volume + t.state.left_volume - t.state.fed_volume) / start - 1;
}

TEST(ThreadStepper, AModelThatIsNotValidIsRefused)
{
  const auto refused = [](auto change, const std::string& name) {
    ThreadModel m = honey();
    change(m);
    try
    {
      ThreadStepper(std::make_shared<ThreadModel>(m), NewtonConfig{});
    }
    catch (const std::invalid_argument& e)
    {
      return std::string(e.what()).find(name) != std::string::npos;
    }
    return false;
  };
  EXPECT_TRUE(refused([](ThreadModel& m) { m.viscosity = 0; }, "viscosity"));
  EXPECT_TRUE(refused([](ThreadModel& m) { m.density = -1; }, "density"));
  EXPECT_TRUE(refused([](ThreadModel& m) { m.surface_tension = std::nan(""); }, "surface_tension"));
  EXPECT_TRUE(refused([](ThreadModel& m) { m.feed_length = 0; }, "feed_length"));
  EXPECT_TRUE(
      refused([](ThreadModel& m) { m.limits.min_edge_length = 1, m.limits.max_edge_length = 2; }, "min_edge_length"));
}

TEST(ThreadStepper, BadInputsAreRefusedAndTheStateStays)
{
  Thread t = pouring(0.1);
  ThreadStepper stepper = t.stepper();
  for (int k = 0; k < 20; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
  const ThreadState before = t.state;
  const auto refused = [&](const ThreadInputs& inputs, double h) {
    const StepReport r = stepper.step(t.state, inputs, h);
    return !r.ok && r.failure == StepFailure::input_not_finite && !r.message.empty() && sameThread(t.state, before);
  };
  ThreadInputs bad = t.inputs;
  bad.flow_rate = -1;
  EXPECT_TRUE(refused(bad, 0.01));
  bad = t.inputs;
  bad.belt_velocity.x() = std::nan("");
  EXPECT_TRUE(refused(bad, 0.01));
  bad = t.inputs;
  bad.ends[1].orientation.coeffs() *= 2;
  EXPECT_TRUE(refused(bad, 0.01));
  EXPECT_TRUE(refused(t.inputs, 0.0));
  EXPECT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
}

TEST(ThreadStepper, AFailedStepLeavesTheState)
{
  Thread t = pouring(0.1);
  NewtonConfig newton;
  newton.max_iterations = 1;
  newton.max_cuts = 0;
  ThreadStepper stepper(std::make_shared<ThreadModel>(t.model), newton);
  const ThreadState before = t.state;
  const StepReport r = stepper.step(t.state, t.inputs, 0.02);
  EXPECT_FALSE(r.ok);
  EXPECT_EQ(r.failure, StepFailure::newton_diverged);
  EXPECT_NE(r.message.find("honey"), std::string::npos);
  EXPECT_TRUE(sameThread(t.state, before));
}

TEST(ThreadStepper, ExplicitAndImplicitStepsAgree)
{
  Thread t = pouring(0.05);
  t.model.viscosity = 2;
  t.model.surface_tension = 0.05;
  Thread u = t;
  ThreadStepper implicit = t.stepper(),
                explicitly(std::make_shared<ThreadModel>(t.model), NewtonConfig{}, Integrator::symplectic_euler);
  for (int k = 0; k < 3000; ++k)   // the thread has reached the floor
  {
    ASSERT_TRUE(implicit.step(t.state, t.inputs, 5e-5).ok);
    ASSERT_TRUE(explicitly.step(u.state, u.inputs, 5e-5).ok) << k;
  }
  ASSERT_EQ(t.state.nodes(), u.state.nodes());
  EXPECT_GT(t.state.deposited[0], 0);
  for (int i = 0; i < t.state.nodes(); ++i)
    EXPECT_LT((t.state.x[i] - u.state.x[i]).norm(), 1e-4) << i;
  // far too long a step is refused, and nothing has happened
  StepReport report;
  for (int k = 0; k < 2000 && report.ok; ++k)
  {
    const ThreadState last = u.state;
    report = explicitly.step(u.state, u.inputs, 2e-3);
    EXPECT_TRUE(report.ok || sameThread(u.state, last));
  }
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("implicit_euler"), std::string::npos);
  EXPECT_THROW(ThreadStepper(std::make_shared<ThreadModel>(t.model), NewtonConfig{}, Integrator::bdf2),
               std::invalid_argument);
}

TEST(ThreadStepper, AThreadFallsFreely)
{
  Random random(1);
  Thread t{honey(), wigglyThread(12, random), {}};
  for (auto& v : t.state.v)
    v.setZero();
  ThreadStepper stepper = t.stepper();
  const Vector3d momentum = momentumOf(t.state);
  for (int k = 0; k < 10; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
  EXPECT_LT((momentumOf(t.state) - momentum - 0.1 * t.state.totalVolume() * t.inputs.gravity).norm(),
            1e-9 * t.state.totalVolume());
}

TEST(ThreadStepper, ASolidMotionMeetsNoResistance)
{
  // translation is kept exactly; viscosity must not brake it
  Random random(2);
  Thread t{honey(), wigglyThread(12, random), {}};
  t.model.viscosity = 1e6;
  for (auto& v : t.state.v)
    v = {1, -2, 0.5};
  t.inputs.gravity.setZero();
  ThreadStepper stepper = t.stepper();
  const std::vector<Vector3d> start = t.state.x;
  for (int k = 0; k < 5; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.1).ok);
  for (int i = 0; i < t.state.nodes(); ++i)
    EXPECT_LT((t.state.x[i] - start[i] - 0.5 * Vector3d(1, -2, 0.5)).norm(), 1e-7);
}

TEST(ThreadStepper, TheNozzleFeedsAPlug)
{
  // without gravity what leaves the nozzle is a straight thread as thick as the nozzle and as long as what came out
  Thread t = Thread::fromNozzle(honey(), {0, 0, 1}, 0.1);
  t.inputs.gravity.setZero();
  ThreadStepper stepper = t.stepper();
  const double start = t.state.totalVolume();
  for (int k = 0; k < 73; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.03).ok);
  EXPECT_LT(std::abs(volumeDrift(t, start)), 1e-13);
  EXPECT_NEAR(t.state.fed_volume, t.inputs.flow_rate * 73 * 0.03, 1e-15);
  EXPECT_NEAR(t.state.x.front().z(), 1 - 0.005 - 0.1 * 73 * 0.03, 1e-7);
  for (int j = 0; j < t.state.edges(); ++j)
    EXPECT_NEAR(t.state.radius(j), 0.005, 1e-8);
  EXPECT_GT(t.state.nodes(), 20);
  for (int i = 1; i < t.state.nodes(); ++i)
    // the node at the nozzle came first of all
    EXPECT_EQ(t.state.id[i] > t.state.id[i - 1], i + 1 < t.state.nodes()) << i;
}

TEST(ThreadStepper, AStepMayFeedManyEdges)
{
  Thread t = Thread::fromNozzle(honey(), {0, 0, 1}, 0.1);
  ThreadStepper stepper = t.stepper();
  const double start = t.state.totalVolume();
  const StepReport report = stepper.step(t.state, t.inputs, 0.5);   // five edges
  ASSERT_TRUE(report.ok);
  EXPECT_EQ(report.substeps, 5);
  EXPECT_GE(t.state.edges(), 5);
  EXPECT_LT(std::abs(volumeDrift(t, start)), 1e-13);
}

TEST(ThreadStepper, AFlowOfMoreEdgesThanAStepCanFeedIsRefused)
{
  Thread t = pouring(0.1);
  ThreadStepper stepper = t.stepper();
  const ThreadState before = t.state;
  for (const double speed : {1e7, 1e20, 1e300})
  {
    t.inputs.flow_rate = speed * t.model.nozzleArea();
    const StepReport report = stepper.step(t.state, t.inputs, 0.01);
    EXPECT_EQ(report.failure, StepFailure::input_not_finite);
    EXPECT_NE(report.message.find("flow rate"), std::string::npos) << report.message;
    EXPECT_TRUE(sameThread(t.state, before));
  }
}

TEST(ThreadStepper, AMotionThatDrawsTheThreadOutBeyondAllMeasureIsRefused)
{
  Thread t = pouring(0.1);
  t.model.limits.max_edge_length = 0.015;
  ThreadStepper stepper = t.stepper();
  for (int k = 0; k < 150; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
  ASSERT_TRUE(t.state.deposited[0]);
  const ThreadState before = t.state;
  const auto refused = [&](const ThreadInputs& inputs) {
    const StepReport r = stepper.step(t.state, inputs, 0.01);
    return !r.ok && r.message.find("max_edge_length") != std::string::npos && sameThread(t.state, before);
  };
  ThreadInputs far = t.inputs;
  far.ends[1].position.x() = 1e4;   // m, where a slip of the pen may put it
  EXPECT_TRUE(refused(far));
  far = t.inputs;
  far.belt_velocity.x() = 1e6;
  EXPECT_TRUE(refused(far));
  EXPECT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
}

TEST(ThreadStepper, AThreadThatIsDrawnOutKeepsItsAngularMomentum)
{
  // spinning about its axis while its ends fly apart: like a skater who draws in the arms
  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, 11);
  x.row(0) = Eigen::RowVectorXd::LinSpaced(11, -0.5, 0.5);
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::symplectic_euler})
  {
    Thread t{honey(), makeThread(x, Eigen::VectorXd::Constant(10, 0.05)), {}};
    t.model.viscosity = 1e-3;
    t.model.nozzle_diameter = 0.0;
    t.model.limits.max_edge_length = 0.12;
    t.inputs.gravity.setZero();
    const auto momentum = [&] {
      double sum = 0.0;
      for (int j = 0; j < t.state.edges(); ++j)
        sum += 0.5 * t.state.volume[j] * t.state.radius(j) * t.state.radius(j) * t.state.spin[j];
      return sum;
    };
    for (int i = 0; i < 11; ++i)
      t.state.v[i].x() = t.state.x[i].x();
    for (double& spin : t.state.spin)
      spin = 2.0;
    const double start = momentum();
    ThreadStepper stepper(std::make_shared<ThreadModel>(t.model), NewtonConfig{}, integrator);
    for (int k = 0; k < 100; ++k)
      ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok) << k;
    ASSERT_GT(t.state.edges(), 10);   // divided on its way
    EXPECT_NEAR(t.state.edge(5).norm() * (t.state.edges() / 10.0), 0.2, 0.05);
    EXPECT_NEAR(momentum(), start, 1e-6 * start);
    EXPECT_NEAR(t.state.spin[3], 4.0, 0.05);
  }
}

TEST(ThreadStepper, TheFlowMayStopAndTheNozzleMove)
{
  Thread t = pouring(0.2);
  ThreadStepper stepper = t.stepper();
  const double start = t.state.totalVolume();
  for (int k = 0; k < 200; ++k)
  {
    t.inputs.flow_rate = k % 50 < 25 ? 0.1 * t.model.nozzleArea() : 0.0;
    t.inputs.ends[1].position = {0.05 * std::sin(0.1 * k), 0.05 * std::sin(0.07 * k), 0.2};
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok) << k;
    EXPECT_EQ(t.state.x.back(), t.inputs.ends[1].position);
  }
  EXPECT_LT(std::abs(volumeDrift(t, start)), 1e-13);
}

/// Lying neighbours hold the node between them up. It is deposited when it is nearer to the floor than a small share of
/// the radius, and not before.
TEST(ThreadStepper, ANodeBetweenTwoThatLieIsDeposited)
{
  const double radius = 0.002;
  for (const double above : {0.02 * radius, 0.5 * radius})
  {
    ThreadModel m = honey();
    m.floor.present = true;
    Eigen::Matrix3Xd x(3, 4);
    x << 0, 0.01, 0.02, 0.03, 0, 0, 0, 0, radius, radius + above, radius, 0.01;
    Thread t{m, makeThread(x, Eigen::Vector3d::Constant(radius)), {}};
    t.state.deposited = {1, 0, 1, 0};
    t.inputs.gravity.setZero();
    t.inputs.belt_velocity = {0.1, 0, 0};
    ThreadStepper stepper(std::make_shared<ThreadModel>(m), NewtonConfig{});
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 1e-4).ok);
    EXPECT_EQ(static_cast<bool>(t.state.deposited[1]), above < 0.05 * radius) << above;
    EXPECT_NEAR(t.state.x[1].z(), radius + above, 0.05 * above) << above;
    if (t.state.deposited[1])
      EXPECT_EQ(t.state.v[1], t.inputs.belt_velocity);
  }
}

/// The same for an arch of several nodes. It is deposited as a whole. A part that hangs from the nozzle is no arch.
TEST(ThreadStepper, AnArchBetweenTwoThatLieIsDeposited)
{
  const double radius = 0.002, low = 0.02 * radius;
  for (const double middle : {0.03 * radius, 0.5 * radius})
    for (const bool arch : {true, false})
    {
      ThreadModel m = honey();
      m.floor.present = true;
      Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, 7);
      x.row(0).setLinSpaced(0, 0.06);
      x.row(2) << radius, radius + low, radius + middle, radius + low, radius, radius + low, 0.01;
      Thread t{m, makeThread(x, Eigen::VectorXd::Constant(6, radius)), {}};
      t.state.deposited = {1, 0, 0, 0, static_cast<char>(arch), 0, 0};
      t.state.x[4].z() += arch ? 0.0 : low;
      t.inputs.gravity.setZero();
      t.inputs.belt_velocity = {0.1, 0, 0};
      ThreadStepper stepper(std::make_shared<ThreadModel>(m), NewtonConfig{});
      ASSERT_TRUE(stepper.step(t.state, t.inputs, 1e-4).ok);
      for (int i = 1; i < 4; ++i)
      {
        EXPECT_EQ(static_cast<bool>(t.state.deposited[i]), arch && middle < 0.05 * radius) << i;
        EXPECT_NEAR(t.state.x[i].z(), x(2, i), 0.1 * middle) << i;
        if (t.state.deposited[i])
          EXPECT_EQ(t.state.v[i], t.inputs.belt_velocity) << i;
      }
      EXPECT_FALSE(t.state.deposited[5]);
    }
}

TEST(ThreadStepper, WhatTouchesTheFloorStaysThere)
{
  Thread t = pouring(0.1);
  ThreadStepper stepper = t.stepper();
  for (int k = 0; k < 300; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
  ASSERT_GT(t.state.nodes(), 30);
  int deposited = 0;
  for (int i = 0; i < t.state.nodes(); ++i)
  {
    deposited += t.state.deposited[i];
    EXPECT_GT(t.state.x[i].z(), -1e-3);
  }
  EXPECT_GT(deposited, 10);
  const Vector3d there = t.state.x.front();
  for (int k = 0; k < 100; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
  EXPECT_EQ(t.state.x.front(), there);
}

TEST(ThreadStepper, TheBeltCarriesTheThreadAway)
{
  Thread t = pouring(0.1);
  t.model.limits.scene.max().x() = 1.0;   // the belt's end
  ThreadStepper stepper = t.stepper();
  const double start = t.state.totalVolume();
  t.inputs.belt_velocity = {2.0, 0, 0};
  std::size_t most = 0;
  for (int k = 0; k < 1500; ++k)
  {
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok) << k;
    most = std::max(most, t.state.x.size());
    EXPECT_LT(t.state.x.front().x(), 1.0);
  }
  EXPECT_LT(most, 200u);
  EXPECT_GT(t.state.left_volume, t.state.totalVolume());
  EXPECT_LT(std::abs(volumeDrift(t, start)), 1e-11);
  EXPECT_GT(t.state.id.front(), 50u);
  // laid down faster than it falls, it lies straight
  EXPECT_NEAR(t.state.x.front().y(), 0.0, 1e-4);
}

TEST(ThreadStepper, LongEdgesAreDivided)
{
  Thread t = Thread::fromNozzle(honey(), {0, 0, 1}, 0.05);
  t.model.limits.max_edge_length = 0.015;
  ThreadStepper stepper = t.stepper();
  const double start = t.state.totalVolume();
  for (int k = 0; k < 60; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok);
  EXPECT_LT(t.state.x.front().z(), 0.9);
  for (int j = 0; j < t.state.edges(); ++j)
    EXPECT_LE(t.state.edge(j).norm(), 0.015);
  EXPECT_LT(std::abs(volumeDrift(t, start)), 1e-13);
}

}   // namespace
}   // namespace slender::test
