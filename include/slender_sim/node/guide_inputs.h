#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/Vector3Stamped.h>
#include <ros/node_handle.h>
#include <std_msgs/Float64.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/InteractiveMarkerFeedback.h>

#include "slender_sim/BodyStates.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/drop_counter.h"
#include "slender_sim/node/guide_buffer.h"
#include "slender_sim/node/hand_markers.h"
#include "slender_sim/node/input_replay.h"
#include "slender_sim/node/node_options.h"
#include "slender_sim/node/paused_messages.h"
#include "slender_sim/node/pending_messages.h"
#include "slender_sim/node/scene_topics.h"
#include "slender_sim/node/sim_clock.h"
#include "slender_sim/node/tf_inputs.h"
#include "slender_sim/node/tracking_inputs.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Everything that moves grasps, nozzles, driven bodies and obstacles from outside: `grasps/NAME/pose`, `guides`,
/// `bodies`, `nozzle/pose`, through tf2 into the node's frame; frames of tf themselves, see TfInputs; and
/// `nozzle/flow`, `belt/velocity` and `wind`, which hold from the next step on. Subscribes only to what the scene asks
/// for. Guides of tracked cloths: TrackingInputs. Bad messages are dropped and counted; the object
/// that they would have moved keeps its previous input. A message with stamp zero counts as one of the present.
class GuideInputs
{
public:
  /// `nh` carries the callback queue of the simulating thread: callbacks never run beside a step. `own_frames`: of tf,
  /// which the node itself broadcasts. `before`: those of the scene before an edit, from which everything is taken over
  /// that goes on: what was heard from the same senders for the same things, transforms, and counts. They are of no use
  /// afterwards.
  GuideInputs(ros::NodeHandle nh, const NodeOptions& options, const Simulation& simulation, const SimClock& clock,
              const SceneTopics& names, std::set<std::string> own_frames, GuideInputs* before = nullptr);

  /// Takes in messages whose transforms have arrived meanwhile; drops those that waited too long.
  void processPending();

  /// Hands every input that takes effect to `sink`, too.
  void onTaken(InputSink sink);
  /// From now on inputs come from repeat() alone.
  void stopListening();
  /// A recorded input takes effect. Throws std::runtime_error when the scene has nothing that it could move.
  void repeat(const slender_sim::Input& input);

  /// Replaces the targets of everything driven from outside by where it shall be at `time` [s since the clock's start].
  void apply(double time, SceneInputs& inputs);

  /// The grasp took hold of the rod where it is now.
  void attachAt(int grasp, const Pose& X_WG);
  /// Everything was moved: a state was loaded.
  void attachAll(const Simulation& simulation);
  /// Everything stood still instead of following its input, which counts again.
  void catchUp(const Simulation& simulation);
  /// The scene was reset: forgets all input.
  void restart(const Simulation& simulation);
  /// The clock skipped so many seconds, during which everything stood still.
  void skip(double seconds);

  /// `present` returns the time of others: while the simulation is paused or has failed it may go on.
  void onPresent(const std::function<ros::Time()>& present);
  /// Takes in what came while the simulation stood still. With `all` it goes on at the present; else it takes some
  /// steps where it is, for which only messages without a stamp count.
  void takeKept(bool all);

  /// What is driven by messages of its own may also be dragged by hand: TOPIC/feedback counts as poses of the present.
  /// Whoever drags should be the only one who moves it.
  void listenToHand(ros::NodeHandle nh, const std::string& topic);
  /// Of what can be dragged, where it is now.
  std::vector<Handle> handles(const Simulation& simulation) const;

  const DropCounter& drops() const { return drops_; }
  bool waiting() const { return !pending_.empty() || !hand_.empty() || tracking_->waiting(); }

  /// Per grasp, body, obstacle and guide driven from outside. `missing`, `lag`, `excess`: see TrackingInputs::Age.
  using Age = TrackingInputs::Age;
  /// Age of the last pose at the clock's present; nothing while none came.
  /// "NAME for grasp G" of each body that something follows by the topic `bodies` and that no message has named yet.
  std::vector<std::string> unheardBodies() const;
  /// Of each frame of tf that something follows.
  std::vector<TfInputs::State> frames() const { return tf_->states(); }
  std::vector<Age> ages() const;

  /// Per flow, belt and wind driven from outside: the value by message.
  struct Setting
  {
    std::string name, value;
  };
  std::vector<Setting> settings() const;

private:
  // recorded_inputs.cpp
  void taken(slender_sim::Input input) const;
  void takenPose(std::size_t guided, double time, const Pose& X_WH) const;
  void takenVector(std::uint8_t kind, std::size_t thread, const Eigen::Vector3d& v) const;

  // buffer: null when not driven from outside; frame: of tf, empty when driven by messages
  struct Guided
  {
    std::string name, body, topic, frame;
    std::unique_ptr<GuideBuffer> buffer;
    bool byMessages() const { return buffer && body.empty() && frame.empty(); }
  };
  struct Entry
  {
    int guided;
    Pose X_FH;
  };   // a gripper, body or obstacle in the frame of the message
  struct Message
  {
    int source;   // messages of one source keep their order
    std::string what, frame;
    ros::Time stamp;
    std::vector<Entry> entries;
  };

  void onPose(int guided, const geometry_msgs::PoseStamped& message);
  void onFlow(std::size_t thread, const std_msgs::Float64& message);
  void onBelt(std::size_t thread, const geometry_msgs::Vector3Stamped& message);
  void onWind(const geometry_msgs::Vector3Stamped& message);
  // hand_inputs.cpp
  void onHand(const visualization_msgs::InteractiveMarkerFeedback& message);
  void takeHand();
  bool isDraggable(std::size_t guided) const;
  std::string handleName(std::size_t guided) const;
  std::optional<Eigen::Vector3d> velocityOf(const geometry_msgs::Vector3Stamped& message, const std::string& what);
  void takeNow(const Message& message);
  void onGuides(const geometry_msgs::PoseArray& message);
  void onBodies(const slender_sim::BodyStates& message);
  Pose poseOf(const Simulation& simulation, std::size_t guided) const;
  bool addThreads(ros::NodeHandle& nh, const Simulation& simulation, const GuideBuffer::Options& options,
                  const std::vector<std::string>& prefixes);
  void subscribePose(ros::NodeHandle& nh);
  bool addGrasps(ros::NodeHandle& nh, const Simulation& simulation, const GuideBuffer::Options& options,
                 const std::vector<std::string>& names);
  void addSolids(const Simulation& simulation, const GuideBuffer::Options& options);
  void followFrames();
  void shareLag();
  std::string kindOf(std::size_t guided) const;
  bool checkPose(const geometry_msgs::Pose& message, const std::string& what, const std::string& whose, Pose& X);
  void take(int source, const std::string& what, const std_msgs::Header& header, std::vector<Entry> entries);
  std::vector<std::string> guidedKeys() const;
  void takeOver(GuideInputs& before);
  void dropTransform(PoseFault fault, const std::string& what, const std::string& frame);
  /// False when the transform is not known yet.
  bool deliver(const Message& message, std::string* why);

  static constexpr int kGuidesSource = -1, kBodiesSource = -2;

  const NodeOptions options_;
  const Simulation* simulation_;
  const SimClock& clock_;
  std::vector<Guided> guided_;                            // grasps in scene order, then bodies, obstacles, nozzles
  std::size_t grasps_ = 0, bodies_ = 0, obstacles_ = 0;   // how many of the first three
  struct Driven
  {
    bool flow_topic = false, belt_topic = false;
    double greatest_flow = 0.0;
    std::optional<double> flow;   // last values by message
    std::optional<Eigen::Vector3d> belt;
  };
  std::vector<Driven> threads_;
  bool wind_topic_ = false;
  std::optional<Eigen::Vector3d> wind_;   // last by message
  std::vector<std::string> prefixes_;     // of their topics
  struct Dragged
  {
    Pose X_FH;
    std::string frame;
  };
  std::map<std::size_t, Dragged> hand_;   // per guided, not taken yet
  PendingMessages<Message> pending_;
  PausedMessages<Message> paused_;
  DropCounter drops_;
  std::shared_ptr<tf2_ros::Buffer> shared_tf_buffer_;   // also after an edit
  tf2_ros::Buffer& tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  std::unique_ptr<TfInputs> tf_;
  std::unique_ptr<TrackingInputs> tracking_;
  std::vector<ros::Subscriber> subscribers_;
  InputSink sink_;
};

}   // namespace slender
