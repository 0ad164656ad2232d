#pragma once

#include <optional>

#include <Eigen/Core>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/node/guide_buffer.h"

namespace slender {

/// Turns a stream of stamped guide vertices into a motion of the guide that never jumps in position or velocity. The method
/// is that of GuideBuffer, with PointTrajectory between the samples. All points catch up within the same time, and the mean
/// speed of catching up is about `catch_up_speed` at most.
class PointGuideBuffer
{
public:
  /// `points` are the present positions of the guide's vertices, 3 x n [m]. The option `catch_up_turning` has no effect.
  PointGuideBuffer(const GuideBuffer::Options& options, const Eigen::Matrix3Xd& points);

  /// Adds the points at `time` [s]. Returns false and changes nothing when `time` is not later than the last one. Throws
  /// std::invalid_argument when the number of points differs or a coordinate is not finite.
  bool push(double time, const Eigen::Matrix3Xd& points);

  /// Where the guide is at simulated `time` [s]; times of successive calls do not decrease.
  const Eigen::Matrix3Xd& target(double time);

  /// The guide has been moved to `points`. It then catches up with the stream from there.
  void attachAt(const Eigen::Matrix3Xd& points);
  /// Forgets all samples and stays at `points`.
  void restart(const Eigen::Matrix3Xd& points);
  /// The simulated clock skipped `seconds` while the guide stood still. The guide then catches up.
  void skip(double seconds);

  /// Stamp of the last message [s], if there is any.
  std::optional<double> lastTime() const { return last_stamp_; }
  const GuideTiming& timing() const { return timing_; }

private:
  void begin(double time, const GuideTiming::Instant& now);
  void follow(double query, double rate, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const;
  void addOffset(double time, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const;
  void blendFrom(double time);

  GuideBuffer::Options options_;
  GuideTiming timing_;
  PointTrajectory trajectory_;
  std::optional<PointTrajectory> next_;      // of a new stream that has not taken effect yet
  std::optional<double> last_stamp_;         // [s] of the last message
  bool following_ = false;                   // samples have taken effect
  bool changed_ = false;                     // the trajectory changed since the last query
  bool open_ = false;                        // the end of the trajectory is extrapolated
  std::optional<double> last_time_;          // [s] simulated time of the last query
  double query_ = 0.0, rate_ = 1.0;          // [s] instant of the trajectory at last_time_, and its rate
  Eigen::Matrix3Xd plain_x_, plain_v_;       // motion without an offset at last_time_; empty when it is not known
  Eigen::Matrix3Xd x_, v_;                   // last output
  double offset_start_ = 0.0, offset_duration_ = 0.0, offset_rate_duration_ = 0.0;   // [s]; no offset while the duration is 0
  Eigen::Matrix3Xd offset_, offset_rate_;    // [m], [m/s] at the start
};

}  // namespace slender
