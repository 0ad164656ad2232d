#pragma once

#include <cstddef>
#include <vector>

#include "slender_sim/geometry/pose.h"
#include "slender_sim/geometry/sampled_motion.h"

namespace slender {

/// A rigid motion through timed poses, once continuously differentiable in position and orientation.
///
/// Positions: cubic Hermite segments whose slopes are the three-point (non-uniform) finite differences of the samples.
/// Orientations: the same on rotation vectors, each segment R(t) = R_k exp(phi(t)), with phi cubic Hermite from 0 to
/// log(R_k^T R_{k+1}) and angular velocities at the samples by the three-point difference. Outside the samples the end
/// pose is held with zero velocity. The slopes of the first and last sample are therefore zero, unless cutWithin() says
/// that the samples are a part of a longer motion. Sparse (10..60 Hz) and jittery input thus reaches the rod without
/// jumps of velocity. The three-point slope has two exceptions. Beside a sample with the same value the slope is zero,
/// so that a pause stays a pause; each coordinate pauses on its own, unless expectMore() says that more samples come,
/// because measured coordinates repeat by chance. Where one interval is shorter than a quarter of the other (a burst of
/// late messages), the slope is that of the chord over both intervals, because noise of this chord does not grow as the
/// interval gets short. Two equal samples on both sides of the turning point of a swing are not a pause: the
/// accelerations before, at and after them then agree to within a third. q and -q are the same orientation. Between two
/// samples the rotation takes the shorter way, so each half turn needs more than one sample.
class PoseTrajectory : public SampledMotion<Pose>
{
public:
  PoseTrajectory() = default;
  /// times [s] strictly increasing, as many as poses, at least one; throws std::invalid_argument otherwise.
  /// Orientations are normalised; a zero quaternion or a number that is not finite throws as well.
  PoseTrajectory(std::vector<double> times, std::vector<Pose> poses);

  /// Appends a later sample; throws std::invalid_argument when time is not after the last one.
  void append(double time, const Pose& pose);

  double firstTime() const { return times_.front(); }
  double lastTime() const { return times_.back(); }
  /// The samples that were given and not forgotten.
  const std::vector<Pose>& poses() const { return samples_; }
  std::size_t size() const { return times_.size(); }

  /// Pose and velocity at `time`; not empty.
  Pose evaluate(double time, Twist* velocity = nullptr) const;

private:
  /// Velocity of sample k by differences: linear in world axes, angular in the axes of the sample itself.
  Twist slopeAt(std::size_t k) const;
};

}   // namespace slender
