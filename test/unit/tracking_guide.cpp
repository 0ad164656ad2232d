// Guides: motions of points, and points carried by bodies.
#include <algorithm>

#include <gtest/gtest.h>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/geometry/pose_trajectory.h"
#include "slender_sim/tracking/guide_binding.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

TEST(Trajectories, CoastWhenNothingComes)
{
  // at 2 m/s and 0.5 rad/s; the speed dies out within 0.4 s, once continuously differentiable
  PointTrajectory points;
  PoseTrajectory poses;
  points.coast(0.4);
  for (int k = 0; k < 4; ++k)
  {
    const double t = 0.1 * k;
    points.append(t, Vector3d(2 * t, 0, 1));
    poses = k == 0 ? PoseTrajectory({t}, {Pose{{2 * t, 0, 1}, Eigen::Quaterniond::Identity()}}) : poses;
    if (k > 0)
      poses.append(t, Pose{{2 * t, 0, 1}, Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * t, Vector3d::UnitZ()))});
  }
  poses.coast(0.4);
  Matrix3Xd x, v;
  for (const double t : {0.25, 0.3, 0.4, 0.5, 0.7, 0.9})
  {
    points.evaluate(t, x, &v);
    Twist twist;
    const Pose pose = poses.evaluate(t, &twist);
    const double after = std::clamp(t - 0.3, 0.0, 0.4), way = std::min(t, 0.3) + after - after * after / 0.8,
                 speed = 1.0 - after / 0.4;
    EXPECT_NEAR(x(0, 0), 2 * way, 1e-12) << t;
    EXPECT_NEAR(v(0, 0), 2 * speed, 1e-12) << t;
    EXPECT_NEAR(pose.position.x(), 2 * way, 1e-12) << t;
    EXPECT_NEAR(twist.linear.x(), 2 * speed, 1e-12) << t;
    EXPECT_NEAR(pose.orientation.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * way, Vector3d::UnitZ()))),
                0.0, 1e-7)
        << t;
    EXPECT_NEAR(twist.angular.z(), 0.5 * speed, 1e-9) << t;
  }
}

TEST(PointTrajectory, StartsInMotionWhereToldSo)
{
  // exact for constant velocity (two frames, and more) and constant acceleration; at rest where frames repeat
  const auto frames = [](const std::vector<double>& times, double v, double a) {
    std::vector<Matrix3Xd> result;
    for (const double t : times)
      result.push_back(Vector3d(v * t + 0.5 * a * t * t, 0, 1));
    PointTrajectory trajectory(times, result);
    trajectory.startInMotion();
    return trajectory;
  };
  Matrix3Xd x, v;
  for (const double a : {0.0, 3.0})
    for (const double t : {0.0, 0.03, 0.1, 0.17})
    {
      frames({0.0, 0.1, 0.25, 0.4}, 2.0, a).evaluate(t, x, &v);
      EXPECT_NEAR(x(0, 0), 2.0 * t + 0.5 * a * t * t, 1e-14) << t;
      EXPECT_NEAR(v(0, 0), 2.0 + a * t, 1e-13) << t;
    }
  frames({0.0, 0.1}, 2.0, 0.0).evaluate(0.0, x, &v);
  EXPECT_NEAR(v(0, 0), 2.0, 1e-14);
  frames({0.0, 0.1, 0.2}, 2.0, 0.0).evaluate(-0.01, x, &v);
  EXPECT_EQ(v.norm(), 0.0);
  PointTrajectory paused({0.0, 0.1, 0.2}, {Vector3d(1, 0, 0), Vector3d(1, 0, 0), Vector3d(2, 0, 0)});
  paused.startInMotion();
  paused.evaluate(0.0, x, &v);
  EXPECT_EQ(v.norm(), 0.0);
}

TEST(PointTrajectory, MovesEachPointAsThePositionsOfPoses)
{
  Random random(4);
  const std::vector<double> times{0.0, 0.1, 0.25, 0.3, 0.7};
  std::vector<Matrix3Xd> frames;
  std::vector<std::vector<Pose>> poses(3);
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    Matrix3Xd points(3, 3);
    for (int i = 0; i < 3; ++i)
    {
      points.col(i) = i == 2 && k == 2 ? Vector3d(frames.back().col(2)) : random.vector();   // a pause
      poses[i].push_back({points.col(i), Eigen::Quaterniond::Identity()});
    }
    frames.push_back(points);
  }
  PointTrajectory trajectory(times, frames);
  for (const double t : {-1.0, 0.0, 0.05, 0.17, 0.26, 0.5, 0.7, 2.0})
  {
    Matrix3Xd points, velocities;
    trajectory.evaluate(t, points, &velocities);
    for (int i = 0; i < 3; ++i)
    {
      Twist twist;
      const Pose pose = PoseTrajectory(times, poses[i]).evaluate(t, &twist);
      EXPECT_EQ(Vector3d(points.col(i)), pose.position) << t;
      EXPECT_LT((velocities.col(i) - twist.linear).norm(), 1e-14) << t;
    }
  }
  Matrix3Xd before, after;
  trajectory.evaluate(0.5, before);
  trajectory.forgetBefore(0.5);
  trajectory.evaluate(0.5, after);
  EXPECT_EQ(before, after);
  // three samples before that of the segment, which tell a pause from a turning point
  EXPECT_EQ(trajectory.times().size(), 5u);
  trajectory.forgetBefore(0.8);
  EXPECT_EQ(trajectory.times().size(), 4u);
  EXPECT_THROW(trajectory.append(0.7, frames[0]), std::invalid_argument);
  EXPECT_THROW(trajectory.append(0.8, Matrix3Xd::Zero(3, 2)), std::invalid_argument);
  EXPECT_THROW(trajectory.append(0.8, Matrix3Xd::Constant(3, 3, NAN)), std::invalid_argument);
}

TEST(GuideBinding, CarriesGroupsRigidlyAndBlends)
{
  Random random(6);
  Matrix3Xd rest(3, 4);
  for (int i = 0; i < 4; ++i)
    rest.col(i) = random.vector();
  std::vector<Pose> start, end;
  for (int b = 0; b < 2; ++b)
  {
    start.push_back({random.vector(), random.rotation()});
    end.push_back({random.vector(), random.rotation()});
  }
  const GuideBinding binding(rest, start, {{0, 0, 1}, {1, 0, 2}, {2, 1, 1}, {3, 0, 1}, {3, 1, 3}});
  Matrix3Xd placed;
  binding.place(start, placed);
  EXPECT_LT((placed - rest).cwiseAbs().maxCoeff(), 1e-15);
  binding.place(end, placed);
  EXPECT_NEAR((placed.col(0) - placed.col(1)).norm(), (rest.col(0) - rest.col(1)).norm(), 1e-15);
  const Vector3d a = end[0] * (start[0].inverse() * Vector3d(rest.col(3))),
                 b = end[1] * (start[1].inverse() * Vector3d(rest.col(3)));
  EXPECT_LT((placed.col(3) - (0.25 * a + 0.75 * b)).norm(), 1e-15);
  EXPECT_THROW(GuideBinding(rest, start, {{0, 0, 1}, {1, 0, 1}, {2, 1, 1}}), std::invalid_argument);
  EXPECT_THROW(GuideBinding(rest, start, {{0, 2, 1}}), std::invalid_argument);
}

}   // namespace
}   // namespace slender::test
