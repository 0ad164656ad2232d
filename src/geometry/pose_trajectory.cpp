#include "slender_sim/geometry/pose_trajectory.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "hermite.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

constexpr double same_position = 0.0;        // [m] only a sample that truly repeats counts as a pause
constexpr double same_orientation = 1e-12;   // [rad] round-off of q^-1 q

void checkSample(double time, const Pose& pose)
{
  if (!std::isfinite(time) || !pose.position.allFinite() || !pose.orientation.coeffs().allFinite())
  {
    throw std::invalid_argument(
        "pose trajectory: time, position or orientation is not finite at t = " + std::to_string(time) + " s");
  }
  if (!(pose.orientation.norm() > 1e-6))
  {
    throw std::invalid_argument("pose trajectory: the orientation at t = " + std::to_string(time) +
                                " s has length 0; it must be a unit quaternion");
  }
}

}   // namespace

PoseTrajectory::PoseTrajectory(std::vector<double> times, std::vector<Pose> poses)
{
  if (times.empty() || times.size() != poses.size())
  {
    throw std::invalid_argument("pose trajectory: " + std::to_string(times.size()) + " times and " +
                                std::to_string(poses.size()) + " poses; needs as many of both, at least one");
  }
  times_.reserve(times.size());
  poses_.reserve(times.size());
  for (std::size_t k = 0; k < times.size(); ++k)
    append(times[k], poses[k]);
}

void PoseTrajectory::append(double time, const Pose& pose)
{
  checkSample(time, pose);
  if (!times_.empty() && !(time > times_.back()))
  {
    throw std::invalid_argument("pose trajectory: time " + std::to_string(time) + " s is not after " +
                                std::to_string(times_.back()) + " s; times must increase");
  }
  times_.push_back(time);
  poses_.push_back({pose.position, pose.orientation.normalized()});
}

void PoseTrajectory::forgetBefore(double time)
{
  // The segment of `time` starts at the last sample not after it. The slope there needs one sample more, and up to
  // three where it may be in a pause.
  const auto after = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin();
  const auto drop = std::max<std::ptrdiff_t>(0, after - 4);
  times_.erase(times_.begin(), times_.begin() + drop);
  poses_.erase(poses_.begin(), poses_.begin() + drop);
}

Twist PoseTrajectory::slope(std::size_t k) const
{
  if (k > 0 && k + 1 == times_.size() && coast_ > 0)
  {
    const double h = times_[k] - times_[k - 1];
    return {(poses_[k].position - poses_[k - 1].position) / h,
            rotationVector(poses_[k - 1].orientation.conjugate() * poses_[k].orientation) / h};
  }
  if (k == 0 || k + 1 >= times_.size())
    return isCut(times_, k, cut_) ? endSlope(k) : Twist();   // at rest if the pose is held beyond the end
  const double h0 = times_[k] - times_[k - 1], h1 = times_[k + 1] - times_[k];
  const Eigen::Quaterniond back = poses_[k].orientation.conjugate();
  const auto shift = [this](std::size_t j) { return Eigen::Vector3d(poses_[j].position - poses_[j - 1].position); };
  const auto turn = [this](std::size_t j) {
    return rotationVector(poses_[j - 1].orientation.conjugate() * poses_[j].orientation);
  };
  Twist slope;
  if (!pausesAt(times_, k, growing_, same_position, shift))
  {
    slope.linear = threePointSlope(h0, poses_[k - 1].position - poses_[k].position, h1,
                                   poses_[k + 1].position - poses_[k].position);
  }
  if (!pausesAt(times_, k, growing_, same_orientation, turn))
  {
    slope.angular = threePointSlope(h0, rotationVector(back * poses_[k - 1].orientation), h1,
                                    rotationVector(back * poses_[k + 1].orientation));
  }
  return slope;
}

Twist PoseTrajectory::endSlope(std::size_t k) const
{
  const std::size_t first = k == 0 ? 0 : k - 1, second = first + 1, beside = k == 0 ? 1 : k - 1;
  const double h = times_[second] - times_[first];
  const Pose &a = poses_[first], &b = poses_[second];
  const Twist next = slope(beside);
  // The angular slope is in the axes of the sample. The rotation from a to b has the same vector in the axes of both.
  const Eigen::Vector3d turn = rotationVector(a.orientation.conjugate() * b.orientation) / h;
  return {cutSlope((b.position - a.position) / h, next.linear), cutSlope(turn, next.angular)};
}

Pose PoseTrajectory::evaluate(double time, Twist* velocity) const
{
  if (time <= times_.front() || time >= times_.back() || times_.size() == 1)
  {
    if (velocity)
      *velocity = {};
    if (time < times_.back() || times_.size() == 1 || !(coast_ > 0))
      return time <= times_.front() ? poses_.front() : poses_.back();
    const double after = std::min(time - times_.back(), coast_), way = after * (1.0 - 0.5 * after / coast_),
                 speed = 1.0 - after / coast_;
    const Twist last = slope(times_.size() - 1);   // the turn about a fixed axis: body and world rates agree
    const Pose& end = poses_.back();
    if (velocity)
    {
      velocity->linear = speed * last.linear;
      velocity->angular = end.orientation * (speed * last.angular);
    }
    return {end.position + way * last.linear, (end.orientation * fromRotationVector(way * last.angular)).normalized()};
  }
  const std::size_t k = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin() - 1;
  const double h = times_[k + 1] - times_[k];
  const double s = (time - times_[k]) / h;
  const Twist from = slope(k), to = slope(k + 1);

  const HermiteWeights w(s, h);
  const Pose& a = poses_[k];
  const Pose& b = poses_[k + 1];
  const Eigen::Vector3d whole = rotationVector(a.orientation.conjugate() * b.orientation);
  const Eigen::Vector3d rate0 = from.angular;   // phi' = body rate where phi = 0
  const Eigen::Vector3d rate1 = rotationRate(-whole).inverse() * to.angular;
  const Eigen::Vector3d phi = w.h01 * whole + w.h10 * rate0 + w.h11 * rate1;

  Pose pose;
  pose.position = a.position + w.h01 * (b.position - a.position) + w.h10 * from.linear + w.h11 * to.linear;
  pose.orientation = (a.orientation * fromRotationVector(phi)).normalized();
  if (velocity)
  {
    velocity->linear = w.d01 * (b.position - a.position) + w.d10 * from.linear + w.d11 * to.linear;
    velocity->angular = pose.orientation * (rotationRate(-phi) * (w.d01 * whole + w.d10 * rate0 + w.d11 * rate1));
  }
  return pose;
}

}   // namespace slender
