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
  if (!samples_.empty() && points.cols() != samples_.front().cols())
    throw std::invalid_argument(who + "has " + std::to_string(points.cols()) + " points, " +
                                std::to_string(samples_.front().cols()) + " expected");
  times_.push_back(time);
  samples_.push_back(points);
}

Eigen::Vector3d PointTrajectory::slopeOf(std::size_t k, Eigen::Index i) const
{
  return slope(k, 0.0, [this, i](std::size_t a, std::size_t b) -> Eigen::Vector3d {
    return samples_[b].col(i) - samples_[a].col(i);
  });
}

void PointTrajectory::evaluate(double time, Eigen::Matrix3Xd& points, Eigen::Matrix3Xd* velocities) const
{
  const bool early = moving_start_ ? time < times_.front() : time <= times_.front();
  if (early || time >= times_.back() || times_.size() == 1)
  {
    points = time <= times_.front() ? samples_.front() : samples_.back();
    if (velocities)
      velocities->setZero(3, points.cols());
    if (time < times_.back() || times_.size() == 1 || !(coast_ > 0))
      return;
    const double after = std::min(time - times_.back(), coast_);
    for (Eigen::Index i = 0; i < points.cols(); ++i)
    {
      const Eigen::Vector3d v = slopeOf(times_.size() - 1, i);
      points.col(i) += after * (1.0 - 0.5 * after / coast_) * v;
      if (velocities)
        velocities->col(i) = (1.0 - after / coast_) * v;
    }
    return;
  }
  const std::size_t k = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin() - 1;
  const double h = times_[k + 1] - times_[k];
  const HermiteWeights w((time - times_[k]) / h, h);
  points.resize(3, samples_[k].cols());
  if (velocities)
    velocities->resize(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i)
  {
    const Eigen::Vector3d a = samples_[k].col(i), whole = samples_[k + 1].col(i) - a, from = slopeOf(k, i),
                          to = slopeOf(k + 1, i);
    points.col(i) = a + w.h01 * whole + w.h10 * from + w.h11 * to;
    if (velocities)
      velocities->col(i) = w.d01 * whole + w.d10 * from + w.d11 * to;
  }
}

}   // namespace slender
