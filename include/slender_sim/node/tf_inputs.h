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

/// What follows frames of tf. Each step looks the frames up and hands new poses on, as if messages had brought them.
///
/// Method. The pose of a frame is taken at its newest stamp, so that what is handed on are the stamps that the
/// publisher of the frame gave, and not places between them on the straight lines by which tf joins poses. When tf
/// knows the frame beyond the step (a planned motion, or a node slower than real time), or at all times (a static
/// frame), the pose is taken at the step itself, a few times per `~guide_delay`. Frames are looked up one by one: one
/// that stops coming does not hold up the others. That all inputs are shown with one lag is up to GuideInputs.
class TfInputs
{
public:
  /// Takes the pose of a frame in ~frame_id at `time` [s] of the clock; false when it is not later than the last one.
  using Sink = std::function<bool(double time, const Pose& X_WF)>;

  /// `own`: frames that this node broadcasts. All references must outlive it.
  TfInputs(const NodeOptions& options, const SimClock& clock, const tf2_ros::Buffer& tf, DropCounter& drops,
           std::set<std::string> own);

  /// `who` follows the frame, for example "grasp left".
  void follow(const std::string& frame, const std::string& who, Sink sink);
  bool any() const { return !frames_.empty(); }

  /// Hands on what is new, before a step.
  void look();
  /// Poses are handed on no more: they come from a record.
  void stop() { stopped_ = true; }
  /// The scene was reset: the poses of the present count, too.
  void restart();

  struct State
  {
    std::string frame, who;
    bool heard;        ///< since the start or the reset
    std::string why;   ///< why there is no newer pose; empty: there is nothing to say
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
    std::optional<double> last;   // [s] of the pose that was handed on last
    std::string why;
    bool checked = false;   // for loops
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
