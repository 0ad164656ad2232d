#pragma once

#include <optional>

#include <Eigen/Core>

#include "slender_sim/geometry/point_trajectory.h"
#include "slender_sim/node/guide_buffer.h"

namespace slender {

/// Turns a stream of stamped guide vertices into a motion of the guide that never jumps in position or velocity: as GuideBuffer does for
/// poses, with PointTrajectory in between. All points catch up within the same time, at no more than about catch_up_speed on average.
class PointGuideBuffer
{
public:
  /// `points`: where the guide is now (3 x n [m]). Takes all options but catch_up_turning.
  PointGuideBuffer(const GuideBuffer::Options& options, const Eigen::Matrix3Xd& points);

  /// Adds the points at `time` [s]; false when it is not later than the last one (nothing changes). Throws std::invalid_argument for another number of
  /// points, or what is not finite.
  bool push(double time, const Eigen::Matrix3Xd& points);

  /// Where the guide is at simulated `time` [s]; times of successive calls do not decrease.
  const Eigen::Matrix3Xd& target(double time);

  /// The guide was moved: it catches up from there.
  void attachAt(const Eigen::Matrix3Xd& points);
  /// Forgets all input and stays there.
  void restart(const Eigen::Matrix3Xd& points);
  /// The simulated clock skipped so many seconds while the guide stood still; it catches up.
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
  bool open_ = false;                        // its end is extrapolated
  std::optional<double> last_time_;          // [s] simulated, of the last query
  double query_ = 0.0, rate_ = 1.0;          // instant of the trajectory at last_time_, and how fast it passed
  Eigen::Matrix3Xd plain_x_, plain_v_;       // of the trajectory alone, then; empty: not known
  Eigen::Matrix3Xd x_, v_;                   // what was given to the solver last
  double offset_start_ = 0.0, offset_duration_ = 0.0, offset_rate_duration_ = 0.0;   // [s] simulated; duration 0: none
  Eigen::Matrix3Xd offset_, offset_rate_;    // [m], [m/s] at the start
};

}  // namespace slender
