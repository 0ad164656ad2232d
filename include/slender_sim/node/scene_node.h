#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include "slender_sim/EditScene.h"
#include "slender_sim/FilePath.h"
#include "slender_sim/SetFunctions.h"
#include "slender_sim/SetGrasp.h"
#include "slender_sim/Step.h"
#include "slender_sim/node/bag_recorder.h"
#include "slender_sim/node/frame_broadcaster.h"
#include "slender_sim/node/grasp_wrenches.h"
#include "slender_sim/node/guide_inputs.h"
#include "slender_sim/node/hand_markers.h"
#include "slender_sim/node/input_replay.h"
#include "slender_sim/node/node_kind.h"
#include "slender_sim/node/node_options.h"
#include "slender_sim/scene/run_statistics.h"
#include "slender_sim/node/scene_messages.h"
#include "slender_sim/node/scene_topics.h"
#include "slender_sim/node/sim_clock.h"
#include "slender_sim/scene/crossing_watch.h"
#include "slender_sim/scene/limit_watch.h"
#include "slender_sim/scene/scene_edit.h"

namespace slender {

/// Simulates a scene of rods, viscous threads, cloths and bodies. The node receives poses of grippers and other guides
/// as messages, or from tf, and publishes the motion of the objects. docs/nodes.md lists topics, services and
/// parameters. Everything runs in the thread of spin(), so a callback never sees a half-taken step.
class SceneNode
{
public:
  /// Reads the options and the scene, and builds the scene before anything is advertised. Throws SceneError,
  /// OptionError or std::exception with a text for the user.
  SceneNode(const ros::NodeHandle& nh, const ros::NodeHandle& nh_priv, NodeKind kind);
  ~SceneNode();

  /// Runs until ROS shuts down, stop() is called, or ~stop_after is reached, and closes the bag. Returns the exit
  /// status: 0, or 3 if the run ends after a failed step.
  int spin();
  /// Ends spin() after the present step. May be called from any thread.
  void stop() { stop_ = true; }

private:
  enum class Mode
  {
    running,
    paused,
    failed
  };
  static constexpr std::size_t kMostGraspFrames = 64;   // a scene of hair may have a thousand grasps
  static constexpr double kBurst = 0.02;                // [s] longest run of steps between two looks at the callbacks
  static constexpr const char* kByLimit = "limit exceeded";   // reason in the record of a release

  // scene_node.cpp
  static void checkKind(const SceneConfig& scene, const NodeOptions& options, NodeKind kind);   // throws SceneError
  void start();
  void makeInputs();   // called again for an edited scene
  void advertise();
  void publishMesh();
  bool ended() const { return !nh_.ok() || finished_ || stop_; }
  bool advance();   // one step with everything it publishes; false when it failed
  void fail(const std::string& reason);
  // scene_node_limits.cpp
  bool mindLimits(const std::vector<LimitExcess>& begun);   // returns false if the simulation must stop
  void letInputsGoOn();                                     // after `on_limit: hold`

  void publishClock();
  void publishState();
  void publishObjects();
  bool isHeard() const;
  void broadcastFrame();
  bool graspsHaveFrames() const;
  void showHandles();
  void publishMarkers();
  void work();
  void tell();   // markers and diagnostics, when they are due
  void waitForCallbacks();
  void writeBag(const std::function<void(BagRecorder&)>& write);
  void summary() const;

  // scene_node_frames.cpp
  // Returns the moving tf frames that the node broadcasts for this scene.
  std::set<std::string> ownFrames(const Simulation& simulation, const SceneTopics& topics) const;
  void refuseLoops(const Simulation& simulation, const SceneTopics& topics) const;   // throws SceneError

  // scene_node_clock.cpp
  void checkClock() const;
  std::optional<ros::Time> firstStamp();   // nothing while there is no /clock to follow
  bool stampsAreOfTheWall() const;         // true: stamps jump to the present after a pause
  ros::Time presentOfOthers() const;   // time of other nodes; differs from the clock only while the node stands still
  void anchor();                       // the present tick is due now
  // Begins a new epoch one tick later, because the state was replaced. Returns the ticks skipped.
  std::uint64_t jumped();
  std::uint64_t realign();   // skips the time that passed while the scene stood still; returns the ticks skipped
  void skip(std::uint64_t ticks);
  double stampLag() const;   // [s]
  void skipToPresent();      // realigns, and records how many ticks were skipped
  void keepUp();             // ~max_lag
  ros::WallDuration untilDue() const;

  // scene_node_replay.cpp
  void openReplay();
  void takeRecordedScene();
  std::string leftover(const std::string& parameter) const;   // advice if an earlier start may have set the parameter
  void note(slender_sim::Input input, std::uint64_t tick);
  // Goes on after the state was replaced by `input`; a node that had failed goes on in `mode`.
  void goOnAfter(slender_sim::Input input, Mode mode);
  void noteGrasp(const slender_sim::SetGrasp::Request& request, const std::string& why = "");
  bool replayInputs();   // repeats the inputs of the present tick; returns false when the run is over
  void repeat(const slender_sim::Input& input);
  void repeatJump(const slender_sim::Input& input);
  void repeatGrasp(const slender_sim::Input& input);
  void requireInput() const;   // throws std::runtime_error if service calls must not change the run

  /// Offers a service. act(this, request, response) does what the request asks and fills the response, or throws
  /// std::runtime_error or std::invalid_argument with the reason why not. The log tells of other exceptions.
  template <class Service, class Act>
  void offer(const std::string& name, const Act& act)
  {
    using Request = typename Service::Request;
    using Response = typename Service::Response;
    const boost::function<bool(Request&, Response&)> answer = [this, name, act](Request& request, Response& response) {
      response.success = true;
      try
      {
        std::invoke(act, this, request, response);
      }
      catch (const std::exception& e)
      {
        response.success = false;
        response.message = e.what();
        if (!dynamic_cast<const std::runtime_error*>(&e) && !dynamic_cast<const std::invalid_argument*>(&e))
          ROS_ERROR_STREAM("service ~" << name << ": " << e.what());
      }
      return true;
    };
    services_.push_back(nh_priv_.advertiseService(name, answer));
  }

  // scene_node_services.cpp
  void advertiseServices();
  void onPause(const std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  void onReset(const std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  void onStep(const slender_sim::Step::Request& request, slender_sim::Step::Response& response);
  void onSetGrasp(const slender_sim::SetGrasp::Request& request, slender_sim::SetGrasp::Response& response);
  void onSetFunctions(const slender_sim::SetFunctions::Request& request, slender_sim::SetFunctions::Response& response);
  void onSave(const slender_sim::FilePath::Request& request, slender_sim::FilePath::Response& response);
  void onLoad(const slender_sim::FilePath::Request& request, slender_sim::FilePath::Response& response);
  // These throw std::exception with the reason why not.
  void setGrasp(const slender_sim::SetGrasp::Request& request, slender_sim::SetGrasp::Response& response);
  void setFunctions(const slender_sim::SetFunctions::Request& request);
  void attach(const slender_sim::SetGrasp::Request& request, int grasp, slender_sim::SetGrasp::Response& response);

  // scene_node_edits.cpp
  struct EditedScene
  {
    std::unique_ptr<Simulation> simulation;
    std::unique_ptr<SceneTopics> topics;
    std::string warnings;
  };
  void advertiseEdits();
  std::string edit(SceneEdit::Kind kind, slender_sim::Input input);   // returns the new warnings
  EditedScene edited(const SceneEdit& edit) const;                    // throws if the edit is refused
  void takeUp(EditedScene edited);
  void deleteMarkers(const Simulation& before);
  void repeatEdit(const slender_sim::Input& input);

  // scene_node_diagnostics.cpp
  void publishDiagnostics();
  static constexpr double kClockReminder = 10.0;   ///< [s] between complaints about /clock
  std::string clockWentBack() const;               ///< message if /clock went back; otherwise empty
  std::string paceNote() const;                    ///< line of the legend: how much slower than real time
  void remindOfInputs();                           ///< warns of bodies and frames without a first pose
  void addLimits(diagnostic_updater::DiagnosticStatusWrapper& status) const;
  diagnostic_updater::DiagnosticStatusWrapper simulationStatus() const;
  diagnostic_updater::DiagnosticStatusWrapper inputStatus();

  // messages; service calls. A long ~step answers service calls and leaves messages for later.
  ros::CallbackQueue queue_, services_queue_;
  ros::NodeHandle nh_, nh_priv_;
  const NodeKind kind_;
  NodeOptions options_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<SceneTopics> topics_;
  std::unique_ptr<LimitWatch> limits_;
  std::unique_ptr<CrossingWatch> crossings_;
  SimClock clock_;
  bool clock_started_ = false;
  std::unique_ptr<GuideInputs> inputs_;
  SceneInputs step_inputs_;               // inputs of the last step, reused
  std::unique_ptr<InputReplay> replay_;   // only with ~replay
  std::uint64_t inputs_noted_ = 0;        // number of inputs written to the bag
  std::unique_ptr<HandMarkers> hands_;    // only with ~interactive
  std::unique_ptr<BagRecorder> bag_;
  SceneMessages messages_;
  SharedMessage<sensor_msgs::PointCloud2> points_;
  std::vector<SharedMessage<geometry_msgs::PoseArray>> rod_poses_;   // in the order of pubs_.each_rod_poses

  Mode mode_ = Mode::running, mode_before_failure_ = Mode::running;
  bool finished_ = false;
  bool told_of_topics_ = false;   // the log has named the pose topics without messages
  bool stepping_ = false;         // in ~step
  bool guides_led_on_ = false;    // guides are at the end of a step that was not taken
  std::string step_ended_;        // name of the call that ended ~step; empty while ~step goes on
  std::atomic<bool> stop_{false};
  std::uint32_t epoch_ = 0;
  std::string failure_, bag_failure_;
  double shown_pace_ = 0.0;        // simulated time over wall time between the last two diagnostics; 0: not known
  RunStatistics total_, recent_;   // since the start, since the last diagnostics
  std::uint64_t reported_drops_ = 0, limits_silent_ = 0;   // limits_silent_: excursions since the last warning
  double inputs_since_ = 0.0;                              // [s] of clock_; earlier inputs were forgotten

  ros::WallTime wall_start_;   // when the tick wall_start_ticks_ was due
  ros::WallTime next_skip_warning_, next_limit_warning_;
  std::uint64_t wall_start_ticks_ = 0;
  ros::WallTime next_diagnostics_, next_markers_, next_clock_reminder_, next_input_reminder_;
  std::optional<std::pair<std::uint64_t, std::uint32_t>> drawn_;   // tick, subscribers of the last picture

  std::unique_ptr<FrameBroadcaster> frames_;
  std::unique_ptr<GraspWrenches> wrenches_;
  std::unique_ptr<tf2_ros::StaticTransformBroadcaster> frame_broadcaster_;   // makes ~frame_id known to rviz
  // What advertise() makes.
  struct Publishers
  {
    ros::Publisher bodies, grasps, obstacles, fields;                  // only if the scene has such objects
    ros::Publisher rod_state, rod_poses, thread_state, thread_poses;   // only of kinds in the scene
    ros::Publisher cloth_state, points, mesh;                          // only if the scene has cloths
    ros::Publisher markers, scene, diagnostics, clock;
    std::vector<ros::Publisher> each_rod_poses, nozzles;
  };
  Publishers pubs_;
  std::vector<ros::ServiceServer> services_;
};

}   // namespace slender
