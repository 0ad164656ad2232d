#include "slender_sim/node/converters.h"

#include <cmath>
#include <cstring>
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

/// Two points in a row, as x, y and z of float32.
sensor_msgs::PointCloud2 twoPoints()
{
  sensor_msgs::PointCloud2 cloud;
  for (std::uint32_t k = 0; k < 3; ++k)
  {
    sensor_msgs::PointField field;
    field.name = std::string(1, "xyz"[k]);
    field.offset = 4 * k;
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  const float points[] = {1, 2, 3, 4, 5, 6};
  cloud.height = 1;
  cloud.width = 2;
  cloud.point_step = 12;
  cloud.row_step = 24;
  cloud.data.resize(24);
  std::memcpy(cloud.data.data(), points, sizeof points);
  return cloud;
}

TEST(Converters, PointsWhoseLayoutReachesOutOfTheDataAreRefused)
{
  Eigen::Matrix3Xd points;
  ASSERT_EQ(fromPoints(twoPoints(), points), "");
  ASSERT_EQ(points, (Eigen::Matrix3Xd(3, 2) << 1, 4, 2, 5, 3, 6).finished());

  const auto refused = [&points](const auto& change) {
    sensor_msgs::PointCloud2 bad = twoPoints();
    change(bad);
    return fromPoints(bad, points);
  };
  constexpr std::uint32_t top = 0xFFFFFFFF;   // sums and products with it wrap in 32 bits
  for (const std::uint32_t offset : {9u, top - 7, top - 3, top})
    EXPECT_EQ(refused([offset](auto& cloud) { cloud.fields[2].offset = offset; }), "a field reaches beyond point_step")
        << offset;
  EXPECT_EQ(refused([](auto& cloud) { cloud.fields[0] = cloud.fields[1]; }),
            "it must have the fields x, y and z, float32 or float64");
  const std::string shorter = "data is shorter than width, height and steps say";
  EXPECT_EQ(refused([](auto& cloud) { cloud.data.pop_back(); }), shorter);
  EXPECT_EQ(refused([](auto& cloud) { cloud.row_step = 23; }), shorter);
  EXPECT_EQ(refused([](auto& cloud) { cloud.row_step = top; }), shorter);
  EXPECT_EQ(refused([](auto& cloud) { cloud.point_step = top; }), shorter);
  EXPECT_EQ(refused([](auto& cloud) { cloud.point_step = 0x80000000; }), shorter);   // twice that is 2^32
  // 12 times that is 2^32 + 8
  EXPECT_EQ(refused([](auto& cloud) { cloud.width = 0x15555556; }), shorter);
  // 24 times that is 3 * 2^32
  EXPECT_EQ(refused([](auto& cloud) { cloud.height = 0x20000000; }), shorter);
  EXPECT_EQ(refused([](auto& cloud) { cloud.width = cloud.height = top; }), shorter);
  EXPECT_EQ(refused([](auto& cloud) { cloud.width = 0; }), "");
  EXPECT_EQ(points.cols(), 0);
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
  appendPoses(message, poses);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[1].position.z, 1.0);
  model.radius_b *= 2.0;
  toMessage(model, state, message);
  EXPECT_EQ(message.radii_b.size(), 2u);
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

}   // namespace
}   // namespace slender
