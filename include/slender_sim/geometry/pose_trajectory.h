#pragma once

#include <cstddef>
#include <vector>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// A rigid motion through timed poses, once continuously differentiable in position and orientation.
///
/// Positions: cubic Hermite segments whose slopes are the three-point (non-uniform) finite differences of the samples.
/// Orientations: the same on rotation vectors, each segment R(t) = R_k exp(phi(t)), with phi cubic Hermite from 0 to
/// log(R_k^T R_{k+1}) and angular velocities at the samples by the three-point difference. Outside the samples the end
/// pose is held with zero velocity, so the slopes of the first and last sample are zero, unless the motion is said to
/// be cut out of a longer one (cutWithin()). Sparse (10..60 Hz) and jittery input so reaches the rod without jumps of
/// velocity. Two exceptions to the three-point slope: beside a sample with the same value it is zero, so that a pause
/// stays a pause, and where one interval is under a quarter of the other (a burst of late messages) it is the chord
/// over both, whose noise does not grow with the shortness of the interval. Two equal samples are no pause when they
/// lie on both sides of the turning point of a swing: the acceleration before, at and after them is then the same to
/// within a third. q and -q are the same orientation; between samples the turn is the shorter one, so turns must be
/// sampled more often than every half turn.
class PoseTrajectory
{
public:
  PoseTrajectory() = default;
  /// times [s] strictly increasing, as many as poses, at least one; throws std::invalid_argument otherwise.
  /// Orientations are normalised; a zero quaternion or a number that is not finite throws as well.
  PoseTrajectory(std::vector<double> times, std::vector<Pose> poses);

  /// Appends a later sample; throws std::invalid_argument when time is not after the last one.
  void append(double time, const Pose& pose);
  /// After the last sample the motion goes on with the mean velocity since the one before, which dies out linearly
  /// within `duration` [s] (>= 0; 0: held).
  void coast(double duration) { coast_ = duration; }
  /// From now on more samples may come: two equal ones at the end may be the turning point of a swing, and are no pause
  /// yet.
  void expectMore() { growing_ = true; }
  /// The samples may begin and end in the middle of a motion. An end whose interval is shorter than `interval` [s] then
  /// has the slope of the parabola through the three samples there, or that of its neighbour if that is less (0: the
  /// ends are at rest). Outside of the samples the pose is held all the same: a query there sees a jump in velocity.
  void cutWithin(double interval) { cut_ = interval; }
  /// Forgets samples that no query at or after `time` needs.
  void forgetBefore(double time);

  bool empty() const { return times_.empty(); }
  double firstTime() const { return times_.front(); }
  double lastTime() const { return times_.back(); }
  /// The samples that were given and not forgotten.
  const std::vector<double>& times() const { return times_; }
  const std::vector<Pose>& poses() const { return poses_; }
  std::size_t size() const { return times_.size(); }

  /// Pose and velocity at `time`; not empty.
  Pose evaluate(double time, Twist* velocity = nullptr) const;

private:
  /// Velocity of sample k by differences: linear in world axes, angular in the axes of the sample itself.
  Twist slope(std::size_t k) const;
  /// The same of the first or the last sample of a motion that was cut there.
  Twist endSlope(std::size_t k) const;

  std::vector<double> times_;
  std::vector<Pose> poses_;
  double coast_ = 0.0, cut_ = 0.0;
  bool growing_ = false;   ///< see expectMore()
};

}   // namespace slender
