#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "slender_sim/thread/thread_group.h"
#include "slender_sim/thread/thread_remesh.h"
#include "slender_sim/world/world.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

TEST(ThreadBreak, BreakingConservesVolumeAndMomentum)
{
  Random random(1);
  ThreadState s = wigglyThread(10, random), older;
  s.volume[4] *= 1e-3;
  const double volume = s.totalVolume(), thin = s.radius(4);
  const Vector3d momentum = momentumOf(s);
  EXPECT_FALSE(breakThread(s, 0.9 * thin, older));
  ASSERT_TRUE(breakThread(s, 1.1 * thin, older));
  EXPECT_EQ(older.nodes(), 5);
  EXPECT_EQ(s.nodes(), 5);
  EXPECT_EQ(older.id.back(), 4u);
  EXPECT_EQ(s.id.front(), 5u);
  EXPECT_NEAR(s.totalVolume() + older.totalVolume(), volume, 1e-14);
  EXPECT_LT((momentumOf(s) + momentumOf(older) - momentum).norm(), 1e-14);
}

/// A dripping thread: surface tension and weight thin it until it breaks.
struct Dripping
{
  ThreadModel model;
  ThreadGroupState state;
  ThreadInputs inputs;
  Dripping()
  {
    model = honey();
    model.viscosity = 5;
    model.surface_tension = 0.05;
    model.feed_length = 0.004;
    model.floor.present = true;
    model.limits.max_edge_length = 0.01;
    model.limits.min_edge_length = 0.001;
    model.limits.min_radius = 2e-4;
    model.limits.max_deposited = 60;
    const Thread t = Thread::fromNozzle(model, {0, 0, 0.3}, 0.01);
    state.threads = {t.state};
    state.threads[0].x[0].x() += 1e-4;
    inputs = t.inputs;
  }
};

/// Steps a thread that touches nothing but its floor, and all that has broken off it.
class LoneThread
{
public:
  LoneThread(const ThreadModel& model, ThreadGroupState& state, double step) : state_(state)
  {
    WorldModel of;
    of.time.step = step;
    of.threads.push_back({std::make_shared<ThreadModel>(model), {}, 0.0});
    whole_.threads.resize(1);
    whole_.end_loads.resize(1);
    world_ = std::make_unique<World>(of, whole_);
  }
  StepReport step(const ThreadInputs& inputs)
  {
    std::swap(whole_.threads[0], state_);
    WorldInputs with;
    with.threads = {inputs};
    const StepReport report = world_->step(whole_, with);
    std::swap(whole_.threads[0], state_);
    return report;
  }

private:
  ThreadGroupState& state_;
  WorldState whole_;
  std::unique_ptr<World> world_;
};

TEST(ThreadGroup, AThreadThatDripsBreaksAndNoFluidIsLost)
{
  Dripping d;
  LoneThread thread(d.model, d.state, 0.002);
  const double start = d.state.volumeBalance();
  std::size_t most = 0;
  for (int k = 0; k < 700; ++k)
  {
    const StepReport report = thread.step(d.inputs);
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    most = std::max(most, d.state.threads.size());
    ASSERT_TRUE(d.state.threads[0].ends[1].held);
  }
  EXPECT_GT(most, 1u);
  EXPECT_GT(d.state.next_thread_id, 1u);
  EXPECT_NEAR(d.state.volumeBalance(), start, 1e-11 * d.state.threads[0].fed_volume);
  std::set<std::uint64_t> nodes, threads;
  std::size_t count = 0;
  for (const ThreadState& t : d.state.threads)
  {
    count += t.id.size();
    nodes.insert(t.id.begin(), t.id.end());
    threads.insert(t.thread_id);
  }
  EXPECT_EQ(nodes.size(), count);
  EXPECT_EQ(threads.size(), d.state.threads.size());
}

TEST(ThreadGroup, AFailureLeavesAllThreads)
{
  Dripping d;
  LoneThread thread(d.model, d.state, 0.002);
  for (int k = 0; k < 10; ++k)
    ASSERT_TRUE(thread.step(d.inputs).ok);
  d.state.threads.push_back(d.state.threads[0]);
  d.state.threads[1].ends[1].held = false;
  d.state.threads[1].volume[0] = -1;
  const ThreadState before = d.state.threads[0];
  EXPECT_FALSE(thread.step(d.inputs).ok);
  EXPECT_TRUE(sameThread(d.state.threads[0], before));
}

TEST(ThreadGroup, WhatLeavesTheSceneIsDropped)
{
  Dripping d;
  d.model.floor.present = false;
  d.model.limits.scene.min().z() = 0.0;
  LoneThread thread(d.model, d.state, 0.002);
  const double start = d.state.volumeBalance();
  std::size_t most = 0, nodes = 0;
  for (int k = 0; k < 4000; ++k)
  {
    ASSERT_TRUE(thread.step(d.inputs).ok) << k;
    most = std::max(most, d.state.threads.size());
    nodes = std::max(nodes, d.state.threads[0].x.size());
  }
  EXPECT_LT(most, 30u);
  EXPECT_LT(nodes, 300u);
  EXPECT_NEAR(d.state.volumeBalance(), start, 1e-11 * d.state.threads[0].fed_volume);
}

TEST(ThreadGroup, APieceThatComesToRestKeepsTheNodesThatMayLie)
{
  // thicker and longer than what may lie: its oldest nodes are dropped one by one, the others stay
  Dripping d;
  d.model.limits.max_deposited = 8;
  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, 12);
  x.row(0) = Eigen::RowVectorXd::LinSpaced(12, 0.5, 0.555);
  x.row(2) = Eigen::RowVectorXd::LinSpaced(12, 0.005, 0.01);   // its oldest node on the floor, the others above it
  ThreadState piece = makeThread(x, Eigen::VectorXd::Constant(11, 0.005));
  piece.thread_id = d.state.next_thread_id++;
  d.state.threads = {piece};
  d.inputs.flow_rate = 0.0;
  LoneThread thread(d.model, d.state, 0.005);
  const double start = d.state.volumeBalance();
  for (int k = 0; k < 200; ++k)
    ASSERT_TRUE(thread.step(d.inputs).ok);
  ASSERT_EQ(d.state.threads.size(), 1u);
  EXPECT_EQ(d.state.threads[0].nodes(), 9);
  for (const char deposited : d.state.threads[0].deposited)
    EXPECT_TRUE(deposited);
  EXPECT_NEAR(d.state.volumeBalance(), start, 1e-14 * start);
}

}   // namespace
}   // namespace slender::test
