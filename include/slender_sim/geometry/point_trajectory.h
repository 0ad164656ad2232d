#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/sampled_motion.h"

namespace slender {

/// A motion of several points through timed frames, once continuously differentiable: each point as the positions of
/// PoseTrajectory (cubic Hermite with three-point slopes; held with zero velocity before the first and after the last
/// frame, unless it coasts or starts in motion).
class PointTrajectory : public SampledMotion<Eigen::Matrix3Xd>
{
public:
  PointTrajectory() = default;
  /// times [s] strictly increasing, as many as frames (3 x n [m], all the same n), at least one; throws
  /// std::invalid_argument naming the frame otherwise.
  PointTrajectory(const std::vector<double>& times, const std::vector<Eigen::Matrix3Xd>& frames);

  /// Appends a later frame; throws std::invalid_argument when time is not after the last one, sizes differ or a number
  /// is not finite.
  void append(double time, const Eigen::Matrix3Xd& points);
  /// The slope at the first frame is that of the parabola through the first three (of two frames: their chord), and not
  /// zero: of a motion that was under way when it was sampled. Before that frame points are held all the same, so that
  /// a query there sees a jump in velocity.
  void startInMotion() { moving_start_ = true; }

  const std::vector<Eigen::Matrix3Xd>& frames() const { return samples_; }

  /// Points (3 x n [m]) and velocities [m/s] at `time`; not empty.
  void evaluate(double time, Eigen::Matrix3Xd& points, Eigen::Matrix3Xd* velocities = nullptr) const;

private:
  Eigen::Vector3d slopeOf(std::size_t frame, Eigen::Index point) const;
};

}   // namespace slender
