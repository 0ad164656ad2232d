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
#include "slender_sim/node/message_intake.h"
#include "slender_sim/node/node_options.h"
#include "slender_sim/node/scene_topics.h"
#include "slender_sim/node/sim_clock.h"
#include "slender_sim/node/tf_inputs.h"
#include "slender_sim/node/tracking_inputs.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Receives all inputs from outside that move grasps, nozzles, driven bodies and obstacles. Poses arrive on the topics
/// `grasps/NAME/pose`, `guides`, `bodies` and `nozzle/pose`; tf2 transforms them into the node's frame. TfInputs
/// follows frames of tf, and TrackingInputs receives the guides of tracked objects. Messages on `nozzle/flow`,
/// `belt/velocity` and `wind` are valid from the next step on. The class subscribes only to the topics that the scene
/// asks for. Bad messages are dropped and counted; the object then keeps its previous input. Stamp zero means the
/// present time.
class GuideInputs
{
public:
  /// `nh` carries the callback queue of the simulating thread, so that callbacks never run during a step. `own_frames`
  /// are the tf frames that the node itself broadcasts. `before` are the inputs of the scene before an edit, or
  /// nullptr. The new object takes over their transforms, their counts, and the messages for objects that still have
  /// the same input. Do not use `before` afterwards.
  GuideInputs(ros::NodeHandle nh, const NodeOptions& options, const Simulation& simulation, const SimClock& clock,
              const SceneTopics& names, std::set<std::string> own_frames, GuideInputs* before = nullptr);

  /// Takes in messages whose transforms have arrived meanwhile; drops those that waited too long.
  void processPending();

  /// Sets a function that is called with every input that takes effect.
  void onTaken(InputSink sink);
  /// Ends all subscriptions. From now on inputs come only from repeat().
  void stopListening();
  /// Applies a recorded input. Throws std::runtime_error if the scene has no object for this input.
  void repeat(const slender_sim::Input& input);

  /// Sets the targets of all objects that are driven from outside to their places at `time` [s since the clock's
  /// start].
  void apply(double time, SceneInputs& inputs);

  /// Call it after a grasp took hold of its object at the present place.
  void attachAt(int grasp, const Pose& X_WG);
  /// Call it after a state was loaded, because all objects may have moved.
  void attachAll(const Simulation& simulation);
  /// Call it after all objects stood still instead of following their inputs. They follow and catch up again.
  void catchUp(const Simulation& simulation);
  /// Forgets all inputs. Call it after a reset of the scene.
  void restart(const Simulation& simulation);
  /// Call it after the clock skipped this time [s] while all objects stood still.
  void skip(double seconds);

  /// `present` returns the time of the other nodes. This time may go on while the simulation is paused or has failed.
  void onPresent(const std::function<ros::Time()>& present);
  /// Applies messages that arrived while the simulation stood still. With `all` the simulation continues at the present
  /// time, and all messages count. Otherwise it takes a few steps at its old time, and only messages without a stamp
  /// count.
  void takeKept(bool all);

  /// Lets a user drag in rviz what a pose topic of its own drives. Messages on TOPIC/feedback count as poses of the
  /// present time. No other sender should move the same object meanwhile.
  void listenToHand(ros::NodeHandle nh, const std::string& topic);
  /// Returns a handle at the present place of each object that can be dragged.
  std::vector<Handle> handles(const Simulation& simulation) const;

  const DropCounter& drops() const { return drops_; }
  bool waiting() const { return intake_.waiting() || !hand_.empty() || tracking_->waiting(); }

  using Age = TrackingInputs::Age;
  /// Returns "NAME for grasp G" for each body that an object follows by the topic `bodies`, as long as no message has
  /// named this body.
  std::vector<std::string> unheardBodies() const;
  /// Returns "KIND NAME (topic T)" for each object with a pose topic of its own, as long as no message has arrived
  /// there.
  std::vector<std::string> unheardTopics() const;
  /// Returns the state of each tf frame that an object follows.
  std::vector<TfInputs::State> frames() const { return tf_->states(); }
  /// Returns the age of the last pose of each grasp, body, obstacle and guide that is driven from outside.
  std::vector<Age> ages() const;

  /// The last value of a flow, a belt velocity or a wind that messages set.
  struct Setting
  {
    std::string name, value;
  };
  std::vector<Setting> settings() const;

private:
  // recorded_inputs.cpp
  void taken(slender_sim::Input input) const;
  void takenPose(std::size_t guided, double time, const Pose& X_WH) const;
  void takenValues(std::uint8_t kind, std::size_t thread, const std::vector<double>& values) const;

  // buffer: nullptr if not driven from outside; frame: tf frame that is followed, empty if driven by messages
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
  struct Message : FramedMessage
  {
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
  std::vector<std::string> guidedKeys() const;
  void takeOver(GuideInputs& before);
  Use use(const Message& message, const Pose& X_WF);
  /// Returns false when the pose is not later than the last one.
  bool takePose(std::size_t guided, double time, const Pose& X_WH);

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
  DropCounter drops_;
  std::shared_ptr<tf2_ros::Buffer> shared_tf_buffer_;   // an edited scene keeps it
  tf2_ros::Buffer& tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  MessageIntake<Message> intake_;
  std::unique_ptr<TfInputs> tf_;
  std::unique_ptr<TrackingInputs> tracking_;
  std::vector<ros::Subscriber> subscribers_;
  InputSink sink_;
};

}   // namespace slender
