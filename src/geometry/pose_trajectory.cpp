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
  samples_.reserve(times.size());
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
  samples_.push_back({pose.position, pose.orientation.normalized()});
}

Twist PoseTrajectory::slopeAt(std::size_t k) const
{
  const auto shift = [this](std::size_t a, std::size_t b) -> Eigen::Vector3d {
    return samples_[b].position - samples_[a].position;
  };
  const auto turn = [this](std::size_t a, std::size_t b) {
    return rotationVector(samples_[a].orientation.conjugate() * samples_[b].orientation);
  };
  Eigen::Vector3d linear = slope(k, same_position, shift);
  for (int axis = 0; axis < 3 && !growing_; ++axis)
    linear[axis] = slope(k, same_position, [&](std::size_t a, std::size_t b) {
      return Eigen::Vector3d(shift(a, b)[axis] * Eigen::Vector3d::Unit(axis));
    })[axis];
  return {linear, slope(k, same_orientation, turn)};
}

Pose PoseTrajectory::evaluate(double time, Twist* velocity) const
{
  if (time <= times_.front() || time >= times_.back() || times_.size() == 1)
  {
    if (velocity)
      *velocity = {};
    if (time < times_.back() || times_.size() == 1 || !(coast_ > 0))
      return time <= times_.front() ? samples_.front() : samples_.back();
    const double after = std::min(time - times_.back(), coast_), way = after * (1.0 - 0.5 * after / coast_),
                 speed = 1.0 - after / coast_;
    const Twist last = slopeAt(times_.size() - 1);   // the turn about a fixed axis: body and world rates agree
    const Pose& end = samples_.back();
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
  const Twist from = slopeAt(k), to = slopeAt(k + 1);

  const HermiteWeights w(s, h);
  const Pose& a = samples_[k];
  const Pose& b = samples_[k + 1];
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
