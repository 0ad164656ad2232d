// Guides that come later than ~guide_delay, with simulated clocks: what they move lags, but does not jerk.
#include <algorithm>
#include <cmath>
#include <deque>
#include <random>

#include <gtest/gtest.h>

#include "slender_sim/node/guide_buffer.h"
#include "slender_sim/node/point_guide_buffer.h"

namespace slender {
namespace {

constexpr double kStep = 0.005, kInterval = 0.01;   // [s] of the simulation, between poses

/// What a gripper does: from rest into a swing along x, which turns with it.
struct Command
{
  double frequency = 1.0;   // [Hz]
  double reach = 0.2;       // [m]

  double at(double t) const
  {
    const double s = std::clamp(t / 1.5, 0.0, 1.0);
    return reach * s * s * s * (10.0 + s * (6.0 * s - 15.0)) * std::sin(2.0 * M_PI * frequency * t);
  }
  Pose pose(double t) const
  {
    return {Eigen::Vector3d(at(t), 0.0, 0.0),
            Eigen::Quaterniond(Eigen::AngleAxisd(3.0 * at(t), Eigen::Vector3d::UnitZ()))};
  }
};

double secondDifference(double a, double b, double c) { return (a - 2.0 * b + c) / (kStep * kStep); }

/// Greatest acceleration of the command, over the same steps.
double commanded(const Command& command, double length)
{
  double worst = 0.0;
  for (double t = kStep; t < length; t += kStep)
    worst = std::max(worst, std::abs(secondDifference(command.at(t - kStep), command.at(t), command.at(t + kStep))));
  return worst;
}

struct Result
{
  double acceleration = 0.0;   // [m/s^2] greatest
  double turning = 0.0;        // [rad/s^2] greatest
  double error = 0.0;          // [m] distance from the command of `lag` ago, after the first half
  double lag = 0.0;            // [s] at the end
  double excess = 0.0;
};

/// Sends the command's poses, each `late(k)` s after its stamp but none before an earlier one, and follows.
template <class Late>
Result follow(const Command& command, const GuideBuffer::Options& options, double length, const Late& late)
{
  GuideBuffer buffer(options, Attach::section, command.pose(0.0));
  Result result;
  std::deque<double> x, angle;
  double arrival = 0.0;
  int sent = 0;
  for (int n = 1; n * kStep < length; ++n)
  {
    const double now = (n - 1) * kStep, time = n * kStep;   // the step goes from now to time
    for (;; ++sent)
    {
      arrival = std::max(arrival, sent * kInterval + late(sent));
      if (arrival > now + 1e-9)
        break;
      EXPECT_TRUE(buffer.push(sent * kInterval, command.pose(sent * kInterval)));
    }
    const GraspTarget target = buffer.target(time);
    x.push_back(target.X_WG.position.x());
    angle.push_back(2.0 * std::asin(target.X_WG.orientation.z()));
    if (x.size() == 3)
    {
      result.acceleration = std::max(result.acceleration, std::abs(secondDifference(x[0], x[1], x[2])));
      result.turning = std::max(result.turning, std::abs(secondDifference(angle[0], angle[1], angle[2])));
      x.pop_front();
      angle.pop_front();
    }
    result.lag = buffer.timing().lag();
    if (time > 0.5 * length)
      result.error = std::max(result.error, std::abs(x.back() - command.at(time - result.lag)));
  }
  result.excess = buffer.timing().excess();
  return result;
}

GuideBuffer::Options lateOptions(bool live, bool automatic = false)
{
  GuideBuffer::Options o;
  o.live = live;
  o.automatic = automatic;
  return o;
}

// Poses that all come equally late. The bound on acceleration is the bar of the issue; what is measured is at
// most 1.06. The extremes of the swing of 2 Hz lie in the middle between two samples, which are therefore equal without
// being a pause.
TEST(LateGuides, ConstantlyLate)
{
  for (const double frequency : {0.5, 1.0, 2.0})
    for (const bool live : {false, true})
      for (int ms = 0; ms <= 300; ms += 10)
      {
        const Command command{frequency};
        const double late = 1e-3 * ms, most = commanded(command, 6.0);
        const Result result = follow(command, lateOptions(live), 6.0, [&](int) { return late; });
        EXPECT_LE(result.acceleration, 1.5 * most) << ms << " ms, " << frequency << " Hz" << (live ? ", live" : "");
        EXPECT_LE(result.turning, 1.5 * 3.0 * most) << ms << " ms, " << frequency << " Hz" << (live ? ", live" : "");
        // the motion is late but follows the command's path, up to the error of cubics through 100 poses a second
        EXPECT_LE(result.error, 1e-4) << ms;
        // two intervals and the transport, which is found out with the resolution of a step; and 10 % more; the delay
        // where that is enough
        EXPECT_LE(result.lag, std::max(0.05, 1.1 * (late + 2.0 * kInterval + kStep)) + 1e-6) << ms;
        EXPECT_GE(result.lag, std::max(0.05, late + 2.0 * kInterval - kStep) - 1e-9) << ms;
        if (std::abs(late + 2.0 * kInterval - 0.05) > 1e-9)   // there round-off decides
          EXPECT_EQ(result.excess > 0.0, late + 2.0 * kInterval > 0.05) << ms;
      }
}

// Timely poses: exactly the delay, whenever within it they come, and to the last bit the same.
TEST(LateGuides, InTimeIsExact)
{
  const Command command;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> late(0.0, 0.025);
  const Result steady = follow(command, lateOptions(false), 4.0, [](int) { return 0.0; });
  const Result jittery = follow(command, lateOptions(false), 4.0, [&](int) { return late(random); });
  EXPECT_EQ(steady.lag, jittery.lag);
  EXPECT_EQ(steady.lag, 0.05);
  EXPECT_EQ(steady.acceleration, jittery.acceleration);
  EXPECT_EQ(steady.error, jittery.error);
}

// Every pose late by another time, in the order of their stamps, as a stream over a network.
TEST(LateGuides, Jitter)
{
  for (const double frequency : {0.5, 1.0, 2.0})
    for (const bool live : {false, true})
      for (const double most_late : {0.05, 0.1, 0.3})
      {
        const Command command{frequency};
        std::mt19937 random(3);
        std::uniform_real_distribution<double> late(0.0, most_late);
        const Result result = follow(command, lateOptions(live), 8.0, [&](int) { return late(random); });
        EXPECT_LE(result.acceleration, 1.5 * commanded(command, 8.0))
            << most_late << " s, " << frequency << " Hz" << (live ? ", live" : "");
        EXPECT_LE(result.error, 1e-4);
      }
}

// One pose of a live stream is held up, and all behind it: nobody can know, so the motion brakes, and goes on in the
// same way.
TEST(LateGuides, Hiccup)
{
  const Command command;
  for (const double hiccup : {0.05, 0.1, 0.2, 0.3})
  {
    const Result result = follow(command, lateOptions(true), 8.0, [&](int k) { return k == 200 ? hiccup : 0.0; });
    EXPECT_LE(result.acceleration, 1.5 * commanded(command, 8.0)) << hiccup;
    EXPECT_LE(result.error, 1e-4) << hiccup;   // after the first half all is well again
  }
}

// The delay that adapts: two intervals, the transport and a little, up and down.
TEST(LateGuides, Automatic)
{
  const Command command;
  for (const double late : {0.0, 0.04, 0.1, 0.3})
  {
    const Result result = follow(command, lateOptions(true, true), 6.0, [&](int) { return late; });
    EXPECT_LE(result.acceleration, 1.5 * commanded(command, 6.0)) << late;
    EXPECT_NEAR(result.lag, 1.1 * (late + 2.0 * kInterval) + 0.001, 1.1 * kStep + 1e-6) << late;
    EXPECT_EQ(result.excess, 0.0);
  }
  // the network recovers after 5 s: the lag is forgotten within 5 s more, and made up for by a tenth of real time
  const Result result = follow(command, lateOptions(true, true), 20.0, [](int k) { return k < 500 ? 0.3 : 0.0; });
  EXPECT_LE(result.acceleration, 1.5 * commanded(command, 20.0));
  EXPECT_NEAR(result.lag, 1.1 * 2.0 * kInterval + 0.001, 1.1 * kStep + 1e-6);
}

// Points go the same way.
TEST(LateGuides, Points)
{
  const Command command;
  const double most = commanded(command, 6.0);
  for (const bool live : {false, true})
    for (const double late : {0.0, 0.04, 0.08, 0.3})
    {
      const auto points = [&](double t) { return Eigen::Matrix3Xd(Eigen::Vector3d(1.0, command.at(t), 2.0)); };
      PointGuideBuffer buffer(lateOptions(live), points(0.0));
      double x0 = 0.0, x1 = 0.0, x2 = 0.0, worst = 0.0;
      int sent = 0;
      for (int n = 1; n * kStep < 6.0; ++n)
      {
        for (; sent * kInterval + late <= (n - 1) * kStep + 1e-9; ++sent)
          EXPECT_TRUE(buffer.push(sent * kInterval, points(sent * kInterval)));
        x0 = x1, x1 = x2, x2 = buffer.target(n * kStep)(1, 0);
        worst = std::max(worst, std::abs(secondDifference(x0, x1, x2)));
      }
      EXPECT_LE(worst, 1.5 * most) << late;
      EXPECT_NEAR(x2, command.at(6.0 - kStep - buffer.timing().lag()), 1e-4) << late;
    }
}

// The clock skips (a pause, or a node that is too slow): what stood still catches up without a jump.
TEST(LateGuides, SkippedTime)
{
  const Command command;
  GuideBuffer buffer(lateOptions(true), Attach::section, command.pose(0.0));
  double time = 0.0, skipped = 0.0;
  int sent = 0;
  Eigen::Vector3d before = command.pose(0.0).position;
  double fastest = 0.0;
  for (int n = 1; n < 800; ++n)
  {
    if (n == 300)
    {
      buffer.skip(0.37);
      skipped = 0.37;
    }
    for (; sent * kInterval <= time + skipped; ++sent)
      buffer.push(sent * kInterval, command.pose(sent * kInterval));
    time += kStep;
    const Eigen::Vector3d now = buffer.target(time + skipped).X_WG.position;
    fastest = std::max(fastest, (now - before).norm() / kStep);
    before = now;
  }
  // 0.2 m at 1 Hz: 1.3 m/s, and what catching up with at most 0.4 m adds at a mean of 1 m/s, 1.5 times that at most
  EXPECT_LT(fastest, 1.3 + 1.6);
  EXPECT_NEAR(before.x(), command.at(time + skipped - buffer.timing().lag()), 1e-4);
}

}   // namespace
}   // namespace slender
