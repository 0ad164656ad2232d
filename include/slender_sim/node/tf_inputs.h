#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <ros/time.h>
#include <tf2_ros/buffer.h>

#include "slender_sim/geometry/pose.h"
#include "slender_sim/node/drop_counter.h"
#include "slender_sim/node/node_options.h"
#include "slender_sim/node/sim_clock.h"

namespace slender {

/// Lets objects follow frames of tf. Before each step the frames are looked up, and new poses are passed to their
/// followers like poses of messages.
///
/// Method. The pose of a frame is taken at the newest stamp of the frame. The followers thus receive the samples of the
/// publisher, and not points of tf's linear interpolation between the samples. If tf knows the frame beyond the step (a
/// planned motion, or a node slower than real time), or if the frame is static, the pose is taken at the time of the
/// step, a few times per `~guide_delay`. Each frame is looked up on its own, so that a missing frame does not delay the
/// others. GuideInputs gives all inputs the same lag.
class TfInputs
{
public:
  /// Receives the pose of a frame in ~frame_id at `time` [s] of the clock. Returns false if this time is not later than
  /// that of the last pose.
  using Sink = std::function<bool(double time, const Pose& X_WF)>;

  /// `own` are the frames that this node broadcasts. All references must outlive this object.
  TfInputs(const NodeOptions& options, const SimClock& clock, const tf2_ros::Buffer& tf, DropCounter& drops,
           std::set<std::string> own);

  /// Lets `sink` follow a frame. `who` is the name of the follower for messages, for example "grasp left".
  void follow(const std::string& frame, const std::string& who, Sink sink);
  bool any() const { return !frames_.empty(); }

  /// Passes new poses to the followers. Call it before each step.
  void look();
  /// Passes no more poses. Call it if recorded inputs replace tf.
  void stop() { stopped_ = true; }
  /// Passes the present poses again. Call it after a reset of the scene.
  void restart();

  struct State
  {
    std::string frame, who;
    bool heard;        ///< a pose came since the start or the last reset
    bool stale;        ///< the newest pose is older than ~guide_timeout
    std::string why;   ///< reason why there is no newer pose; empty: no problem
  };
  std::vector<State> states() const;

private:
  struct Follower
  {
    std::string who;
    Sink sink;
  };
  struct Frame
  {
    std::string name;
    std::vector<Follower> followers;
    std::optional<double> last;   // [s] time of the last pose that was passed on
    std::string why;
    bool stale = false;
    bool checked = false;   // warnOfLoop() was called
  };

  std::optional<ros::Time> newest(Frame& frame) const;
  void lookAt(Frame& frame);
  void warnOfLoop(Frame& frame) const;

  const NodeOptions& options_;
  const SimClock& clock_;
  const tf2_ros::Buffer& tf_;
  DropCounter& drops_;
  std::set<std::string> own_;
  std::vector<Frame> frames_;
  bool stopped_ = false;
};

}   // namespace slender
