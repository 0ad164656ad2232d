#pragma once

#include <Eigen/Core>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/node/guide_buffer.h"

namespace slender {

/// Turns a stream of stamped guide vertices into a motion of the guide that never jumps in position or velocity. The
/// method is that of GuideBuffer, with PointTrajectory between the samples. All points catch up within the same time,
/// and the mean speed of catching up is about `catch_up_speed` at most.
class PointGuideBuffer : public GuideStream<PointTrajectory>
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
  void forgetPlain() override;
  void rejoin(double time) override;
  void output(double time) override;
  void follow(double query, double rate, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const;
  void addOffset(double time, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const;

  GuideBuffer::Options options_;
  Eigen::Matrix3Xd plain_x_, plain_v_;      // motion without an offset at last_time_; empty when it is not known
  Eigen::Matrix3Xd x_, v_;                  // last output
  Eigen::Matrix3Xd offset_, offset_rate_;   // [m], [m/s] at the start
};

}   // namespace slender
