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
#include <sensor_msgs/PointCloud2.h>
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
#include "slender_sim/node/point_guide_buffer.h"
#include "slender_sim/node/scene_topics.h"
#include "slender_sim/node/sim_clock.h"
#include "slender_sim/node/tf_inputs.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Receives all inputs from outside that move grasps, nozzles, driven bodies, obstacles and the guides of tracked
/// objects. Poses arrive on the topics `grasps/NAME/pose`, `guides`, `bodies` and `nozzle/pose`. Guides arrive on
/// `guide/points` (their vertices or nodes in order) or `guide/bodies` (of the bodies that carry them); in scenes of
/// several tracked objects on `tracked/NAME/guide/points` and so on. A message is taken or dropped as a whole; tf2
/// transforms it into the node's frame. TfInputs follows frames of tf. Messages on `nozzle/flow`, `belt/velocity` and
/// `wind` are valid from the next step on. The class subscribes only to the topics that the scene asks for. Bad
/// messages are dropped and counted; the object then keeps its previous input. Stamp zero means the present time.
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
  bool waiting() const { return intake_.waiting() || !hand_.empty(); }

  /// State of the messages of a grasp, body, obstacle or nozzle, of a guide by points, or of one body of a guide.
  /// `seconds`: age of the last pose; nothing if none came. `missing`: no pose of this body came, but poses of other
  /// bodies of the same guide came. `lag`: lag of the input [s]. `excess`: largest recent excess of the lag over
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
  void takenPose(std::uint8_t kind, std::size_t index, const std::string& name, double time, const Pose& X_WH,
                 int part = 0) const;
  void takenPoints(int guide, double time, const Eigen::Matrix3Xd& points) const;
  void repeatGuide(const slender_sim::Input& input);
  void takenValues(std::uint8_t kind, std::size_t thread, const std::vector<double>& values) const;

  enum class Kind
  {
    grasp,
    body,
    obstacle,
    nozzle
  };
  // `index` counts those of its kind. An edit does not change the `key` of an object that stays. `body` is an entry of
  // the topic `bodies`. `frame` is the tf frame that is followed, and is empty for what messages drive. `buffer` is
  // nullptr for what is not driven from outside.
  struct Guided
  {
    Kind kind;
    int index;
    std::string key, name, topic, body{}, frame{};
    std::unique_ptr<GuideBuffer> buffer{};
    bool byMessages() const { return buffer && body.empty() && frame.empty(); }
  };
  // The guide of a tracked object. It comes by `points`, or by poses of the bodies that carry it. Then `bodies` has one
  // buffer for each body, `held` is where the guide was, and `gap` is what is left of its way to where the messages
  // have it. If `catches_up` is set, the next apply() begins this way at `held`.
  struct Guide
  {
    std::size_t index = 0;   // in Simulation::guides()
    bool by_tf = false;
    std::string topic;
    std::unique_ptr<PointGuideBuffer> points;
    const CarriedGuide* carried = nullptr;
    std::vector<GuideBuffer> bodies;
    std::vector<Pose> poses;
    bool catches_up = true;
    Eigen::Matrix3Xd held, gap;
    double gap_start = 0.0, gap_duration = 0.0;
    bool heard() const;   // whether a pose of any body has come
  };
  struct Entry
  {
    int guided;   // is a number in guided_. In messages for a guide it is the number of a body that carries the guide.
    Pose X_FH;
  };   // a gripper, body or obstacle in the frame of the message
  struct Message : FramedMessage
  {
    std::vector<Entry> entries{};
    Eigen::Matrix3Xd points{};   // those of a guide, in the frame of the message
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
  template <class AnyMotion>
  void addGuided(ros::NodeHandle& nh, const GuideBuffer::Options& options, Guided guided, const AnyMotion& motion,
                 Attach attach, const Pose& X_WG, const std::optional<Pose>& X_HG);
  void addThreads(ros::NodeHandle& nh, const GuideBuffer::Options& options, const std::vector<std::string>& prefixes);
  void addGrasps(ros::NodeHandle& nh, const GuideBuffer::Options& options, const std::vector<std::string>& names);
  void addSolids(ros::NodeHandle& nh, const GuideBuffer::Options& options);
  /// Takes the poses of bodies in. refused(number) reports a body with which the message cannot be used. find(name,
  /// pose, entries) adds the entries for a body. If there are none, it returns what to report.
  template <class Refused, class Find>
  void takeBodies(const slender_sim::BodyStates& message, Message taken, const Refused& refused, const Find& find)
  {
    drops_.receive();
    if (!isComplete(message, taken.what, drops_))
      return;
    for (std::size_t b = 0; b < message.name.size(); ++b)
    {
      const std::optional<Pose> X_FH = checkedPose(message.pose[b], taken.what, message.name[b], drops_);
      if (!X_FH || refused(b))
        return;
      const std::size_t before = taken.entries.size();
      const std::string unknown = find(message.name[b], *X_FH, taken.entries);
      if (taken.entries.size() == before)
        drops_.drop(Drop::unknown_name, taken.what, unknown);
    }
    if (!taken.entries.empty())
      intake_.take(std::move(taken), message.header);
  }
  void followFrames();
  void shareLag();
  std::string kindOf(std::size_t guided) const;
  void takeOver(GuideInputs& before);
  // These are in guide_inputs_tracked.cpp.
  const GuideRef& refOf(const Guide& guide) const;
  void addGuides(ros::NodeHandle& nh, const GuideBuffer::Options& options);
  void takeOverGuides(GuideInputs& before, std::map<int, int>& moved);
  void onGuidePoints(int guide, const sensor_msgs::PointCloud2& message);
  void onGuideBodies(int guide, const slender_sim::BodyStates& message);
  void applyGuides(double time, SceneInputs& inputs);
  void placeBodies(Guide& guide, double time, Eigen::Matrix3Xd& vertices) const;
  void attachGuides(const Simulation& simulation);
  Use use(const Message& message, const Pose& X_WF);
  // These return false when the pose or the points are not later than the last ones.
  bool takePose(std::size_t guided, double time, const Pose& X_WH);
  bool takeBody(int guide, int body, double time, const Pose& X_WH);
  bool takePoints(int guide, double time, const Eigen::Matrix3Xd& points);
  template <class Visit>
  void forBuffers(const Visit& visit);

  // The sources of messages that are not for one entry of guided_.
  static constexpr int kGuidesSource = -1, kBodiesSource = -2, kFirstGuideSource = -3;
  static int sourceOfGuide(std::size_t guide) { return kFirstGuideSource - static_cast<int>(guide); }

  const NodeOptions options_;
  const Simulation* simulation_;
  const SimClock& clock_;
  std::vector<Guided> guided_;   // grasps in scene order, then bodies, obstacles, nozzles
  std::vector<Guide> guides_;
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
  std::vector<ros::Subscriber> subscribers_;
  InputSink sink_;
};

}   // namespace slender
