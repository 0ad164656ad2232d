#include "slender_sim/node/guide_inputs.h"

#include <algorithm>

#include "subscribe.h"

namespace slender {
namespace {

constexpr int kQueueSize = 1000;   // a burst of fast trackers; in wall pace it is emptied every step
constexpr std::size_t kMaxPending = 1000;

/// Names of the scene's own bodies and obstacles: grasps follow those without messages.
std::set<std::string> solidNames(const SceneConfig& scene)
{
  std::set<std::string> names;
  for (const BodyConfig& body : scene.bodies)
    names.insert(body.name);
  for (const ObstacleConfig& obstacle : scene.obstacles)
    names.insert(obstacle.name);
  return names;
}

}   // namespace

GuideInputs::GuideInputs(ros::NodeHandle nh, const NodeOptions& options, const Simulation& simulation,
                         const SimClock& clock, const SceneTopics& names, std::set<std::string> own_frames,
                         GuideInputs* before)
  : options_(options),
    simulation_(&simulation),
    clock_(clock),
    shared_tf_buffer_(before ? before->shared_tf_buffer_ : std::make_shared<tf2_ros::Buffer>()),
    tf_buffer_(*shared_tf_buffer_),
    tf_listener_(before ? std::move(before->tf_listener_) : nullptr),
    intake_(options_, clock, tf_buffer_, drops_, kMaxPending,
            [this](const Message& message, const Pose& X_WF) { return use(message, X_WF); })
{
  GuideBuffer::Options buffer_options;
  buffer_options.delay = options.guide_delay;
  buffer_options.automatic = options.guide_delay_auto;
  buffer_options.live = options.live_guides;
  buffer_options.catch_up_time = options.catch_up_time;
  buffer_options.catch_up_speed = options.catch_up_speed;
  buffer_options.catch_up_turning = 3.0 * options.catch_up_speed;   // [rad/s]: as if a hand's radius of 1/3 m turned

  const bool topics = addGrasps(nh, simulation, buffer_options, names.grasps);
  addSolids(simulation, buffer_options);
  const bool threads = addThreads(nh, simulation, buffer_options, names.nozzles);
  const bool bodies =
      std::any_of(guided_.begin(), guided_.end(), [](const Guided& guided) { return !guided.body.empty(); });
  if (topics)
    subscribers_.push_back(subscribe<geometry_msgs::PoseArray>(
        nh, "guides", kQueueSize, [this](const geometry_msgs::PoseArray& message) { onGuides(message); }));
  if (bodies)
    subscribers_.push_back(subscribe<slender_sim::BodyStates>(
        nh, "bodies", kQueueSize, [this](const slender_sim::BodyStates& message) { onBodies(message); }));
  wind_topic_ = simulation.config().wind_topic;
  if (wind_topic_)
    subscribers_.push_back(subscribe<geometry_msgs::Vector3Stamped>(
        nh, "wind", kQueueSize, [this](const geometry_msgs::Vector3Stamped& message) { onWind(message); }));
  tracking_ = std::make_unique<TrackingInputs>(nh, options_, buffer_options, simulation, clock_, tf_buffer_, drops_);
  tf_ = std::make_unique<TfInputs>(options_, clock_, tf_buffer_, drops_, std::move(own_frames));
  followFrames();
  if (!tf_listener_ && (topics || bodies || threads || wind_topic_ || tracking_->any() || tf_->any()))
    tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_, true, ros::TransportHints().tcpNoDelay());
  if (before)
    takeOver(*before);
}

/// Returns true if at least one grasp listens to a topic of its own.
bool GuideInputs::addGrasps(ros::NodeHandle& nh, const Simulation& simulation, const GuideBuffer::Options& options,
                            const std::vector<std::string>& names)
{
  bool topics = false;
  const std::set<std::string> solids = solidNames(simulation.config());
  for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
  {
    const GraspConfig& config = *simulation.grasps()[g].config;
    Guided guided;
    guided.name = names[g];
    guided.topic = "grasps/" + guided.name + "/pose";
    const auto* body = std::get_if<BodyMotion>(&config.motion);
    if (body && !solids.count(body->body))
      guided.body = body->body;
    if (const auto* tf = std::get_if<TfMotion>(&config.motion))
      guided.frame = tf->frame;
    const bool topic = std::holds_alternative<TopicMotion>(config.motion);
    if (topic || !guided.body.empty() || !guided.frame.empty())
      guided.buffer = std::make_unique<GuideBuffer>(
          options, config.attach, simulation.grasps().pose(static_cast<int>(g)), offsetInFrame(config));
    guided_.push_back(std::move(guided));
    if (topic)
    {
      topics = true;
      subscribePose(nh);
    }
  }
  grasps_ = guided_.size();
  return topics;
}

/// Returns the kind and name of the object for messages, for example "grasp left".
std::string GuideInputs::kindOf(std::size_t guided) const
{
  const std::size_t solid = guided - grasps_;
  const char* kind = guided < grasps_               ? "grasp "
                     : solid < bodies_              ? "body "
                     : solid < bodies_ + obstacles_ ? "obstacle "
                                                    : "";
  return kind + guided_[guided].name;
}

void GuideInputs::followFrames()
{
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (!guided_[g].frame.empty())
      tf_->follow(guided_[g].frame, kindOf(g),
                  [this, g](double time, const Pose& X_WF) { return takePose(g, time, X_WF); });
  tracking_->followFrames(*tf_);
}

/// Gives all inputs the same lag, so that links of a robot, the grasp in its gripper and objects that messages move are
/// shown at the same instant. The lag is the largest one that an input with recent poses needs. Scenes without frames
/// of tf keep a lag per input.
void GuideInputs::shareLag()
{
  if (!tf_->any())
    return;
  double lag = tracking_->wantedLag();
  for (const Guided& guided : guided_)
    if (guided.buffer && guided.buffer->lastTime() &&
        clock_.seconds() - *guided.buffer->lastTime() <= options_.guide_timeout)
      lag = std::max(lag, guided.buffer->timing().wantedLag());
  for (Guided& guided : guided_)
    if (guided.buffer)
      guided.buffer->lagAtLeast(lag);
  tracking_->lagAtLeast(lag);
}

/// Poses of the last of guided_, on its topic.
void GuideInputs::subscribePose(ros::NodeHandle& nh)
{
  const int guided = static_cast<int>(guided_.size()) - 1;
  subscribers_.push_back(subscribe<geometry_msgs::PoseStamped>(
      nh, guided_.back().topic, kQueueSize,
      [this, guided](const geometry_msgs::PoseStamped& message) { onPose(guided, message); }));
}

/// True when any of them listens to something that has a frame.
bool GuideInputs::addThreads(ros::NodeHandle& nh, const Simulation& simulation, const GuideBuffer::Options& options,
                             const std::vector<std::string>& prefixes)
{
  bool framed = false;
  const std::vector<ThreadConfig>& threads = simulation.config().threads;
  prefixes_ = prefixes;
  threads_.resize(threads.size());
  for (std::size_t k = 0; k < threads.size(); ++k)
  {
    Guided nozzle;
    nozzle.topic = prefixes[k] + "nozzle/pose";
    nozzle.name = prefixes[k] + "nozzle";
    const auto* tf = threads[k].nozzle ? std::get_if<TfMotion>(&threads[k].nozzle->motion) : nullptr;
    const bool moved = threads[k].nozzle && std::holds_alternative<TopicMotion>(threads[k].nozzle->motion);
    if (tf)
      nozzle.frame = tf->frame;
    if (moved || tf)
      nozzle.buffer =
          std::make_unique<GuideBuffer>(options, Attach::section, threads[k].nozzle->pose, tf ? tf->offset : Pose());
    guided_.push_back(std::move(nozzle));
    if (moved)
      subscribePose(nh);
    framed |= moved;
    threads_[k].greatest_flow = greatestFlow(threads[k], simulation.config().time.step);
    threads_[k].flow_topic = threads[k].nozzle && threads[k].nozzle->flow.topic;
    threads_[k].belt_topic = threads[k].floor && (threads[k].floor->belt_x.topic || threads[k].floor->belt_y.topic);
    framed |= threads_[k].belt_topic;
    if (threads_[k].flow_topic)
      subscribers_.push_back(
          subscribe<std_msgs::Float64>(nh, prefixes[k] + "nozzle/flow", kQueueSize,
                                       [this, k](const std_msgs::Float64& message) { onFlow(k, message); }));
    if (threads_[k].belt_topic)
      subscribers_.push_back(subscribe<geometry_msgs::Vector3Stamped>(
          nh, prefixes[k] + "belt/velocity", kQueueSize,
          [this, k](const geometry_msgs::Vector3Stamped& message) { onBelt(k, message); }));
  }
  return framed;
}

void GuideInputs::addSolids(const Simulation& simulation, const GuideBuffer::Options& options)
{
  const auto add = [&](const std::string& name, const GivenMotion& motion, const Pose& pose) {
    Guided guided;
    guided.name = name;
    if (std::holds_alternative<TopicMotion>(motion))
    {
      guided.body = name;
      guided.buffer = std::make_unique<GuideBuffer>(options, Attach::section, pose);
    }
    if (const auto* tf = std::get_if<TfMotion>(&motion))
    {
      guided.frame = tf->frame;
      guided.buffer = std::make_unique<GuideBuffer>(options, Attach::section, pose, tf->offset);
    }
    guided_.push_back(std::move(guided));
  };
  const SceneConfig& scene = simulation.config();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    add(scene.bodies[b].name, scene.bodies[b].motion.value_or(FixedMotion{}), simulation.state().bodies[b].X_WB);
  bodies_ = scene.bodies.size();
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    add(scene.obstacles[k].name, scene.obstacles[k].motion, simulation.state().obstacles[k]);
  obstacles_ = scene.obstacles.size();
}

void GuideInputs::onPose(int guided, const geometry_msgs::PoseStamped& message)
{
  drops_.receive();
  const std::string& topic = guided_[guided].topic;
  if (const std::optional<Pose> X_FH = checkedPose(message.pose, topic, guided_[guided].name, drops_))
    intake_.take({{guided, topic}, {{guided, *X_FH}}}, message.header);
}

void GuideInputs::onGuides(const geometry_msgs::PoseArray& message)
{
  drops_.receive();
  if (message.poses.size() != grasps_)
  {
    drops_.drop(
        Drop::wrong_length, "guides",
        std::to_string(message.poses.size()) + " poses, but the scene has " + std::to_string(grasps_) + " grasps");
    return;
  }
  std::vector<Entry> entries;
  for (std::size_t g = 0; g < grasps_; ++g)
  {
    const std::optional<Pose> X_FH = checkedPose(message.poses[g], "guides", guided_[g].name, drops_);
    if (!X_FH)
      return;   // all grasps at one instant, or none
    if (guided_[g].byMessages())
      entries.push_back({static_cast<int>(g), *X_FH});
  }
  intake_.take({{kGuidesSource, "guides"}, entries}, message.header);
}

void GuideInputs::onBodies(const slender_sim::BodyStates& message)
{
  drops_.receive();
  if (!isComplete(message, "bodies", drops_))
    return;
  std::vector<Entry> entries;
  for (std::size_t b = 0; b < message.name.size(); ++b)
  {
    const std::optional<Pose> X_FH = checkedPose(message.pose[b], "bodies", message.name[b], drops_);
    if (!X_FH)
      return;
    if (!message.twist.empty() && !isFinite(message.twist[b]))
    {
      drops_.drop(Drop::not_finite, "bodies", "twist of " + message.name[b]);
      return;
    }
    bool known = false;
    for (std::size_t g = 0; g < guided_.size(); ++g)
    {
      if (guided_[g].body.empty() || guided_[g].body != message.name[b])   // a name may be empty, too
        continue;
      known = true;
      entries.push_back({static_cast<int>(g), *X_FH});
    }
    if (!known)
      drops_.drop(Drop::unknown_name, "bodies", "nothing follows \"" + message.name[b] + "\"");
  }
  if (!entries.empty())
    intake_.take({{kBodiesSource, "bodies"}, entries}, message.header);
}

Use GuideInputs::use(const Message& message, const Pose& X_WF)
{
  for (const Entry& entry : message.entries)
    if (!((X_WF * entry.X_FH).position.cwiseAbs().maxCoeff() <= kMaxCoordinate))
      return Use::out_of_range;
  const double time = clock_.secondsAt(message.stamp);
  Use use = Use::good;
  for (const Entry& entry : message.entries)
    if (!takePose(static_cast<std::size_t>(entry.guided), time, X_WF * entry.X_FH))
      use = Use::out_of_order;
  return use;
}

bool GuideInputs::takePose(std::size_t guided, double time, const Pose& X_WH)
{
  const bool later = guided_[guided].buffer->push(time, X_WH);
  if (later)
    takenPose(guided, time, X_WH);
  return later;
}

void GuideInputs::processPending()
{
  tracking_->processPending();
  takeHand();
  intake_.processPending();
}

void GuideInputs::onPresent(const std::function<ros::Time()>& present)
{
  intake_.onPresent(present);
  tracking_->onPresent(present);
}

void GuideInputs::takeKept(bool all)
{
  if (all)
    drops_.deliveredKept();
  intake_.takeKept(all);
  tracking_->takeKept(all);
}

void GuideInputs::apply(double time, SceneInputs& inputs)
{
  tf_->look();
  shareLag();
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (guided_[g].buffer)
    {
      const std::size_t solid = g - grasps_;
      if (g >= grasps_ + bodies_ + obstacles_)
      {
        inputs.threads[solid - bodies_ - obstacles_].nozzle = guided_[g].buffer->target(time).X_WG;
        continue;
      }
      GraspTarget& target = g < grasps_       ? inputs.grasps[g]
                            : solid < bodies_ ? inputs.bodies[solid]
                                              : inputs.obstacles[solid - bodies_];
      target = guided_[g].buffer->target(time);
    }
  tracking_->apply(time, inputs);
  if (wind_)
    inputs.wind = *wind_;
  for (std::size_t k = 0; k < threads_.size(); ++k)
  {
    if (threads_[k].flow)
      inputs.threads[k].flow_rate = *threads_[k].flow;
    if (threads_[k].belt)
      inputs.threads[k].belt_velocity = *threads_[k].belt;
  }
}

Pose GuideInputs::poseOf(const Simulation& simulation, std::size_t guided) const
{
  const std::size_t solid = guided - grasps_;
  if (guided < grasps_)
    return simulation.grasps().pose(static_cast<int>(guided));
  if (solid < bodies_)
    return simulation.state().bodies[solid].X_WB;
  if (solid < bodies_ + obstacles_)
    return simulation.state().obstacles[solid - bodies_];
  return simulation.state().threads[solid - bodies_ - obstacles_].threads.front().ends[1].X_WE;
}

void GuideInputs::attachAt(int grasp, const Pose& X_WG)
{
  if (guided_[grasp].buffer)
    guided_[grasp].buffer->attachAt(X_WG);
}

void GuideInputs::attachAll(const Simulation& simulation)
{
  hand_.clear();
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (guided_[g].buffer)
      guided_[g].buffer->attachAt(poseOf(simulation, g));
  tracking_->attachAll(simulation);
}

void GuideInputs::catchUp(const Simulation& simulation)
{
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (guided_[g].buffer)
      guided_[g].buffer->catchUpFrom(poseOf(simulation, g));
  tracking_->attachAll(simulation);
}

void GuideInputs::restart(const Simulation& simulation)
{
  intake_.clear();
  drops_.deliveredKept();
  hand_.clear();
  wind_.reset();
  for (Driven& thread : threads_)
    thread.flow.reset(), thread.belt.reset();
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (guided_[g].buffer)
      guided_[g].buffer->restart(poseOf(simulation, g));
  tracking_->restart(simulation);
  tf_->restart();
}

void GuideInputs::skip(double seconds)
{
  for (Guided& guided : guided_)
    if (guided.buffer)
      guided.buffer->skip(seconds);
  tracking_->skip(seconds);
}

}   // namespace slender
