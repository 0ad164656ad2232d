#include "slender_sim/node/converters.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "slender_sim/node/sim_clock.h"

namespace slender {
namespace {

geometry_msgs::Pose unitPose()
{
  geometry_msgs::Pose pose;
  pose.orientation.w = 1.0;
  return pose;
}

TEST(Converters, PoseThereAndBack)
{
  const Pose X{{1, -2, 3}, Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 1, -1).normalized()))};
  Pose back;
  EXPECT_EQ(fromMessage(toMessage(X), back), PoseFault::none);
  EXPECT_EQ(back.position, X.position);
  EXPECT_LT(back.orientation.angularDistance(X.orientation), 1e-15);
}

TEST(Converters, RefusesBadPosesAndKeepsTheOld)
{
  Pose X{{1, 2, 3}, Eigen::Quaterniond::Identity()};
  geometry_msgs::Pose bad = unitPose();
  bad.position.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fromMessage(bad, X), PoseFault::not_finite);
  bad = unitPose();
  bad.orientation.x = std::numeric_limits<double>::infinity();
  EXPECT_EQ(fromMessage(bad, X), PoseFault::not_finite);
  bad = unitPose();
  bad.orientation.w = 0.0;
  EXPECT_EQ(fromMessage(bad, X), PoseFault::bad_quaternion);
  bad.orientation.w = 1.02;
  EXPECT_EQ(fromMessage(bad, X), PoseFault::bad_quaternion);
  EXPECT_EQ(X.position, Eigen::Vector3d(1, 2, 3));
  bad.orientation.w = 1.005;
  EXPECT_EQ(fromMessage(bad, X), PoseFault::none);
  EXPECT_EQ(X.orientation.w(), 1.0);
}

TEST(Converters, RodStateMessage)
{
  RodModel model;
  model.name = "r";
  model.mass = Eigen::VectorXd::Ones(3);
  model.rest_length = Eigen::VectorXd::Ones(2);
  model.radius_a = model.radius_b = Eigen::VectorXd::Constant(2, 0.01);
  RodState state;
  state.x.resize(3, 3);
  state.x << 0, 0, 0, 0, 1, 1, 0, 0, 2;   // along y, then along z
  state.v = Eigen::Matrix3Xd::Constant(3, 3, 0.5);
  state.d1.resize(3, 2);
  state.d1 << 1, 1, 0, 0, 0, 0;
  state.twist = Eigen::Vector3d(0, 7, 0);
  slender_sim::RodState message;
  toMessage(model, state, message);
  ASSERT_EQ(message.nodes.size(), 3u);
  ASSERT_EQ(message.velocities.size(), 3u);
  ASSERT_EQ(message.frames.size(), 2u);
  ASSERT_EQ(message.twists.size(), 3u);
  ASSERT_EQ(message.radii.size(), 2u);
  EXPECT_TRUE(message.radii_b.empty());
  EXPECT_EQ(message.nodes[2].z, 2.0);
  EXPECT_EQ(message.velocities[1].y, 0.5);
  EXPECT_EQ(message.twists[1], 7.0);
  for (int j = 0; j < 2; ++j)
  {
    const auto& q = message.frames[j];
    const Eigen::Quaterniond frame(q.w, q.x, q.y, q.z);
    const Eigen::Vector3d tangent = state.x.col(j + 1) - state.x.col(j);
    EXPECT_LT((frame * Eigen::Vector3d::UnitX() - tangent.normalized()).norm(), 1e-14);
    EXPECT_LT((frame * Eigen::Vector3d::UnitY() - state.d1.col(j)).norm(), 1e-14);
  }
  std::vector<geometry_msgs::Pose> poses;
  appendPoses(model, state, poses);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[1].position.z, 1.0);
  model.radius_b *= 2.0;
  toMessage(model, state, message);
  EXPECT_EQ(message.radii_b.size(), 2u);
  EXPECT_TRUE(isFinite(state));
  state.v(1, 1) = std::nan("");
  EXPECT_FALSE(isFinite(state));
}

TEST(SimClock, StampsDoNotDrift)
{
  SimClock clock(ros::Time(10, 5), 1.0 / 3.0);
  for (int i = 0; i < 3; ++i)
    clock.tick();
  EXPECT_EQ(clock.stamp(), ros::Time(11, 5));
  clock.skip(3000000);
  EXPECT_EQ(clock.stamp(), ros::Time(1000011, 5));
  EXPECT_LT(clock.stamp(), clock.nextStamp());
  EXPECT_NEAR(clock.secondsAt(ros::Time(9, 5)), -1.0, 1e-12);
  EXPECT_EQ(clock.ticks(), 3000003u);
}

}  // namespace
}  // namespace slender
