#pragma once

#include <vector>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// A rigid motion through timed poses, once continuously differentiable in position and orientation.
///
/// Positions: cubic Hermite segments whose slopes are the three-point (non-uniform) finite differences of the samples.
/// Orientations: the same on rotation vectors, each segment R(t) = R_k exp(phi(t)), with phi cubic Hermite from 0 to
/// log(R_k^T R_{k+1}) and angular velocities at the samples by the three-point difference. Outside the samples the end pose
/// is held with zero velocity. Sparse (10..60 Hz) and jittery input so reaches the rod without jumps of velocity.
class PoseTrajectory
{
public:
  PoseTrajectory() = default;
  /// times [s] strictly increasing, as many as poses, at least one; throws std::invalid_argument otherwise.
  PoseTrajectory(std::vector<double> times, std::vector<Pose> poses);

  /// Appends a later sample; throws std::invalid_argument when time is not after the last one.
  void append(double time, const Pose& pose);
  /// Forgets samples that no query at or after `time` needs.
  void forgetBefore(double time);

  bool empty() const { return times_.empty(); }
  double firstTime() const { return times_.front(); }
  double lastTime() const { return times_.back(); }

  /// Pose and velocity at `time`; not empty.
  Pose evaluate(double time, Twist* velocity = nullptr) const;

private:
  std::vector<double> times_;
  std::vector<Pose> poses_;
};

}  // namespace slender
