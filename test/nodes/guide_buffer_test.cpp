#include "slender_sim/node/guide_buffer.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace slender {
namespace {

GuideBuffer::Options options(double delay)
{
  GuideBuffer::Options o;
  o.delay = delay;
  return o;
}

Pose turned(double x, double angle)
{
  return {Eigen::Vector3d(x, 0.3 * x, -x),
          Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -1).normalized()))};
}

double angleBetween(const Pose& a, const Pose& b) { return a.orientation.angularDistance(b.orientation); }

/// Follows `buffer` with fine steps and returns the largest jump of velocity between two of them.
struct Follower
{
  GuideBuffer& buffer;
  double step = 1e-3, time = 0.0;
  GraspTarget last{Pose(), Twist()};
  bool first = true;
  double worst_velocity_jump = 0.0, worst_slope_error = 0.0, worst_spin_error = 0.0;

  void to(double end)
  {
    for (; time < end - 1e-9; time += step)
    {
      const GraspTarget now = buffer.target(time);
      if (!first)
      {
        worst_velocity_jump = std::max(worst_velocity_jump, (now.velocity->linear - last.velocity->linear).norm());
        // the velocity must be the derivative of the position: trapezoidal rule over one step
        const Eigen::Vector3d mean = 0.5 * (now.velocity->linear + last.velocity->linear);
        worst_slope_error =
            std::max(worst_slope_error, ((now.X_WG.position - last.X_WG.position) / step - mean).norm());
        const Eigen::AngleAxisd turn(now.X_WG.orientation * last.X_WG.orientation.conjugate());
        const Eigen::Vector3d spin = 0.5 * (now.velocity->angular + last.velocity->angular);
        worst_spin_error = std::max(worst_spin_error, (turn.angle() / step * turn.axis() - spin).norm());
      }
      last = now;
      first = false;
    }
  }
};

TEST(GuideBuffer, HoldsStillWithoutInput)
{
  GuideBuffer buffer(options(0.05), Attach::section, turned(0.2, 0.5));
  const GraspTarget target = buffer.target(3.0);
  EXPECT_EQ(target.X_WG.position, turned(0.2, 0.5).position);
  EXPECT_EQ(target.velocity->linear.norm(), 0.0);
  EXPECT_FALSE(buffer.lastTime());
}

TEST(GuideBuffer, RefusesWhatIsNotLater)
{
  GuideBuffer buffer(options(0.0), Attach::section, Pose());
  EXPECT_TRUE(buffer.push(1.0, turned(0.1, 0)));
  EXPECT_FALSE(buffer.push(1.0, turned(0.2, 0)));
  EXPECT_FALSE(buffer.push(0.5, turned(0.2, 0)));
  EXPECT_TRUE(buffer.push(1.1, turned(0.3, 0)));
  EXPECT_EQ(*buffer.lastTime(), 1.1);
}

TEST(GuideBuffer, RefusesBadOptions)
{
  EXPECT_THROW(GuideBuffer(options(-0.1), Attach::section, Pose()), std::invalid_argument);
  GuideBuffer::Options o;
  o.catch_up_speed = 0.0;
  EXPECT_THROW(GuideBuffer(o, Attach::section, Pose()), std::invalid_argument);
}

// A smooth motion sampled at 30 Hz, sent in time: the grasp follows it one delay behind, to the error of cubic
// interpolation.
TEST(GuideBuffer, InterpolatesTimelyInput)
{
  const double delay = 0.1, rate = 30.0;
  GuideBuffer buffer(options(delay), Attach::section, turned(0, 0));
  const auto motion = [](double t) { return turned(0.2 * (1 - std::cos(2 * t)), 1.5 * (1 - std::cos(t))); };
  Follower follower{buffer};
  int sent = 0;
  double worst = 0, worst_angle = 0;
  for (double t = 0; t < 4.0; t += 1e-3)
  {
    while (sent / rate <= t)
    {
      ASSERT_TRUE(buffer.push(sent / rate, motion(sent / rate)));
      ++sent;
    }
    follower.to(t);
    if (t > 0.5)
    {
      worst = std::max(worst,
                       (follower.last.X_WG.position - motion(follower.time - follower.step - delay).position).norm());
      worst_angle =
          std::max(worst_angle, angleBetween(follower.last.X_WG, motion(follower.time - follower.step - delay)));
    }
  }
  EXPECT_LT(worst, 2e-4);   // 0.2 m * (2 rad/s / 30 Hz)^3 / 12, and a margin
  EXPECT_LT(worst_angle, 1e-3);
  // accelerations up to 1.2 m/s^2, so 1.2 mm/s per step; the cubic adds some
  EXPECT_LT(follower.worst_velocity_jump, 0.01);
  EXPECT_LT(follower.worst_slope_error, 1e-3);
  EXPECT_LT(follower.worst_spin_error, 1e-3);
}

// Input that stops at full speed, and comes back elsewhere: held, then caught up with, and never a jump of velocity.
TEST(GuideBuffer, HoldsAndCatchesUpSmoothly)
{
  GuideBuffer buffer(options(0.05), Attach::section, turned(0, 0));
  Follower follower{buffer};
  for (int k = 0; k <= 20; ++k)
    buffer.push(0.02 * k, turned(0.02 * k, 0.1 * k));   // 1.45 m/s
  follower.to(1.5);
  EXPECT_LT((follower.last.X_WG.position - turned(0.4, 0).position).norm(), 1e-9);
  EXPECT_EQ(follower.last.velocity->linear.norm(), 0.0);
  // the last sample is the place to rest, so the last interval brakes from v to 0: a cubic does so at 4 v / 0.02 s at
  // most
  EXPECT_LT(follower.worst_velocity_jump, 1.05 * 1e-3 * 4 * 1.45 / 0.02);
  follower.worst_velocity_jump = 0.0;
  for (int k = 0; k < 50; ++k)   // comes back 0.5 m further on, with 1 m/s
  {
    buffer.push(1.5 + 0.02 * k, turned(0.9 + 0.02 * k, 2.0));
    follower.to(1.5 + 0.02 * k);
  }
  follower.to(4.0);
  EXPECT_LT((follower.last.X_WG.position - turned(0.9 + 0.98, 0).position).norm(), 1e-9);
  // the gap of 0.7 m takes 0.7 s to close, and meanwhile the trajectory under it changes with each message
  EXPECT_LT(follower.worst_velocity_jump, 0.3);
  EXPECT_LT(follower.worst_slope_error, 0.2);   // second differences of a cubic over one step
}

// Messages that come later than the delay: the curve changes behind the grasp's back, and still nothing jumps.
TEST(GuideBuffer, LateInputDoesNotJump)
{
  GuideBuffer buffer(options(0.0), Attach::section, turned(0, 0));
  Follower follower{buffer};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> late(0.0, 0.03);
  for (int k = 0; k < 60; ++k)
  {
    follower.to(0.03 * k + late(random));
    buffer.push(0.03 * k, turned(0.3 * std::sin(0.09 * k), 0.03 * k));
  }
  EXPECT_LT(follower.worst_velocity_jump, 0.15);
  EXPECT_GT(follower.last.X_WG.position.norm(), 0.1);
}

TEST(GuideBuffer, DoesNotRunTheOtherWayAfterAPause)
{
  // silence from 0.3 s to 0.6 s, then 10 m away: the way is long, the speed that is left of the race through the gap
  // dies out within catch_up_time
  GuideBuffer::Options o = options(0.05);
  o.catch_up_time = 0.2;
  GuideBuffer buffer(o, Attach::section, Pose());
  double lowest = 0.0, highest = 0.0, before = 0.0;
  int sent = 0;
  for (double time = 0.0; time < 12.0; time += 1e-3)
  {
    for (; 0.03 * sent <= time; ++sent)
      if (0.03 * sent <= 0.3 || 0.03 * sent >= 0.6)
      {
        EXPECT_TRUE(buffer.push(
            0.03 * sent, {Eigen::Vector3d(0, 0, 0.03 * sent < 0.5 ? 0.0 : 10.0), Eigen::Quaterniond::Identity()}));
      }
    const double z = buffer.target(time).X_WG.position.z();
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
    if (time > 1.0)   // what is left goes at catch_up_speed on average, 1.5 times that at most
      EXPECT_LT(std::abs(z - before) / 1e-3, 1.6) << time;
    before = z;
  }
  EXPECT_GT(lowest, -0.1);
  EXPECT_LT(highest, 10.0 + 1e-9);
  EXPECT_NEAR(before, 10.0, 1e-9);
}

TEST(GuideBuffer, AttachInitialKeepsTheOffset)
{
  const Pose start = turned(0.7, 1.0);
  GuideBuffer buffer(options(0.0), Attach::initial, start);
  buffer.push(1.0, turned(5, 0.3));
  EXPECT_LT((buffer.target(1.0).X_WG.position - start.position).norm(), 1e-9);
  buffer.push(2.0, turned(6, 0.3));
  const Pose after = buffer.target(3.0).X_WG;
  EXPECT_LT((after.position - start.position - (turned(6, 0).position - turned(5, 0).position)).norm(), 0.2);
  const Pose settled = buffer.target(5.0).X_WG;
  EXPECT_LT((settled.position - start.position - (turned(6, 0).position - turned(5, 0).position)).norm(), 1e-9);
  EXPECT_LT(angleBetween(settled, start), 1e-9);
}

TEST(GuideBuffer, AttachingWhileRunningKeepsTheNewPlace)
{
  GuideBuffer buffer(options(0.0), Attach::initial, Pose());
  buffer.push(0.0, turned(0, 0));
  buffer.target(0.0);
  buffer.target(0.5);
  buffer.attachAt(turned(2, 1));
  EXPECT_LT((buffer.target(0.6).X_WG.position - turned(2, 1).position).norm(), 1e-9);
  buffer.restart(turned(3, 0));
  EXPECT_FALSE(buffer.lastTime());
  EXPECT_LT((buffer.target(9).X_WG.position - turned(3, 0).position).norm(), 1e-12);
}

}   // namespace
}   // namespace slender
