#include "slender_sim/geometry/pose_trajectory.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

constexpr double same_position = 0.0;        // [m] only a sample that truly repeats counts as a pause
constexpr double same_orientation = 1e-12;   // [rad] round-off of q^-1 q
constexpr double burst_ratio = 4.0;          // intervals more uneven than this are a burst, see the header

/// Slope at the middle of three samples; `before`, `after`: the neighbours' values minus its own.
Eigen::Vector3d threePointSlope(double h_before, const Eigen::Vector3d& before, double h_after, const Eigen::Vector3d& after,
                                double same)
{
  if (before.norm() <= same || after.norm() <= same)
  {
    return Eigen::Vector3d::Zero();
  }
  const double span = h_before + h_after;
  if (h_before * burst_ratio < h_after || h_after * burst_ratio < h_before)
  {
    return (after - before) / span;
  }
  return (h_before / (span * h_after)) * after - (h_after / (span * h_before)) * before;
}

void checkSample(double time, const Pose& pose)
{
  if (!std::isfinite(time) || !pose.position.allFinite() || !pose.orientation.coeffs().allFinite())
  {
    throw std::invalid_argument("pose trajectory: time, position or orientation is not finite at t = " + std::to_string(time) + " s");
  }
  if (!(pose.orientation.norm() > 1e-6))
  {
    throw std::invalid_argument("pose trajectory: the orientation at t = " + std::to_string(time) +
                                " s has length 0; it must be a unit quaternion");
  }
}

}  // namespace

PoseTrajectory::PoseTrajectory(std::vector<double> times, std::vector<Pose> poses)
{
  if (times.empty() || times.size() != poses.size())
  {
    throw std::invalid_argument("pose trajectory: " + std::to_string(times.size()) + " times and " + std::to_string(poses.size()) +
                                " poses; needs as many of both, at least one");
  }
  times_.reserve(times.size());
  poses_.reserve(times.size());
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    append(times[k], poses[k]);
  }
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
  // The segment of `time` starts at the last sample not after it, and the slope there needs one sample more.
  const auto after = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin();
  const auto drop = std::max<std::ptrdiff_t>(0, after - 2);
  times_.erase(times_.begin(), times_.begin() + drop);
  poses_.erase(poses_.begin(), poses_.begin() + drop);
}

Twist PoseTrajectory::slope(std::size_t k) const
{
  if (k == 0 || k + 1 >= times_.size())
  {
    return {};   // held beyond the ends
  }
  const double h0 = times_[k] - times_[k - 1], h1 = times_[k + 1] - times_[k];
  const Eigen::Quaterniond back = poses_[k].orientation.conjugate();
  Twist slope;
  slope.linear = threePointSlope(h0, poses_[k - 1].position - poses_[k].position, h1, poses_[k + 1].position - poses_[k].position,
                                 same_position);
  slope.angular = threePointSlope(h0, rotationVector(back * poses_[k - 1].orientation), h1, rotationVector(back * poses_[k + 1].orientation),
                                  same_orientation);
  return slope;
}

Pose PoseTrajectory::evaluate(double time, Twist* velocity) const
{
  if (time <= times_.front() || time >= times_.back() || times_.size() == 1)
  {
    if (velocity)
    {
      *velocity = {};
    }
    return time <= times_.front() ? poses_.front() : poses_.back();
  }
  const std::size_t k = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin() - 1;
  const double h = times_[k + 1] - times_[k];
  const double s = (time - times_[k]) / h;
  const Twist from = slope(k), to = slope(k + 1);

  // Cubic Hermite: value u(1) h01 + h (m0 h10 + m1 h11), with the start at zero.
  const double h01 = s * s * (3 - 2 * s), h10 = s * (1 - s) * (1 - s), h11 = s * s * (s - 1);
  const double d01 = 6 * s * (1 - s) / h, d10 = (1 - s) * (1 - 3 * s) / h, d11 = s * (3 * s - 2) / h;

  const Pose& a = poses_[k];
  const Pose& b = poses_[k + 1];
  const Eigen::Vector3d whole = rotationVector(a.orientation.conjugate() * b.orientation);
  const Eigen::Vector3d rate0 = from.angular;                                   // phi' = body rate where phi = 0
  const Eigen::Vector3d rate1 = rotationRate(-whole).inverse() * to.angular;
  const Eigen::Vector3d phi = h01 * whole + h * (h10 * rate0 + h11 * rate1);

  Pose pose;
  pose.position = a.position + h01 * (b.position - a.position) + h * (h10 * from.linear + h11 * to.linear);
  pose.orientation = (a.orientation * fromRotationVector(phi)).normalized();
  if (velocity)
  {
    velocity->linear = d01 * (b.position - a.position) + h * (d10 * from.linear + d11 * to.linear);
    velocity->angular = pose.orientation * (rotationRate(-phi) * (d01 * whole + h * (d10 * rate0 + d11 * rate1)));
  }
  return pose;
}

}  // namespace slender
