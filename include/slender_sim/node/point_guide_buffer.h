#pragma once

#include <Eigen/Core>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/node/guide_buffer.h"

namespace slender {

/// Positions of points and their velocities, 3 x n.
struct PointMotion
{
  Eigen::Matrix3Xd x, v;
  /// Compares without a tolerance.
  bool operator==(const PointMotion& other) const { return x == other.x && v == other.v; }
};

/// Turns a stream of stamped guide vertices into a motion of the guide that never jumps in position or velocity. The
/// method is that of GuideBuffer, with PointTrajectory between the samples. All points catch up within the same time,
/// and the mean speed of catching up is about `catch_up_speed` at most.
class PointGuideBuffer : public GuideStream<PointTrajectory, PointMotion>
{
public:
  /// `points` are the present positions of the guide's vertices, 3 x n [m]. The option `catch_up_turning` has no
  /// effect.
  PointGuideBuffer(const GuideBuffer::Options& options, const Eigen::Matrix3Xd& points);

  /// Adds the points at `time` [s]. Returns false and changes nothing when `time` is not later than the last one.
  /// Throws std::invalid_argument when the number of points differs or a coordinate is not finite.
  bool push(double time, const Eigen::Matrix3Xd& points);

  /// Where the guide is at simulated `time` [s]; times of successive calls do not decrease.
  const Eigen::Matrix3Xd& target(double time);

  /// The guide has been moved to `points`. It then catches up with the stream from there.
  void attachAt(const Eigen::Matrix3Xd& points);
  /// Forgets all samples and stays at `points`.
  void restart(const Eigen::Matrix3Xd& points);

private:
  void join(double start) override;
  void follow(double query, double rate, PointMotion& motion) const override;
  void addOffset(double time, PointMotion& motion) const override;
  void blend(double time, const PointMotion& from, const PointMotion& to) override;

  GuideBuffer::Options options_;
  PointMotion offset_;   // when it began
};

}   // namespace slender
