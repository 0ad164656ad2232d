#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/buffer.h>

#include "slender_sim/BodyStates.h"
#include "slender_sim/node/drop_counter.h"
#include "slender_sim/node/guide_buffer.h"
#include "slender_sim/node/input_replay.h"
#include "slender_sim/node/message_intake.h"
#include "slender_sim/node/node_options.h"
#include "slender_sim/node/point_guide_buffer.h"
#include "slender_sim/node/sim_clock.h"
#include "slender_sim/node/tf_inputs.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Guides of tracked cloths and rods by message: `guide/points` (the guide's vertices or nodes in their order) and
/// `guide/bodies` (of the bodies that carry them), through tf2 into the node's frame; in scenes of several tracked
/// objects `tracked/NAME/guide/points`. A message is taken or dropped as a whole.
class TrackingInputs
{
public:
  /// Subscribes to the topics that the scene asks for. All references must outlive this object.
  TrackingInputs(ros::NodeHandle& nh, const NodeOptions& options, const GuideBuffer::Options& buffers,
                 const Simulation& simulation, const SimClock& clock, const tf2_ros::Buffer& tf, DropCounter& drops);

  bool any() const { return !guides_.empty(); }
  /// Takes over the inputs of objects that exist in both scenes. `before` are the inputs before an edit of the scene.
  void takeOver(TrackingInputs& before);
  /// Registers the guides that follow frames of tf.
  void followFrames(TfInputs& tf);
  /// Returns the largest lag [s] that a guide needs. Guides without recent messages do not count. See GuideTiming.
  double wantedLag() const;
  /// Sets a lower bound [s] of the lag of all guides.
  void lagAtLeast(double lag);
  void processPending() { intake_.processPending(); }
  bool waiting() const { return intake_.waiting(); }
  /// Sets the guides that are driven from outside to their places at `time` [s since the clock's start].
  void apply(double time, SceneInputs& inputs);
  /// Call it after a state was loaded, because all objects may have moved.
  void attachAll(const Simulation& simulation);
  /// Forgets all inputs. Call it after a reset of the scene.
  void restart(const Simulation& simulation);

  /// Call it after the clock skipped this time [s] while all objects stood still.
  void skip(double seconds);

  // These functions have the same meaning as in GuideInputs.
  void onPresent(std::function<ros::Time()> present) { intake_.onPresent(std::move(present)); }
  void takeKept(bool all) { intake_.takeKept(all); }
  void onTaken(InputSink sink) { sink_ = std::move(sink); }
  void stopListening() { subscribers_.clear(); }
  void repeat(const slender_sim::Input& input);

  /// State of the messages of a guide by points, or of one body of a guide.
  /// `seconds`: age of the last pose; nothing if none came. `missing`: no pose of this body came, but poses of other
  /// bodies of the same guide came. `lag`: lag of the guide [s]. `excess`: largest recent excess of the lag over
  /// ~guide_delay [s]. `interval`: time between messages [s].
  struct Age
  {
    std::string name;
    std::optional<double> seconds;
    bool missing;
    double lag, excess, interval;
    /// Returns by how much the transport of messages took longer than ~guide_delay [s]. Sparse messages that arrive at
    /// once are not late.
    double late() const { return excess - 2.0 * interval; }
  };
  /// Returns the age of an input. `buffer` is that of the input, and `now` [s] the time of the clock.
  template <class Buffer>
  static Age ageOf(const std::string& name, const Buffer& buffer, double now)
  {
    const std::optional<double> last = buffer.lastTime();
    const GuideTiming& timing = buffer.timing();
    return {name,
            last ? std::optional(now - *last) : std::nullopt,
            false,
            timing.lag(),
            timing.excess(),
            timing.interval()};
  }
  std::vector<Age> ages() const;

private:
  struct Guide
  {
    int index = 0;   // of the guides of the scene
    bool of_rod = false;
    std::string topic, object;                  // object: its name
    std::unique_ptr<PointGuideBuffer> points;   // by points
    const CarriedGuide* carried = nullptr;      // by bodies, one buffer each:
    std::vector<GuideBuffer> bodies;
    std::vector<Pose> poses;
    bool catches_up = true;       // from `held` at the next apply()
    Eigen::Matrix3Xd held, gap;   // by bodies: where it was, and what of the way is left
    double gap_start = 0.0, gap_duration = 0.0;
    bool heard() const;   // from any body
  };
  struct Message : FramedMessage   // its source is the index of the guide
  {
    Eigen::Matrix3Xd points{};   // in the message's frame
    std::vector<std::pair<int, Pose>> bodies{};
  };

  void takenPoints(int guide, double time, const Eigen::Matrix3Xd& points) const;
  void takenBody(int guide, int body, double time, const Pose& pose) const;
  void addGuide(const GuideConfig& config, const Eigen::Matrix3Xd& now, Guide guide);
  void onPoints(int guide, const sensor_msgs::PointCloud2& message);
  void onBodies(int guide, const slender_sim::BodyStates& message);
  Use use(const Message& message, const Pose& X_WF);
  /// Returns false when the pose is not later than the last one.
  bool takeBody(int guide, int body, double time, const Pose& X_WH);
  void start(Guide& guide, const Eigen::Matrix3Xd& vertices) const;
  void placeBodies(Guide& guide, double time, Eigen::Matrix3Xd& vertices) const;

  const NodeOptions& options_;
  const GuideBuffer::Options buffers_;
  const SimClock& clock_;
  DropCounter& drops_;
  std::vector<Guide> guides_;
  MessageIntake<Message> intake_;
  std::vector<ros::Subscriber> subscribers_;
  InputSink sink_;
};

}   // namespace slender
