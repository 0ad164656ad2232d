#include "slender_sim/node/point_guide_buffer.h"

#include <cmath>

#include <gtest/gtest.h>

namespace slender {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

Matrix3Xd pointsAt(double height)
{
  Matrix3Xd points(3, 2);
  points << 0, 1, 0, 2, height, 2 * height;
  return points;
}

GuideBuffer::Options pointOptions(double delay, double coast = 0.0)
{
  GuideBuffer::Options o;
  o.delay = delay;
  o.catch_up_time = 0.2;
  o.coast = coast;
  return o;
}

/// Follows with fine steps; largest change of velocity between two of them.
struct PointFollower
{
  PointGuideBuffer& buffer;
  double step = 1e-3, time = 0.0;
  Matrix3Xd x{}, v{};
  double worst = 0.0;

  void to(double end)
  {
    for (; time < end - 1e-9; time += step)
    {
      const Matrix3Xd now = buffer.target(time);
      if (x.cols() > 0)
      {
        const Matrix3Xd rate = (now - x) / step;
        if (v.cols() > 0)
          worst = std::max(worst, (rate - v).cwiseAbs().maxCoeff());
        v = rate;
      }
      x = now;
    }
  }
};

TEST(PointGuideBuffer, InterpolatesTimelyMessagesExactly)
{
  PointGuideBuffer buffer(pointOptions(0.1), pointsAt(0));
  PointTrajectory expected;
  Matrix3Xd wanted;
  int sent = 0;
  for (double time = 0.0; time < 1.0; time += 0.01)
  {
    for (; 0.04 * sent <= time; ++sent)
    {
      const double height = std::pow(0.04 * sent, 2);
      EXPECT_TRUE(buffer.push(0.04 * sent, pointsAt(height)));
      expected.append(0.04 * sent, pointsAt(height));
    }
    const Matrix3Xd x = buffer.target(time);
    expected.evaluate(time - 0.1, wanted);
    EXPECT_LT((x - wanted).cwiseAbs().maxCoeff(), 1e-12) << time;
  }
  EXPECT_FALSE(buffer.push(0.5, pointsAt(1)));
  EXPECT_DOUBLE_EQ(*buffer.lastTime(), 0.04 * (sent - 1));
  EXPECT_THROW(buffer.push(9.0, Matrix3Xd::Zero(3, 5)), std::invalid_argument);
  EXPECT_THROW(buffer.push(9.0, Matrix3Xd::Constant(3, 2, NAN)), std::invalid_argument);
}

TEST(PointGuideBuffer, DoesNotRunTheOtherWayAfterAPause)
{
  // silence from 0.3 s to 0.6 s, then 10 m away: the trajectory races through the gap
  PointGuideBuffer buffer(pointOptions(0.05), pointsAt(0));
  PointFollower follower{buffer};
  double lowest = 0.0, highest = 0.0;
  for (int k = 0; k < 400; ++k)
  {
    const double time = 0.03 * k;
    if (time <= 0.3 || time >= 0.6)
      EXPECT_TRUE(buffer.push(time, pointsAt(time < 0.5 ? 0.0 : 10.0)));
    follower.to(time + 0.03);
    lowest = std::min(lowest, follower.x(2, 0));
    highest = std::max(highest, follower.x(2, 0));
    if (time > 1.0)   // what is left goes at catch_up_speed on average, 1.5 times that at most; point 1 goes twice as
                      // far as point 0
      EXPECT_LT(std::abs(follower.v(2, 1)), 1.6) << time;
  }
  EXPECT_GT(lowest, -0.1);   // the cubic through the gap overshoots, by 1 % of its height
  EXPECT_LT(highest, 10.0 + 1e-9);
}

TEST(PointGuideBuffer, CatchesUpWithoutAJolt)
{
  for (const double coast : {0.0, 0.3})
  {
    PointGuideBuffer buffer(pointOptions(0.0, coast), pointsAt(0));
    for (int k = 0; k <= 10; ++k)
      buffer.push(0.04 * k, pointsAt(0.04 * k));   // 1 and 2 m/s
    PointFollower follower{buffer};
    follower.to(1.0);   // silence from 0.4 s on
    EXPECT_NEAR(follower.x(2, 0), 0.4 + 0.5 * coast, 1e-9);
    EXPECT_LT(follower.worst, 0.2);
    for (int k = 26; k <= 60; ++k)
      buffer.push(0.04 * k, pointsAt(0.04 * k));
    follower.to(2.3);
    EXPECT_LT(follower.worst, 0.2) << coast;
    EXPECT_NEAR(follower.x(2, 0), follower.time - follower.step, 1e-9);
  }
}

TEST(PointGuideBuffer, BeginsElsewhereAndRestarts)
{
  PointGuideBuffer buffer(pointOptions(0.0), pointsAt(0.3));
  PointFollower follower{buffer};
  follower.to(0.1);
  EXPECT_TRUE(follower.x == pointsAt(0.3));
  buffer.push(0.2, pointsAt(0));
  follower.to(1.5);
  EXPECT_LT(follower.worst, 0.05);
  EXPECT_LT((follower.x - pointsAt(0)).cwiseAbs().maxCoeff(), 1e-12);
  buffer.attachAt(pointsAt(0.1));
  EXPECT_LT((buffer.target(1.5) - pointsAt(0.1)).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((buffer.target(2.5) - pointsAt(0)).cwiseAbs().maxCoeff(), 1e-12);
  buffer.restart(pointsAt(0.7));
  EXPECT_TRUE(buffer.target(2.6) == pointsAt(0.7));
  EXPECT_FALSE(buffer.lastTime().has_value());
}

}   // namespace
}   // namespace slender
