#include "slender_sim/node/scene_node.h"

#include <algorithm>
#include <iomanip>
#include <iostream>

#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/WrenchStamped.h>
#include <rosgraph_msgs/Clock.h>
#include <std_msgs/String.h>

#include "slender_sim/ClothState.h"
#include "slender_sim/MeshStamped.h"
#include "slender_sim/RodState.h"
#include "slender_sim/ThreadState.h"
#include "slender_sim/dynamics/failure_place.h"
#include "slender_sim/linalg/interruption.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/robot_sources.h"
#include "slender_sim/node/scene_markers.h"
#include "slender_sim/node/scene_option.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/state_bytes.h"

namespace slender {
namespace {

/// Throws SceneError if the scene has no object of the node's kind.
void requireObjects(const SceneConfig& scene, NodeKind kind)
{
  const auto require = [&](bool has, const char* objects) {
    if (!has)
      throw SceneError("scene " + scene.name + ": it has no " + objects + ", which " + toString(kind) +
                       " is for; scene_node runs every scene");
  };
  switch (kind)
  {
    case NodeKind::scene: return;
    case NodeKind::rods: return require(!scene.rods.empty() || !scene.bodies.empty(), "rods or bodies");
    case NodeKind::threads: return require(!scene.threads.empty(), "threads");
    case NodeKind::cloths: return require(!scene.cloths.empty(), "cloths");
    case NodeKind::tracking:
      return require(tracksGuide(scene.cloths) || tracksGuide(scene.rods), "cloths or rods that track a guide");
  }
}

}   // namespace

void SceneNode::checkKind(const SceneConfig& scene, const NodeOptions& options, NodeKind kind)
{
  requireObjects(scene, kind);
  if (options.markers.style == MarkerStyle::regions && !tracksGuide(scene.cloths))
    throw OptionError("~marker_style: regions are those of tracked cloths, of which scene " + scene.name +
                      " has none; choose tube or line");
}

const char* toString(NodeKind kind)
{
  return kind == NodeKind::scene     ? "scene_node"
         : kind == NodeKind::rods    ? "rod_node"
         : kind == NodeKind::threads ? "thread_node"
         : kind == NodeKind::cloths  ? "cloth_node"
                                     : "tracking_node";
}

SceneNode::SceneNode(const ros::NodeHandle& nh, const ros::NodeHandle& nh_priv, NodeKind kind)
  : nh_(nh),
    nh_priv_(nh_priv),
    kind_(kind),
    options_(NodeOptions::read(nh_priv))
{
  nh_.setCallbackQueue(&queue_);
  nh_priv_.setCallbackQueue(&services_queue_);
  openReplay();
  checkClock();
  setRobotSources(rosSources(nh_));
  SceneConfig scene = readScene(options_);
  checkKind(scene, options_, kind_);
  simulation_ = std::make_unique<Simulation>(std::move(scene));
  if (simulation_->config().statics)
    ROS_WARN("%s: the key statics of the scene is for simulate --statics; the node does not use it",
             nh_priv_.getNamespace().c_str());
  if (simulation_->config().record.every != 1)
    ROS_INFO("%s: the key record.every of the scene is for simulate; the node publishes and records every step",
             nh_priv_.getNamespace().c_str());
  for (const std::string& warning : simulation_->config().warnings)
    ROS_WARN("%s", warning.c_str());
  for (const std::string& note : simulation_->config().notes)
    ROS_INFO("%s", note.c_str());
  limits_ = std::make_unique<LimitWatch>(*simulation_);
  crossings_ = std::make_unique<CrossingWatch>(*simulation_);
  topics_ = std::make_unique<SceneTopics>(*simulation_);
  refuseLoops(*simulation_, *topics_);
  if (!options_.record_bag.empty())
  {
    bag_ = std::make_unique<BagRecorder>(options_.record_bag, nh_.getNamespace(), *simulation_);
    for (const std::string& note : bag_->notes())
      ROS_WARN("%s: %s", nh_priv_.getNamespace().c_str(), note.c_str());
  }
  if (options_.paused)
    mode_ = Mode::paused;
  start();
}

SceneNode::~SceneNode()
{
  for (ros::ServiceServer& service : services_)
    service.shutdown();
}

/// Everything that needs the time of the first stamp.
void SceneNode::start()
{
  const std::optional<ros::Time> stamp = firstStamp();
  if (!stamp)
    return;
  clock_ = SimClock(*stamp, simulation_->config().time.step);
  if (options_.interactive && !replay_)
    hands_ = std::make_unique<HandMarkers>(nh_.resolveName("interactive"), options_.frame_id);
  makeInputs();
  advertise();
  advertiseServices();
  if (stampsAreOfTheWall())   // advertising takes its time: the stamps would lag by that for ever
    clock_ = SimClock(ros::Time::now(), clock_.step());
  clock_started_ = true;
  anchor();
  std_msgs::String scene;
  scene.data = simulation_->config().source;
  pubs_.scene.publish(scene);
  if (bag_)
    bag_->recordScene(scene.data, clock_.stamp());
  if (topics_->has_cloths)
    publishMesh();
  total_ = recent_ = RunStatistics();
  publishState();
}

void SceneNode::makeInputs()
{
  const std::unique_ptr<GuideInputs> before = std::move(inputs_);
  inputs_ = std::make_unique<GuideInputs>(nh_, options_, *simulation_, clock_, *topics_,
                                          ownFrames(*simulation_, *topics_), before.get());
  if (replay_)
    inputs_->stopListening();
  inputs_->onPresent([this] { return presentOfOthers(); });
  inputs_->onTaken([this](slender_sim::Input input) { note(std::move(input), clock_.ticks()); });
  if (hands_)
    inputs_->listenToHand(nh_, nh_.resolveName("interactive"));
  showHandles();
}

void SceneNode::publishMesh()
{
  const slender_sim::MeshStamped mesh = clothMesh(*simulation_, clock_.stamp(), options_.frame_id);
  pubs_.mesh.publish(mesh);
  if (bag_)
    bag_->recordMesh(mesh);
}

void SceneNode::advertise()
{
  const SceneTopics& names = *topics_;
  if (names.has_rods)
  {
    pubs_.rod_state = nh_.advertise<slender_sim::RodState>(names.rods + "state", 1000);
    pubs_.rod_poses = nh_.advertise<geometry_msgs::PoseArray>(names.rods + "poses", 100);
  }
  if (names.has_threads)
  {
    pubs_.thread_state = nh_.advertise<slender_sim::ThreadState>(names.threads + "state", 1000);
    pubs_.thread_poses = nh_.advertise<geometry_msgs::PoseArray>(names.threads + "poses", 100);
  }
  if (names.has_cloths)
  {
    pubs_.cloth_state = nh_.advertise<slender_sim::ClothState>(names.cloths + "state", 1000);
    pubs_.points = nh_.advertise<sensor_msgs::PointCloud2>(names.cloths + "points", 100);
    pubs_.mesh = nh_.advertise<slender_sim::MeshStamped>(names.cloths + "mesh", 1, true);
  }
  for (const std::string& prefix : names.nozzles)
    pubs_.nozzles.push_back(nh_.advertise<geometry_msgs::WrenchStamped>(prefix + "nozzle/wrench", 100));
  if (simulation_->config().rods.size() > 1)
    for (const RodConfig& rod : simulation_->config().rods)
      pubs_.each_rod_poses.push_back(nh_.advertise<geometry_msgs::PoseArray>("rods/" + rod.name + "/poses", 100));
  rod_poses_.resize(pubs_.each_rod_poses.size());
  const std::string node = nh_priv_.getNamespace().substr(1);
  frames_ = std::make_unique<FrameBroadcaster>(nh_, node, options_.frame_id, names, graspsHaveFrames());
  wrenches_ = std::make_unique<GraspWrenches>(
      nh_, names.grasps, frames_->graspFrames(),
      GraspWrenches::Options{options_.wrench_frame == WrenchFrame::world || !graspsHaveFrames(),
                             options_.wrench_filter});
  const std::vector<BodyConfig>& bodies = simulation_->config().bodies;
  if (!bodies.empty())
    pubs_.bodies = nh_.advertise<slender_sim::BodyStates>("body_states", 1000);
  if (simulation_->grasps().size() > 0)
    pubs_.grasps = nh_.advertise<slender_sim::GraspStates>("grasp_states", 1000);
  if (!simulation_->config().obstacles.empty())
    pubs_.obstacles = nh_.advertise<slender_sim::BodyStates>("obstacle_states", 1000);
  if (!simulation_->config().record.fields.empty())
    pubs_.fields = nh_.advertise<slender_sim::Fields>("fields", 1000);
  broadcastFrame();
  pubs_.markers = nh_.advertise<visualization_msgs::MarkerArray>("markers", 2);
  pubs_.scene = nh_.advertise<std_msgs::String>("scene", 1, true);
  pubs_.diagnostics = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  if (options_.publish_clock)
    pubs_.clock = nh_.advertise<rosgraph_msgs::Clock>("/clock", 100, true);
}

bool SceneNode::advance()
{
  if (replay_ && !replayInputs())
    return false;
  const ros::WallTime begin = ros::WallTime::now();
  simulation_->defaultInputs(step_inputs_);
  inputs_->apply(clock_.seconds() + clock_.step(), step_inputs_);
  guides_led_on_ = true;
  if (!mindLimits(limits_->checkInputs(step_inputs_)))
    return false;
  const StepReport report = simulation_->step(step_inputs_);
  if (!report.ok)
  {
    if (stepsInterrupted())   // by a signal, which shuts the node down: the state is that at the start of the step
      return false;
    fail(std::string(toString(report.failure)) + ": " + report.message);
    return false;
  }
  if (!allFinite(simulation_->state()))
  {
    fail("the state is not finite any more");
    return false;
  }
  clock_.tick();
  guides_led_on_ = false;
  if (simulation_->state().steps % static_cast<std::uint64_t>(options_.state_every) == 0)
    publishState();
  else
    publishClock();
  const double busy = (ros::WallTime::now() - begin).toSec();
  total_.stamp_lag = stampLag();
  recent_.worst_stamp_lag = std::max(recent_.worst_stamp_lag, total_.stamp_lag);
  total_.add(report, *simulation_, clock_.step(), busy);
  recent_.add(report, *simulation_, clock_.step(), busy);
  if (options_.stop_after > 0.0 && clock_.seconds() >= options_.stop_after - 0.5 * clock_.step())
    finished_ = true;
  for (const std::string& crossing : crossings_->check())
    ROS_WARN("%s", crossing.c_str());
  return mindLimits(limits_->checkStep());
}

void SceneNode::fail(const std::string& reason)
{
  mode_before_failure_ = mode_;
  mode_ = Mode::failed;
  failure_ = "step " + std::to_string(simulation_->state().steps + 1) +
             " (from t = " + shortNumber(simulation_->state().time, 9) + " s on): " + reason;
  ROS_ERROR("%s stopped at %s; call ~reset to start again", nh_priv_.getNamespace().c_str(), failure_.c_str());
  publishDiagnostics();
}

/// Publishes /clock if the options ask for it.
void SceneNode::publishClock()
{
  if (!options_.publish_clock)
    return;
  rosgraph_msgs::Clock message;
  message.clock = clock_.stamp();
  pubs_.clock.publish(message);
}

void SceneNode::publishState()
{
  publishClock();   // before the messages with this stamp
  frames_->broadcast(*simulation_, clock_.stamp());
  if (!bag_ && !isHeard())
    return;
  messages_.fill(*simulation_, clock_.stamp(), options_.frame_id, epoch_);
  if (pubs_.fields && (bag_ || pubs_.fields.getNumSubscribers() > 0))
    messages_.fillFields(*simulation_);
  writeBag([this](BagRecorder& bag) { bag.record(messages_); });   // first: what is published belongs to others
  publishObjects();
  for (std::size_t k = 0; k < pubs_.nozzles.size(); ++k)
    pubs_.nozzles[k].publish(messages_.nozzles[k]);
  wrenches_->publish(messages_);
  if (!messages_.bodies.name.empty())
    pubs_.bodies.publish(messages_.bodies);
  if (!messages_.grasps.name.empty())
    pubs_.grasps.publish(messages_.grasps);
  if (!messages_.obstacles.name.empty())
    pubs_.obstacles.publish(messages_.obstacles);
  if (pubs_.fields.getNumSubscribers() > 0)
    pubs_.fields.publish(messages_.fields);
}

/// Returns true if a topic of publishState() has a subscriber.
bool SceneNode::isHeard() const
{
  const auto heard = [](const ros::Publisher& p) { return p.getNumSubscribers() > 0; };
  return heard(pubs_.rod_state) || heard(pubs_.rod_poses) || heard(pubs_.thread_state) || heard(pubs_.thread_poses) ||
         heard(pubs_.cloth_state) || heard(pubs_.points) || heard(pubs_.bodies) || heard(pubs_.grasps) ||
         heard(pubs_.obstacles) || heard(pubs_.fields) ||
         std::any_of(pubs_.each_rod_poses.begin(), pubs_.each_rod_poses.end(), heard) || wrenches_->isHeard() ||
         std::any_of(pubs_.nozzles.begin(), pubs_.nozzles.end(), heard);
}

/// Publishes rods, threads and cloths. Do not change the messages afterwards, because subscribers share them.
void SceneNode::publishObjects()
{
  if (pubs_.points.getNumSubscribers() > 0)
  {
    sensor_msgs::PointCloud2& points = points_.renew();
    points.header = messages_.header;
    toPoints(*messages_.cloth_state, points);
    pubs_.points.publish(points_.pointer());
  }
  for (std::size_t r = 0; r < pubs_.each_rod_poses.size(); ++r)
    if (pubs_.each_rod_poses[r].getNumSubscribers() > 0)
    {
      geometry_msgs::PoseArray& poses = rod_poses_[r].renew();
      poses.header = messages_.header;
      poses.poses.clear();
      appendPoses(*messages_.states[r], poses.poses);
      pubs_.each_rod_poses[r].publish(rod_poses_[r].pointer());
    }
  for (const auto& state : messages_.states)
    pubs_.rod_state.publish(state.pointer());
  for (const auto& state : messages_.threads)
    pubs_.thread_state.publish(state.pointer());
  if (topics_->has_cloths)
    pubs_.cloth_state.publish(messages_.cloth_state.pointer());
  if (topics_->has_rods)
    pubs_.rod_poses.publish(messages_.rod_poses.pointer());
  if (topics_->has_threads)
    pubs_.thread_poses.publish(messages_.thread_poses.pointer());
}

/// tf knows a frame only by a transform. Without any rviz warns that its fixed frame does not exist.
void SceneNode::broadcastFrame()
{
  frame_broadcaster_ = std::make_unique<tf2_ros::StaticTransformBroadcaster>();
  frame_broadcaster_->sendTransform(toTransform(makeHeader(clock_.stamp(), options_.frame_id),
                                                nh_priv_.getNamespace().substr(1) + "/origin", Pose()));
}

/// Returns true if grasps are published as tf frames. Many grasps have frames only if ~wrench_frame asks for them,
/// because a thousand frames are too many for tf.
bool SceneNode::graspsHaveFrames() const
{
  return options_.wrench_frame == WrenchFrame::grasp || topics_->grasps.size() <= kMostGraspFrames;
}

void SceneNode::showHandles()
{
  if (hands_)
    hands_->show(inputs_->handles(*simulation_));
}

/// Calls write(bag) if the node records. A failure ends the recording.
void SceneNode::writeBag(const std::function<void(BagRecorder&)>& write)
try
{
  if (bag_)
    write(*bag_);
}
catch (const std::runtime_error& e)
{
  bag_failure_ = e.what();
  bag_.reset();
  ROS_ERROR("%s: recording stopped: %s", nh_priv_.getNamespace().c_str(), e.what());
}

void SceneNode::publishMarkers()
{
  const std::uint32_t listeners = pubs_.markers.getNumSubscribers();
  const auto now = std::make_pair(clock_.ticks(), listeners);
  if (listeners == 0)
    drawn_.reset();   // the next subscriber has no picture yet
  if (listeners == 0 || ros::WallTime::now() < next_markers_ || drawn_ == now)
    return;
  next_markers_ = ros::WallTime::now() + ros::WallDuration(1.0 / options_.marker_rate);
  drawn_ = now;
  const std_msgs::Header header = makeHeader(clock_.stamp(), options_.frame_id);
  options_.markers.note = paceNote();
  if (options_.markers.letters == 0.0)   // The letters keep their size, because the view does not grow with the scene.
    options_.markers.letters = legendLetters(*simulation_);
  pubs_.markers.publish(
      boost::make_shared<visualization_msgs::MarkerArray>(sceneMarkers(*simulation_, header, options_.markers)));
}

void SceneNode::work()
{
  if (!clock_started_)
  {
    start();
    if (!clock_started_ && ros::WallTime::now() >= next_clock_reminder_)
    {
      next_clock_reminder_ = ros::WallTime::now() + ros::WallDuration(kClockReminder);
      ROS_WARN("%s waits for /clock (~pace: follow), which nobody publishes yet", nh_priv_.getNamespace().c_str());
    }
    return;
  }
  inputs_->processPending();
  const ros::WallTime begin = ros::WallTime::now();
  while (mode_ == Mode::running && !ended() && options_.pace != Pace::step && untilDue().toSec() == 0.0 &&
         (ros::WallTime::now() - begin).toSec() < kBurst)
  {
    if (!advance())
      break;
    keepUp();
    if (!queue_.isEmpty() || !services_queue_.isEmpty())
      break;
  }
  tell();
}

void SceneNode::tell()
{
  publishMarkers();
  if (ros::WallTime::now() >= next_diagnostics_)
    publishDiagnostics();
}

/// Until a step is due, or a callback came whose effect shows at once: a message while the node runs by itself, else a
/// service call.
void SceneNode::waitForCallbacks()
{
  const bool running = mode_ == Mode::running && options_.pace != Pace::step;
  if (running)
    queue_.callAvailable(untilDue());
  // one by one: what callAvailable() has taken out of the queue is not seen by those calls that answer others meanwhile
  ros::WallDuration patience = running ? ros::WallDuration(0.0) : untilDue();
  while (!ended() && services_queue_.callOne(patience) == ros::CallbackQueue::Called)
    patience = ros::WallDuration(0.0);
  queue_.callAvailable();
}

int SceneNode::spin()
{
  while (!ended())
  {
    waitForCallbacks();
    work();
  }
  if (clock_started_)
    publishDiagnostics();
  writeBag([](BagRecorder& bag) { bag.close(); });
  summary();
  if (finished_)
    ros::WallDuration(0.3).sleep();   // the last messages and answers leave
  return mode_ == Mode::failed || !bag_failure_.empty() ? 3 : 0;
}

void SceneNode::summary() const
{
  const RunStatistics& s = total_;
  const char* name = toString(kind_);
  std::cout << std::setprecision(4) << name << ": " << s.steps << " steps, " << s.simulated << " s simulated, "
            << s.busy << " s computing, real-time factor " << s.realTimeFactor() << ", "
            << "worst residual " << residualText(simulation_->config(), s.residual) << ", largest strain "
            << s.max_strain << ", Newton iterations per step "
            << (s.steps ? static_cast<double>(s.iterations) / s.steps : 0.0) << ", cut steps " << s.cut_steps << "\n";
  if (s.skipped > 0.0)
    std::cout << name << ": slower than real time, the clock skipped " << s.skipped << " s (~max_lag)\n";
  for (const std::string& line : graspLines(s, topics_->grasps))
    std::cout << name << ": " << line << "\n";
  if (inputs_ && inputs_->drops().total() > 0)
    std::cout << name << ": " << inputs_->drops().total() << " messages dropped\n";
  if (bag_)
    std::cout << name << ": recorded " << bag_->path() << "\n";
  std::cout << std::flush;
}

}   // namespace slender
