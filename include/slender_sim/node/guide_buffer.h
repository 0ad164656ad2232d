#pragma once

#include <optional>

#include "slender_sim/geometry/pose_trajectory.h"
#include "slender_sim/node/guide_stream.h"
#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/scene/config.h"

namespace slender {

/// A pose and its velocity.
struct GraspMotion
{
  Pose X;
  Twist V;
  /// Compares without a tolerance.
  bool operator==(const GraspMotion& other) const
  {
    return X.position == other.X.position && X.orientation.coeffs() == other.X.orientation.coeffs() &&
           V.linear == other.V.linear && V.angular == other.V.angular;
  }
};

/// Turns a stream of stamped poses of one gripper into a motion of its grasp that never jumps in position or velocity.
///
/// Method. Samples are joined by PoseTrajectory (C1 cubic Hermite in position and rotation vector) and evaluated at
/// simulated time minus a lag, so that sparse messages with jitter are interpolated and not extrapolated. GuideTiming
/// chooses the lag: it equals the delay while samples come in time and grows when they come later.
///
/// The trajectory can still change at the instant that was evaluated last: when input stopped during a motion and comes
/// back, when a live stream runs dry, or when the first sample or a new attachment is elsewhere. The difference in pose
/// and velocity between the last output and the changed trajectory then becomes an offset. A cubic Hermite polynomial
/// takes the offset to zero within a blending time, so the grasp catches up with continuous velocity and a mean speed
/// of about `catch_up_speed` at most. While samples come in time the offset is exactly zero.
class GuideBuffer : public GuideStream<PoseTrajectory, GraspMotion>
{
public:
  struct Options : GuideTiming::Options
  {
    double catch_up_time = 0.1;      ///< [s] > 0, shortest blending time
    double catch_up_speed = 1.0;     ///< [m/s] > 0, mean speed of catching up
    double catch_up_turning = 3.0;   ///< [rad/s] > 0, mean speed of catching up in orientation
  };

  /// `X_WG` is the present pose of the grasp in the world. With Attach::section samples are poses of the held section.
  /// With Attach::initial the offset between gripper and section is measured when the very first pose takes effect, and
  /// it stays the same after restart(). `X_HG` is the pose of the section in the gripper. If it is given, `attach` has
  /// no effect and the offset never changes.
  GuideBuffer(const Options& options, Attach attach, const Pose& X_WG, const std::optional<Pose>& X_HG = std::nullopt);

  /// Adds the gripper's pose in the world at `time` [s]; false when it is not later than the last one (nothing
  /// changes).
  bool push(double time, const Pose& X_WH);

  /// Pose and velocity of the grasp at simulated `time` [s]; times of successive calls do not decrease.
  GraspTarget target(double time);

  /// The grasp has been moved to X_WG. With Attach::initial it keeps its new offset to the gripper; with
  /// Attach::section it catches up with the gripper.
  void attachAt(const Pose& X_WG);
  /// Call it after the grasp has stood still at X_WG instead of following. The grasp keeps its offset to the gripper
  /// and catches up.
  void catchUpFrom(const Pose& X_WG);
  /// Forgets all samples and stays at X_WG. When poses come again, the grasp catches up with its very first offset:
  /// that before any attachAt().
  void restart(const Pose& X_WG);

  /// Pose of the grasp in the gripper's frame, if it was given or once the grasp follows. Identity before that, and
  /// with Attach::section.
  const Pose& graspInGripper() const { return X_HG_; }

private:
  struct Offset
  {
    Eigen::Vector3d p, p_rate, r, r_rate;   // position [m], rotation vector [rad], and rates, at its start
  };

  void join(double start) override;
  void follow(double query, double rate, GraspMotion& motion) const override;
  void addOffset(double time, GraspMotion& motion) const override;
  void blend(double time, const GraspMotion& from, const GraspMotion& to) override;

  Options options_;
  Attach attach_;
  Pose X_HG_;                        // grasp in the gripper, known once samples have taken effect
  std::optional<Pose> first_X_HG_;   // Attach::initial: the offset when the very first pose took effect
  bool held_anew_ = false;           // attachAt() was called since the start or since restart()
  Offset offset_;
};

}   // namespace slender
