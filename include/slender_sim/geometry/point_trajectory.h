#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace slender {

/// A motion of several points through timed frames, once continuously differentiable: each point as the positions of
/// PoseTrajectory (cubic Hermite with three-point slopes; held with zero velocity before the first and after the last
/// frame, unless it coasts or starts in motion).
class PointTrajectory
{
public:
  PointTrajectory() = default;
  /// times [s] strictly increasing, as many as frames (3 x n [m], all the same n), at least one; throws
  /// std::invalid_argument naming the frame otherwise.
  PointTrajectory(const std::vector<double>& times, const std::vector<Eigen::Matrix3Xd>& frames);

  /// Appends a later frame; throws std::invalid_argument when time is not after the last one, sizes differ or a number
  /// is not finite.
  void append(double time, const Eigen::Matrix3Xd& points);
  /// After the last frame the points go on with the mean velocity since the one before, which dies out linearly within
  /// `duration` [s] (>= 0; 0: held).
  void coast(double duration) { coast_ = duration; }
  /// The slope at the first frame is that of the parabola through the first three (of two frames: their chord), and not
  /// zero: of a motion that was under way when it was sampled. Before that frame points are held all the same, so that
  /// a query there sees a jump in velocity.
  void startInMotion() { moving_start_ = true; }
  /// Does the same as PoseTrajectory::cutWithin().
  void cutWithin(double interval) { cut_ = interval; }
  /// From now on more frames may come: two equal ones at the end may be the turning point of a swing, and are no pause
  /// yet.
  void expectMore() { growing_ = true; }
  /// Forgets frames that no query at or after `time` needs.
  void forgetBefore(double time);

  bool empty() const { return times_.empty(); }
  const std::vector<double>& times() const { return times_; }
  const std::vector<Eigen::Matrix3Xd>& frames() const { return frames_; }

  /// Points (3 x n [m]) and velocities [m/s] at `time`; not empty.
  void evaluate(double time, Eigen::Matrix3Xd& points, Eigen::Matrix3Xd* velocities = nullptr) const;

private:
  Eigen::Vector3d slope(std::size_t frame, Eigen::Index point) const;
  /// Mean velocity since the frame before.
  Eigen::Vector3d chord(std::size_t frame, Eigen::Index point) const;

  std::vector<double> times_;
  std::vector<Eigen::Matrix3Xd> frames_;
  double coast_ = 0.0, cut_ = 0.0;
  bool moving_start_ = false;
  bool growing_ = false;   ///< see expectMore()
};

}   // namespace slender
