#include "slender_sim/geometry/pose_trajectory.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace slender {
namespace {

/// An uneven, noisy motion with samples as they come from a network: jitter of the stamps, random signs of the
/// quaternions.
PoseTrajectory jittery(int samples, unsigned seed)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> times;
  std::vector<Pose> poses;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (int k = 0; k < samples; ++k)
  {
    times.push_back(0.05 * k + 0.02 * uniform(random));
    q = q * Eigen::AngleAxisd(1.2 * uniform(random), Eigen::Vector3d(uniform(random), uniform(random), 1).normalized());
    Eigen::Quaterniond signed_q = q;
    if (uniform(random) < 0)
      signed_q.coeffs() *= -1;
    poses.push_back({Eigen::Vector3d(uniform(random), uniform(random), uniform(random)), signed_q});
  }
  return PoseTrajectory(times, poses);
}

double angleBetween(const Pose& a, const Pose& b) { return a.orientation.angularDistance(b.orientation); }

TEST(PoseTrajectory, passesThroughItsSamples)
{
  std::vector<double> times{0.1, 0.2, 0.45, 0.5};
  std::vector<Pose> poses;
  for (double t : times)
  {
    poses.push_back(
        {Eigen::Vector3d(t, t * t, 1), Eigen::Quaterniond(Eigen::AngleAxisd(5 * t, Eigen::Vector3d::UnitY()))});
  }
  const PoseTrajectory trajectory(times, poses);
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const Pose pose = trajectory.evaluate(times[k]);
    EXPECT_LT((pose.position - poses[k].position).norm(), 1e-15);
    EXPECT_LT(angleBetween(pose, poses[k]), 1e-7);   // angularDistance loses half the digits near zero
  }
}

TEST(PoseTrajectory, velocityIsTheDerivative)
{
  const PoseTrajectory trajectory = jittery(12, 1);
  const double h = 1e-6;
  double fastest = 0;
  for (double t = trajectory.firstTime() + 0.001; t < trajectory.lastTime(); t += 0.0037)
  {
    Twist velocity;
    const Pose pose = trajectory.evaluate(t, &velocity);
    const Pose before = trajectory.evaluate(t - h), after = trajectory.evaluate(t + h);
    const Eigen::Vector3d linear = (after.position - before.position) / (2 * h);
    const Eigen::AngleAxisd turn(after.orientation * before.orientation.conjugate());
    const double angle = turn.angle() > M_PI ? turn.angle() - 2 * M_PI : turn.angle();
    // Central differences: truncation h^2 f''' ~ 1e-12 * 1e6, round-off 1e-16 / h; a sample inside the stencil adds h
    // f'' ~ 1e-2.
    EXPECT_LT((velocity.linear - linear).norm(), 2e-2) << t;
    EXPECT_LT((velocity.angular - turn.axis() * angle / (2 * h)).norm(), 2e-2) << t;
    fastest = std::max(fastest, velocity.angular.norm());
    EXPECT_NEAR(pose.orientation.norm(), 1.0, 1e-14);
  }
  EXPECT_GT(fastest, 5.0);   // the motion does turn
}

TEST(PoseTrajectory, poseAndVelocityAreContinuousAtTheSamples)
{
  std::vector<double> times{0.0, 0.1, 0.13, 0.3, 0.33, 0.4};
  std::vector<Pose> poses;
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const Eigen::Vector3d axis = Eigen::Vector3d(std::sin(3.0 * k), std::cos(5.0 * k), 0.5).normalized();
    poses.push_back({axis, Eigen::Quaterniond(Eigen::AngleAxisd(1.3 * k, axis))});
  }
  const PoseTrajectory trajectory(times, poses);
  for (double t : times)
  {
    Twist left, right;
    const Pose a = trajectory.evaluate(t - 1e-12, &left), b = trajectory.evaluate(t + 1e-12, &right);
    // Accelerations reach 1e4 here, so 2e-12 s apart velocities differ by 2e-8.
    EXPECT_LT((left.linear - right.linear).norm(), 1e-7) << t;
    EXPECT_LT((left.angular - right.angular).norm(), 1e-7) << t;
    EXPECT_LT((a.position - b.position).norm(), 1e-9);
    EXPECT_LT(angleBetween(a, b), 1e-7);
  }
}

TEST(PoseTrajectory, holdsItsEndsAtRest)
{
  const PoseTrajectory trajectory = jittery(5, 2);
  for (double t :
       {trajectory.firstTime() - 1, trajectory.firstTime(), trajectory.lastTime(), trajectory.lastTime() + 1})
  {
    Twist velocity{Eigen::Vector3d::Ones(), Eigen::Vector3d::Ones()};
    const Pose pose = trajectory.evaluate(t, &velocity);
    const Pose end = trajectory.evaluate(t < 0.1 ? trajectory.firstTime() : trajectory.lastTime());
    EXPECT_EQ(velocity.linear.norm(), 0.0);
    EXPECT_EQ(velocity.angular.norm(), 0.0);
    EXPECT_EQ(pose.position, end.position);
  }
}

TEST(PoseTrajectory, signOfAQuaternionDoesNotMatter)
{
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()));
  const Eigen::Quaterniond minus_q(-q.w(), -q.x(), -q.y(), -q.z());
  const PoseTrajectory trajectory({0, 1, 2, 3},
                                  {{{0, 0, 0}, q}, {{1, 0, 0}, minus_q}, {{2, 0, 0}, q}, {{3, 0, 0}, minus_q}});
  for (double t = 0; t < 3; t += 0.1)
  {
    Twist velocity;
    EXPECT_LT(trajectory.evaluate(t, &velocity).orientation.angularDistance(q), 1e-7);
    EXPECT_LT(velocity.angular.norm(), 1e-12);
  }
}

TEST(PoseTrajectory, isExactForUniformMotionAwayFromTheEnds)
{
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
  std::vector<double> times{0, 0.1, 0.23, 0.3, 0.41, 0.5};
  std::vector<Pose> poses;
  for (double t : times)
    poses.push_back({Eigen::Vector3d(t, 2 * t - t * t, 0), Eigen::Quaterniond(Eigen::AngleAxisd(8 * t, axis))});
  const PoseTrajectory trajectory(times, poses);
  for (double t = 0.11; t < 0.4; t += 0.01)
  {
    Twist velocity;
    const Pose pose = trajectory.evaluate(t, &velocity);
    EXPECT_LT((velocity.angular - 8 * axis).norm(), 1e-10);
    EXPECT_LT((velocity.linear - Eigen::Vector3d(1, 2 - 2 * t, 0)).norm(), 1e-12);   // parabolas are reproduced
    EXPECT_LT((pose.position - Eigen::Vector3d(t, 2 * t - t * t, 0)).norm(), 1e-13);
  }
}

TEST(PoseTrajectory, aPauseStaysAPause)
{
  const Eigen::Quaterniond identity = Eigen::Quaterniond::Identity();
  const PoseTrajectory trajectory(
      {0, 1, 2, 3}, {{{0, 0, 0}, identity}, {{0, 0, 0}, identity}, {{1, 0, 0}, identity}, {{2, 0, 0}, identity}});
  for (double t = 0; t <= 1; t += 0.05)
    EXPECT_EQ(trajectory.evaluate(t).position.norm(), 0.0);
}

/// Greatest acceleration [m/s^2] along x, or about z [rad/s^2], by differences of the velocity over steps of a
/// millisecond.
double greatestAcceleration(const PoseTrajectory& trajectory, bool angular)
{
  constexpr double step = 1e-3;
  double greatest = 0.0;
  for (double t = trajectory.firstTime() + 0.5; t + step < trajectory.lastTime() - 0.5; t += step)
  {
    Twist a, b;
    trajectory.evaluate(t, &a);
    trajectory.evaluate(t + step, &b);
    greatest = std::max(greatest, (angular ? b.angular - a.angular : b.linear - a.linear).norm() / step);
  }
  return greatest;
}

TEST(PoseTrajectory, aSwingDoesNotPauseAtItsPeaks)
{
  // 100 samples a second. Where the peak lies in the middle between two samples, these are equal: at 2 Hz without a
  // phase every peak does. Each sample is the nearest float, as messages from elsewhere often are, so that equal
  // samples are equal to the last bit.
  double worst = 0.0;
  int equal = 0;
  for (const double frequency : {0.5, 1.0, 1.5, 2.0, 2.5, 3.0})
  {
    const double omega = 2.0 * M_PI * frequency;
    for (const double shift : {0.0, 0.0025, 0.005})   // [s]
    {
      std::vector<double> times;
      std::vector<Pose> poses;
      for (int k = 0; k < 400; ++k)
      {
        times.push_back(0.01 * k);
        const double x = static_cast<float>(0.2 * std::sin(omega * (0.01 * k + shift)));
        equal += !poses.empty() && poses.back().position.x() == x;
        poses.push_back(
            {Eigen::Vector3d(x, 0, 0), Eigen::Quaterniond(Eigen::AngleAxisd(3.0 * x, Eigen::Vector3d::UnitZ()))});
      }
      const PoseTrajectory trajectory(times, poses);
      const double commanded = 0.2 * omega * omega;
      worst = std::max({worst, greatestAcceleration(trajectory, false) / commanded,
                        greatestAcceleration(trajectory, true) / (3.0 * commanded)});
    }
  }
  EXPECT_GT(equal, 20);
  EXPECT_LT(worst, 1.5);   // the bar; cubics with three-point slopes have a few per cent more than the sine
}

TEST(PoseTrajectory, pausesDoNotOvershoot)
{
  // Waypoints with a hold of two samples or more, ways into it at constant speed, braking steadily until a sample and
  // in between, and smoothly.
  const std::vector<std::vector<double>> ways{{0, 1, 1, 0},
                                              {0, 1, 2, 2, 1, 0},
                                              {0, 1, 2, 3, 3, 4, 5},
                                              {-4.5, -2, -0.5, 0, 0, 0, -1},
                                              {-4, -2.5, -1, -0.25, 0, 0, -0.5, -3},
                                              {-8, -1, 0, 0, -1, -8},
                                              {-5, -3, -1, 0, 0, 0, -1, -3},
                                              {-6, -3, -1, 0, 0, 0.5, 0.5, 3},
                                              {-6, -3, -1, 0, 0}};
  for (const std::vector<double>& way : ways)
  {
    std::vector<double> times;
    std::vector<Pose> poses;
    for (std::size_t k = 0; k < way.size(); ++k)
    {
      times.push_back(0.1 * static_cast<double>(k));
      poses.push_back({Eigen::Vector3d(way[k], 0, 0),
                       Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * way[k], Eigen::Vector3d::UnitZ()))});
    }
    const PoseTrajectory trajectory(times, poses);
    for (std::size_t k = 0; k + 1 < way.size(); ++k)
    {
      for (double s = 0; s <= 1 && way[k] == way[k + 1]; s += 0.05)
      {
        const Pose pose = trajectory.evaluate(times[k] + 0.1 * s);
        EXPECT_EQ(pose.position.x(), way[k]) << "waypoint " << k << " of " << way.size();
        EXPECT_LT(angleBetween(pose, poses[k]), 1e-7);
      }
    }
  }
}

/// A table closes a gripper, waits, and lifts it: nothing leaves the range of the rows.
TEST(PoseTrajectory, eachCoordinatePausesOnItsOwn)
{
  const auto at = [](double x, double z) { return Pose{{x, 0.0, z}, Eigen::Quaterniond::Identity()}; };
  const PoseTrajectory trajectory({0.0, 1.0, 2.0}, {at(-0.06, 0.03), at(-0.035, 0.03), at(-0.035, 0.13)});
  for (double t = 0.0; t <= 2.0; t += 0.01)
  {
    const Eigen::Vector3d p = trajectory.evaluate(t).position;
    EXPECT_LE(p.x(), -0.035 + 1e-15) << t;
    EXPECT_GE(p.z(), 0.03 - 1e-15) << t;
  }
}

TEST(PoseTrajectory, aBurstOfSamplesDoesNotThrowThePoseAway)
{
  // Two samples 0.1 ms apart with 1 mm of noise between them would give a three-point slope of 10 m/s, and so an
  // overshoot of decimetres in the next 0.1 s.
  const Eigen::Quaterniond identity = Eigen::Quaterniond::Identity();
  const PoseTrajectory trajectory(
      {0, 0.1, 0.1001, 0.2},
      {{{0, 0, 0}, identity}, {{0.01, 0, 0}, identity}, {{0.011, 0, 0}, identity}, {{0.02, 0, 0}, identity}});
  for (double t = 0; t <= 0.2; t += 0.001)
    EXPECT_NEAR(trajectory.evaluate(t).position.x(), 0.1 * t, 0.004) << t;
}

TEST(PoseTrajectory, forgettingDoesNotChangeLaterPoses)
{
  const PoseTrajectory whole = jittery(40, 3);
  for (double from : {-1.0, 0.3, 0.777, 1.5, 5.0})
  {
    PoseTrajectory part = whole;
    part.forgetBefore(from);
    for (double t = from; t < whole.lastTime() + 0.1; t += 0.01)
    {
      Twist a, b;
      EXPECT_EQ(whole.evaluate(t, &a).position, part.evaluate(t, &b).position);
      EXPECT_EQ(a.angular, b.angular);
    }
  }
  PoseTrajectory part = whole;
  part.forgetBefore(1.5);
  EXPECT_LT(part.size(), whole.size() / 2);
}

TEST(PoseTrajectory, refusesBadSamples)
{
  const Pose pose;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(PoseTrajectory({}, {}), std::invalid_argument);
  EXPECT_THROW(PoseTrajectory({0, 1}, {pose}), std::invalid_argument);
  EXPECT_THROW(PoseTrajectory({0, 0}, {pose, pose}), std::invalid_argument);
  EXPECT_THROW(PoseTrajectory({1, 0}, {pose, pose}), std::invalid_argument);
  EXPECT_THROW(PoseTrajectory({nan}, {pose}), std::invalid_argument);
  EXPECT_THROW(PoseTrajectory({0}, {Pose{Eigen::Vector3d(nan, 0, 0), pose.orientation}}), std::invalid_argument);
  EXPECT_THROW(PoseTrajectory({0}, {Pose{pose.position, Eigen::Quaterniond(0, 0, 0, 0)}}), std::invalid_argument);
  PoseTrajectory trajectory({0, 1}, {pose, pose});
  EXPECT_THROW(trajectory.append(1, pose), std::invalid_argument);
  EXPECT_EQ(trajectory.size(), 2u);
}

}   // namespace
}   // namespace slender
