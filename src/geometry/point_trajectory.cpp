#include "slender_sim/geometry/point_trajectory.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "hermite.h"

namespace slender {

PointTrajectory::PointTrajectory(const std::vector<double>& times, const std::vector<Eigen::Matrix3Xd>& frames)
{
  if (times.empty() || times.size() != frames.size())
    throw std::invalid_argument("point trajectory: " + std::to_string(times.size()) + " times and " +
                                std::to_string(frames.size()) + " frames; needs as many of both, at least one");
  for (std::size_t k = 0; k < times.size(); ++k)
    append(times[k], frames[k]);
}

void PointTrajectory::append(double time, const Eigen::Matrix3Xd& points)
{
  const std::string who = "frame " + std::to_string(times_.size()) + ": ";
  if (!std::isfinite(time) || !points.allFinite())
    throw std::invalid_argument(who + "time or a position is not finite");
  if (!times_.empty() && !(time > times_.back()))
    throw std::invalid_argument(who + "time " + std::to_string(time) + " s is not after " +
                                std::to_string(times_.back()) + " s");
  if (!frames_.empty() && points.cols() != frames_.front().cols())
    throw std::invalid_argument(who + "has " + std::to_string(points.cols()) + " points, " +
                                std::to_string(frames_.front().cols()) + " expected");
  times_.push_back(time);
  frames_.push_back(points);
}

void PointTrajectory::forgetBefore(double time)
{
  // The segment of `time` starts at the last frame not after it. The slope there needs one frame more, and up to three
  // where it may be in a pause.
  const auto after = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin();
  const auto drop = std::max<std::ptrdiff_t>(0, after - 4);
  times_.erase(times_.begin(), times_.begin() + drop);
  frames_.erase(frames_.begin(), frames_.begin() + drop);
}

Eigen::Vector3d PointTrajectory::chord(std::size_t k, Eigen::Index i) const
{
  return (frames_[k].col(i) - frames_[k - 1].col(i)) / (times_[k] - times_[k - 1]);
}

Eigen::Vector3d PointTrajectory::slope(std::size_t k, Eigen::Index i) const
{
  if (k > 0 && k + 1 == times_.size() && coast_ > 0)
    return chord(k, i);
  if (k == 0 && times_.size() == 2 && moving_start_)
    return chord(1, i);
  if (k == 0 && times_.size() > 2 && moving_start_)   // of the parabola through the first three frames, whose mean
                                                      // slope over the first two is the chord
  {
    const Eigen::Vector3d next = slope(1, i);
    return (times_[1] - times_[0]) * burst_ratio < times_[2] - times_[1] ? next
                                                                         : Eigen::Vector3d(2.0 * chord(1, i) - next);
  }
  if ((k == 0 || k + 1 >= times_.size()) && isCut(times_, k, cut_))
    return cutSlope(chord(k == 0 ? 1 : k, i), slope(k == 0 ? 1 : k - 1, i));
  if (k == 0 || k + 1 >= times_.size())
    return Eigen::Vector3d::Zero();   // held beyond the ends
  const auto shift = [this, i](std::size_t j) { return Eigen::Vector3d(frames_[j].col(i) - frames_[j - 1].col(i)); };
  if (pausesAt(times_, k, growing_, 0.0, shift))
    return Eigen::Vector3d::Zero();
  const Eigen::Vector3d here = frames_[k].col(i);
  return threePointSlope(times_[k] - times_[k - 1], frames_[k - 1].col(i) - here, times_[k + 1] - times_[k],
                         frames_[k + 1].col(i) - here);
}

void PointTrajectory::evaluate(double time, Eigen::Matrix3Xd& points, Eigen::Matrix3Xd* velocities) const
{
  const bool early = moving_start_ ? time < times_.front() : time <= times_.front();
  if (early || time >= times_.back() || times_.size() == 1)
  {
    points = time <= times_.front() ? frames_.front() : frames_.back();
    if (velocities)
      velocities->setZero(3, points.cols());
    if (time < times_.back() || times_.size() == 1 || !(coast_ > 0))
      return;
    const double after = std::min(time - times_.back(), coast_);
    for (Eigen::Index i = 0; i < points.cols(); ++i)
    {
      const Eigen::Vector3d v = slope(times_.size() - 1, i);
      points.col(i) += after * (1.0 - 0.5 * after / coast_) * v;
      if (velocities)
        velocities->col(i) = (1.0 - after / coast_) * v;
    }
    return;
  }
  const std::size_t k = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin() - 1;
  const double h = times_[k + 1] - times_[k];
  const HermiteWeights w((time - times_[k]) / h, h);
  points.resize(3, frames_[k].cols());
  if (velocities)
    velocities->resize(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i)
  {
    const Eigen::Vector3d a = frames_[k].col(i), whole = frames_[k + 1].col(i) - a, from = slope(k, i),
                          to = slope(k + 1, i);
    points.col(i) = a + w.h01 * whole + w.h10 * from + w.h11 * to;
    if (velocities)
      velocities->col(i) = w.d01 * whole + w.d10 * from + w.d11 * to;
  }
}

}   // namespace slender
