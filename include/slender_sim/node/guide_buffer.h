#pragma once

#include <optional>

#include "slender_sim/geometry/pose_trajectory.h"
#include "slender_sim/node/guide_timing.h"
#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/scene/config.h"

namespace slender {

/// Turns a stream of stamped poses of one gripper into a motion of its grasp that never jumps in position or velocity.
///
/// Method. Samples are joined by PoseTrajectory (C1 cubic Hermite in position and rotation vector) and evaluated at simulated
/// time minus a lag, so that sparse, jittery messages are interpolated rather than extrapolated. GuideTiming chooses the lag: the delay while
/// samples come in time, more where they come later. Where the trajectory still changes under the grasp (input stopped at speed, and comes back; a live
/// stream runs dry; the first sample, or a new attachment, is elsewhere), the difference in pose and velocity between what was last given to the
/// solver and what the trajectory now says becomes an offset, which a cubic Hermite takes to zero within a blending time: the grasp catches up with
/// continuous velocity, at no more than about `catch_up_speed` on average. With timely input the offset is exactly zero.
class GuideBuffer
{
public:
  struct Options
  {
    double delay = 0.05;            ///< [s] >= 0; two sample intervals plus the transport time are enough; less, and the grasp lags by what is needed; 0: no lag, but jerks
    double catch_up_time = 0.1;     ///< [s] > 0, shortest blending time
    double catch_up_speed = 1.0;    ///< [m/s] > 0, mean speed of catching up
    double catch_up_turning = 3.0;  ///< [rad/s] > 0, mean speed of catching up in orientation
    double coast = 0.0;             ///< [s] >= 0 in which the speed dies out when no sample comes; 0: the last sample is held
    bool automatic = false;         ///< the delay is what the samples need, see GuideTiming
    bool live = false;              ///< samples come in real time, see GuideTiming

    GuideTiming::Options timing() const { return {delay, automatic, live, coast}; }
  };

  /// `X_WG`: where the grasp is now. attach section: samples are poses of the held section; initial: the offset between the
  /// gripper and the section when the gripper's first pose takes effect is kept.
  GuideBuffer(const Options& options, Attach attach, const Pose& X_WG);

  /// Adds the gripper's pose in the world at `time` [s]; false when it is not later than the last one (nothing changes).
  bool push(double time, const Pose& X_WH);

  /// Pose and velocity of the grasp at simulated `time` [s]; times of successive calls do not decrease.
  GraspTarget target(double time);

  /// The grasp took hold elsewhere: stays at X_WG (attach initial: keeps its new offset to the gripper; section: catches up).
  void attachAt(const Pose& X_WG);
  /// Forgets all samples and stays at X_WG.
  void restart(const Pose& X_WG);
  /// The simulated clock skipped so many seconds while the grasp stood still; it catches up.
  void skip(double seconds);

  /// Stamp of the last sample [s], if there is any.
  std::optional<double> lastTime() const { return last_stamp_; }
  const GuideTiming& timing() const { return timing_; }

  /// The grasp in the gripper's frame, once it follows; before, and with attach section, identity.
  const Pose& graspInGripper() const { return X_HG_; }

private:
  struct Motion
  {
    Pose X;
    Twist V;
  };
  struct Offset
  {
    double start = 0.0, duration = 0.0, rate_duration = 0.0;   // [s] of simulated time
    Eigen::Vector3d p, p_rate, r, r_rate;   // position [m], rotation vector [rad], and rates, at `start`
  };

  void begin(double time, const GuideTiming::Instant& now);
  bool passesHere() const;                  // the trajectory is at query_ still what it was, to the last bit
  Motion followed(double query, double rate) const;      // the grasp as the trajectory alone would have it
  Motion blended(double time, const Motion& followed) const;
  void blendFrom(double time, const Motion& from, const Motion& to);

  Options options_;
  Attach attach_;
  GuideTiming timing_;
  PoseTrajectory trajectory_;                // of the gripper X_WH
  std::optional<PoseTrajectory> next_;       // of a new stream that has not taken effect yet
  std::optional<double> last_stamp_;         // [s] of the last sample
  Pose X_HG_;                                // grasp in the gripper
  bool following_ = false;                   // samples have taken effect, X_HG_ is known
  bool changed_ = false;                     // the trajectory changed since the last query
  bool open_ = false;                        // its end is extrapolated
  std::optional<double> last_time_;          // [s] simulated, of the last query
  double query_ = 0.0, rate_ = 1.0;          // instant of the trajectory at last_time_, and how fast it passed
  Motion plain_;                             // of the trajectory alone, then
  Motion last_;                              // what was given to the solver last
  std::optional<Offset> offset_;
};

}  // namespace slender
