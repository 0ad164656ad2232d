#include "slender_sim/node/guide_buffer.h"

#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace slender {
namespace {

GuideBuffer::Options delayedBy(double delay)
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
struct PoseFollower
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
  GuideBuffer buffer(delayedBy(0.05), Attach::section, turned(0.2, 0.5));
  const GraspTarget target = buffer.target(3.0);
  EXPECT_EQ(target.X_WG.position, turned(0.2, 0.5).position);
  EXPECT_EQ(target.velocity->linear.norm(), 0.0);
  EXPECT_FALSE(buffer.lastTime());
}

TEST(GuideBuffer, RefusesWhatIsNotLater)
{
  GuideBuffer buffer(delayedBy(0.0), Attach::section, Pose());
  EXPECT_TRUE(buffer.push(1.0, turned(0.1, 0)));
  EXPECT_FALSE(buffer.push(1.0, turned(0.2, 0)));
  EXPECT_FALSE(buffer.push(0.5, turned(0.2, 0)));
  EXPECT_TRUE(buffer.push(1.1, turned(0.3, 0)));
  EXPECT_EQ(*buffer.lastTime(), 1.1);
}

TEST(GuideBuffer, RefusesBadOptions)
{
  EXPECT_THROW(GuideBuffer(delayedBy(-0.1), Attach::section, Pose()), std::invalid_argument);
  GuideBuffer::Options o;
  o.catch_up_speed = 0.0;
  EXPECT_THROW(GuideBuffer(o, Attach::section, Pose()), std::invalid_argument);
}

// A smooth motion sampled at 30 Hz, sent in time: the grasp follows it one delay behind, to the error of cubic
// interpolation.
TEST(GuideBuffer, InterpolatesTimelyInput)
{
  const double delay = 0.1, rate = 30.0;
  GuideBuffer buffer(delayedBy(delay), Attach::section, turned(0, 0));
  const auto motion = [](double t) { return turned(0.2 * (1 - std::cos(2 * t)), 1.5 * (1 - std::cos(t))); };
  PoseFollower follower{buffer};
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
  GuideBuffer buffer(delayedBy(0.05), Attach::section, turned(0, 0));
  PoseFollower follower{buffer};
  for (int k = 0; k <= 20; ++k)
    buffer.push(0.02 * k, turned(0.02 * k, 0.1 * k));   // 1.45 m/s
  follower.to(1.5);
  EXPECT_LT((follower.last.X_WG.position - turned(0.4, 0).position).norm(), 1e-9);
  EXPECT_EQ(follower.last.velocity->linear.norm(), 0.0);
  // the last sample is the place to rest, and the speed is blended out from there: within 0.1 s, at 4 v / 0.1 s at most
  EXPECT_LT(follower.worst_velocity_jump, 1.05 * 1e-3 * 4 * 1.45 / 0.1);
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
  GuideBuffer buffer(delayedBy(0.0), Attach::section, turned(0, 0));
  PoseFollower follower{buffer};
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
  GuideBuffer::Options o = delayedBy(0.05);
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
  GuideBuffer buffer(delayedBy(0.0), Attach::initial, start);
  buffer.push(1.0, turned(5, 0.3));
  EXPECT_LT((buffer.target(1.0).X_WG.position - start.position).norm(), 1e-9);
  buffer.push(2.0, turned(6, 0.3));
  const Pose after = buffer.target(3.0).X_WG;
  EXPECT_LT((after.position - start.position - (turned(6, 0).position - turned(5, 0).position)).norm(), 0.2);
  const Pose settled = buffer.target(5.0).X_WG;
  EXPECT_LT((settled.position - start.position - (turned(6, 0).position - turned(5, 0).position)).norm(), 1e-9);
  EXPECT_LT(angleBetween(settled, start), 1e-9);
}

/// A gripper whose section sits 0.1 m in front of it.
Pose inFront() { return {Eigen::Vector3d(0, 0, 0.1), Eigen::Quaterniond(0, 1, 0, 0)}; }

/// The offset is given: a first pose that comes 6 cm late, a reset and a new hold change nothing of it.
TEST(GuideBuffer, AGivenOffsetStays)
{
  const Pose start = turned(0, 0), X_HG = inFront();
  const auto stays = [&](GuideBuffer& buffer, double begin, const Pose& X_WH) {
    PoseFollower follower{buffer};
    follower.time = begin;
    for (int k = 0; k <= 100; ++k)
    {
      buffer.push(begin + 0.02 * k, X_WH);
      follower.to(begin + 0.02 * k);
    }
    EXPECT_LT((follower.last.X_WG.position - (X_WH * X_HG).position).norm(), 1e-9);
    EXPECT_LT(angleBetween(follower.last.X_WG, X_WH * X_HG), 1e-7);
    EXPECT_LT(follower.worst_velocity_jump, 0.2);   // closes the gap without a jump
  };
  for (const Attach attach : {Attach::section, Attach::initial})
  {
    GuideBuffer buffer(delayedBy(0.05), attach, start, X_HG);
    stays(buffer, 0.0, turned(0.06, 0));
    buffer.restart(start);
    stays(buffer, 3.0, turned(0.1, 0.5));
    buffer.attachAt(turned(0.3, 0));
    stays(buffer, 6.0, turned(0.1, 0.5));
  }
}

/// Without a given offset, the one at the first pose of all stays the same over resets.
TEST(GuideBuffer, AttachInitialRemembersItsOffset)
{
  const Pose home = turned(0.2, 0.3), away = turned(0.06, 0.4), start = home * inFront();
  GuideBuffer buffer(delayedBy(0.05), Attach::initial, start);
  double time = 0.0;
  const auto stream = [&](const Pose& X_WH) {
    for (int k = 0; k < 100; ++k, time += 0.02)
    {
      buffer.push(time, X_WH);
      buffer.target(time);
    }
    return buffer.target(time).X_WG;
  };
  EXPECT_LT((stream(home).position - start.position).norm(), 1e-9);
  EXPECT_LT((stream(away).position - (away * inFront()).position).norm(), 1e-9);
  buffer.restart(start);   // poses go on meanwhile
  EXPECT_LT((stream(away).position - (away * inFront()).position).norm(), 1e-9);
  // held elsewhere: that offset counts, until a reset
  const Pose other = turned(0.5, 0);
  buffer.attachAt(other);
  EXPECT_LT((stream(away).position - other.position).norm(), 1e-9);
  buffer.restart(start);
  EXPECT_LT((stream(away).position - (away * inFront()).position).norm(), 1e-9);
  // before any pose has come
  GuideBuffer held(delayedBy(0.05), Attach::initial, start);
  held.attachAt(other);
  held.push(0.0, away);
  EXPECT_LT((held.target(1.0).X_WG.position - other.position).norm(), 1e-9);
  held.restart(start);
  held.push(2.0, home);
  EXPECT_LT((held.target(3.0).X_WG.position - start.position).norm(), 1e-9);
}

/// The first pose comes while the gripper moves at 0.27 m/s, and the last one, too. The grasp takes the speed up, and
/// lets go of it, within catch_up_time T. The weight of a rate in fadeOut() changes by at most 4/T, and no step does
/// more. (A stream that began at rest went through its first interval of 20 ms at up to 4/3 of the speed, from 0: a
/// jump of 0.36 m/s in 13 ms.)
TEST(GuideBuffer, StreamsBeginAndEndInMotion)
{
  const double v = 0.27, T = 0.1;
  for (const bool live : {false, true})
    for (const double rate : {20.0, 50.0, 100.0})
      for (const Attach attach : {Attach::section, Attach::initial})
      {
        const std::string what = std::to_string(rate) + " Hz" + (live ? ", live" : "");
        GuideBuffer::Options o = delayedBy(0.05);
        o.live = live;
        const auto at = [&](double t) { return Pose{Eigen::Vector3d(v * t, 0, 1), Eigen::Quaterniond::Identity()}; };
        GuideBuffer buffer(o, attach, at(0.0));
        PoseFollower follower{buffer};
        double fastest = 0.0;
        int sent = 0;
        for (double t = 0.0; t < 4.0; t += 1e-3)
        {
          for (; sent / rate <= std::min(t, 2.0); ++sent)
            ASSERT_TRUE(buffer.push(sent / rate, at(sent / rate)));
          follower.to(t);
          fastest = std::max(fastest, follower.last.velocity->linear.norm());
          if (t > 1.0 && t < 2.0)
            EXPECT_NEAR(follower.last.X_WG.position.x(), v * (t - 1e-3 - buffer.timing().lag()), 1e-6) << what;
        }
        EXPECT_LT(follower.worst_velocity_jump, 1.05 * 1e-3 * 4.0 * v / T) << what;
        EXPECT_LT(follower.worst_slope_error, 0.01) << what;
        EXPECT_LT(fastest, 1.34 * v) << what;   // what was missed at first is made up for
        EXPECT_NEAR(follower.last.X_WG.position.x(), v * 2.0, 1e-9) << what;
        EXPECT_EQ(follower.last.velocity->linear.norm(), 0.0) << what;
      }
}

/// Streams that begin and end at rest are followed exactly: nothing is cut.
TEST(GuideBuffer, StreamsFromRestToRestAreExact)
{
  const auto way = [](double t) {
    const double s = std::min(t, 1.0);
    return 0.3 * s * s * (3 - 2 * s);
  };
  GuideBuffer buffer(delayedBy(0.05), Attach::section, Pose());
  double worst = 0.0, farthest = 0.0;
  int sent = 0;
  for (double t = 0.0; t < 2.0; t += 1e-3)
  {
    for (; 0.02 * sent <= std::min(t, 1.0); ++sent)
      buffer.push(0.02 * sent, {Eigen::Vector3d(way(0.02 * sent), 0, 0), Eigen::Quaterniond::Identity()});
    const double x = buffer.target(t).X_WG.position.x();
    worst = std::max(worst, std::abs(x - way(std::max(0.0, t - 0.05))));
    farthest = std::max(farthest, x);
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_LT(farthest, 0.3 + 1e-4);
}

/// Two poses, or a jump at the last one, are no motion that could be cut.
TEST(GuideBuffer, StepsAreNotOvershot)
{
  for (const int before : {1, 2, 10})
  {
    GuideBuffer buffer(delayedBy(0.05), Attach::section, Pose());
    double farthest = 0.0;
    for (int k = 0; k <= before; ++k)
      buffer.push(0.02 * k, {Eigen::Vector3d(k < before ? 0.0 : 0.1, 0, 0), Eigen::Quaterniond::Identity()});
    for (double t = 0.0; t < 2.0; t += 1e-3)
      farthest = std::max(farthest, buffer.target(t).X_WG.position.x());
    // the speed that is left 1e-7 s before the end is blended out: 6 * 0.1 m * 1e-7 s / (0.02 s)^2, for 4/27 of 0.1 s
    EXPECT_LT(farthest, 0.1 + 1e-5) << before;
    EXPECT_NEAR(buffer.target(2.0).X_WG.position.x(), 0.1, 1e-9);
  }
}

/// A lag that is shared: two streams of which one is late are shown at the same instant.
TEST(GuideBuffer, TheGreatestLagForAll)
{
  const auto way = [](double t) { return Pose{Eigen::Vector3d(std::sin(t), 0, 0), Eigen::Quaterniond::Identity()}; };
  GuideBuffer timely(delayedBy(0.05), Attach::section, Pose()), late(delayedBy(0.05), Attach::section, Pose());
  double apart = 0.0;
  for (int k = 0; k < 400; ++k)
  {
    const double t = 0.02 * k;
    timely.push(t, way(t));
    if (k >= 8)
      late.push(t - 0.16, way(t - 0.16));
    const double lag = std::max(timely.timing().wantedLag(), late.timing().wantedLag());
    timely.lagAtLeast(lag);
    late.lagAtLeast(lag);
    const double gap = (timely.target(t).X_WG.position - late.target(t).X_WG.position).norm();
    if (t > 4.0)
      apart = std::max(apart, gap);
  }
  EXPECT_LT(apart, 1e-4);
  EXPECT_NEAR(timely.timing().lag(), late.timing().lag(), 1e-6);   // they approach it
  EXPECT_GT(timely.timing().lag(),
            0.16 + 0.02);                     // two intervals, of which one has passed when a pose is there at once
  EXPECT_EQ(timely.timing().excess(), 0.0);   // it is not to blame
}

TEST(GuideBuffer, AttachingWhileRunningKeepsTheNewPlace)
{
  GuideBuffer buffer(delayedBy(0.0), Attach::initial, Pose());
  buffer.push(0.0, turned(0, 0));
  buffer.target(0.0);
  buffer.target(0.5);
  buffer.attachAt(turned(2, 1));
  EXPECT_LT((buffer.target(0.6).X_WG.position - turned(2, 1).position).norm(), 1e-9);
  buffer.restart(turned(3, 0));
  EXPECT_FALSE(buffer.lastTime());
  EXPECT_LT((buffer.target(9).X_WG.position - turned(3, 0).position).norm(), 1e-12);
}

// What a limit has held (on_limit: hold) goes back to where its gripper is, and does not take another hold of it.
TEST(GuideBuffer, StandingStillMeanwhileKeepsTheOffset)
{
  GuideBuffer buffer(delayedBy(0.0), Attach::initial, Pose());
  buffer.push(0.0, turned(0, 0));
  buffer.target(0.0);
  buffer.push(0.5, turned(0.2, 0));
  buffer.target(1.0);
  const Pose held = turned(0.05, 0);
  buffer.catchUpFrom(held);
  EXPECT_LT((buffer.target(1.001).X_WG.position - held.position).norm(), 0.01);   // it does not jump
  EXPECT_LT((buffer.target(3.0).X_WG.position - turned(0.2, 0).position).norm(), 1e-9);
}

}   // namespace
}   // namespace slender
