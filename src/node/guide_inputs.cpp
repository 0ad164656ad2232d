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

  addGrasps(nh, buffer_options, names.grasps);
  addSolids(nh, buffer_options);
  addThreads(nh, buffer_options, names.nozzles);
  const auto any = [](const auto& things, const auto& fits) { return std::any_of(things.begin(), things.end(), fits); };
  if (any(guided_, [](const Guided& guided) { return guided.kind == Kind::grasp && guided.byMessages(); }))
    subscribers_.push_back(subscribe<geometry_msgs::PoseArray>(
        nh, "guides", kQueueSize, [this](const geometry_msgs::PoseArray& message) { onGuides(message); }));
  if (any(guided_, [](const Guided& guided) { return !guided.body.empty(); }))
    subscribers_.push_back(subscribe<slender_sim::BodyStates>(
        nh, "bodies", kQueueSize, [this](const slender_sim::BodyStates& message) { onBodies(message); }));
  wind_topic_ = simulation.config().wind_topic;
  if (wind_topic_)
    subscribers_.push_back(subscribe<geometry_msgs::Vector3Stamped>(
        nh, "wind", kQueueSize, [this](const geometry_msgs::Vector3Stamped& message) { onWind(message); }));
  addGuides(nh, buffer_options);
  tf_ = std::make_unique<TfInputs>(options_, clock_, tf_buffer_, drops_, std::move(own_frames));
  followFrames();
  if (!tf_listener_ && (any(guided_, [](const Guided& guided) { return guided.buffer != nullptr; }) || wind_topic_ ||
                        any(threads_, [](const Driven& thread) { return thread.belt_topic; }) || !guides_.empty()))
    tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_, true, ros::TransportHints().tcpNoDelay());
  if (before)
    takeOver(*before);
}

/// `X_HG` is as in GuideBuffer.
template <class AnyMotion>
void GuideInputs::addGuided(ros::NodeHandle& nh, const GuideBuffer::Options& options, Guided guided,
                            const AnyMotion& motion, Attach attach, const Pose& X_WG, const std::optional<Pose>& X_HG)
{
  if (const auto* tf = std::get_if<TfMotion>(&motion))
    guided.frame = tf->frame;
  if (comesFromOutside(motion) || !guided.body.empty())
    guided.buffer = std::make_unique<GuideBuffer>(options, attach, X_WG, X_HG);
  if (guided.byMessages())
  {
    const int number = static_cast<int>(guided_.size());
    subscribers_.push_back(subscribe<geometry_msgs::PoseStamped>(
        nh, guided.topic, kQueueSize,
        [this, number](const geometry_msgs::PoseStamped& message) { onPose(number, message); }));
  }
  guided_.push_back(std::move(guided));
}

void GuideInputs::addGrasps(ros::NodeHandle& nh, const GuideBuffer::Options& options,
                            const std::vector<std::string>& names)
{
  const std::set<std::string> solids = solidNames(simulation_->config());
  const SceneGrasps& grasps = simulation_->grasps();
  for (int g = 0; g < static_cast<int>(grasps.size()); ++g)
  {
    const GraspConfig& config = *grasps[g].config;
    Guided guided{Kind::grasp, g, "grasps/" + grasps.heldObject(g) + "/" + names[g], names[g],
                  "grasps/" + names[g] + "/pose"};
    const auto* body = std::get_if<BodyMotion>(&config.motion);
    if (body && !solids.count(body->body))
      guided.body = body->body;
    addGuided(nh, options, std::move(guided), config.motion, config.attach, grasps.pose(g), offsetInFrame(config));
  }
}

/// Returns the kind and name of the object for messages, for example "grasp left".
std::string GuideInputs::kindOf(std::size_t guided) const
{
  static const char* const kinds[] = {"grasp ", "body ", "obstacle ", ""};
  return kinds[static_cast<int>(guided_[guided].kind)] + guided_[guided].name;
}

void GuideInputs::followFrames()
{
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (!guided_[g].frame.empty())
      tf_->follow(guided_[g].frame, kindOf(g),
                  [this, g](double time, const Pose& X_WF) { return takePose(g, time, X_WF); });
  for (int g = 0; g < static_cast<int>(guides_.size()); ++g)
    if (guides_[g].by_tf)
      tf_->follow(guides_[g].carried->bodies.front(), guides_[g].topic,
                  [this, g](double time, const Pose& X_WF) { return takeBody(g, 0, time, X_WF); });
}

/// Calls visit(buffer) for all buffers.
template <class Visit>
void GuideInputs::forBuffers(const Visit& visit)
{
  for (Guided& guided : guided_)
    if (guided.buffer)
      visit(*guided.buffer);
  for (Guide& guide : guides_)
  {
    if (guide.points)
      visit(*guide.points);
    for (GuideBuffer& body : guide.bodies)
      visit(body);
  }
}

/// Gives all inputs the same lag, so that links of a robot, the grasp in its gripper and objects that messages move are
/// shown at the same instant. The lag is the largest one that an input with recent poses needs. Scenes without frames
/// of tf keep a lag per input.
void GuideInputs::shareLag()
{
  if (!tf_->any())
    return;
  double lag = 0.0;
  forBuffers([&](const auto& buffer) {
    if (buffer.lastTime() && clock_.seconds() - *buffer.lastTime() <= options_.guide_timeout)
      lag = std::max(lag, buffer.timing().wantedLag());
  });
  forBuffers([lag](auto& buffer) { buffer.lagAtLeast(lag); });
}

void GuideInputs::addThreads(ros::NodeHandle& nh, const GuideBuffer::Options& options,
                             const std::vector<std::string>& prefixes)
{
  const std::vector<ThreadConfig>& threads = simulation_->config().threads;
  prefixes_ = prefixes;
  threads_.resize(threads.size());
  for (std::size_t k = 0; k < threads.size(); ++k)
  {
    const NozzleConfig nozzle = threads[k].nozzle.value_or(NozzleConfig{});
    const auto* tf = std::get_if<TfMotion>(&nozzle.motion);
    addGuided(nh, options,
              {Kind::nozzle, static_cast<int>(k), "threads/" + threads[k].name, prefixes[k] + "nozzle",
               prefixes[k] + "nozzle/pose"},
              nozzle.motion, Attach::section, nozzle.pose, tf ? tf->offset : Pose());
    threads_[k].greatest_flow = greatestFlow(threads[k], simulation_->config().time.step);
    threads_[k].flow_topic = threads[k].nozzle && threads[k].nozzle->flow.topic;
    threads_[k].belt_topic = threads[k].floor && (threads[k].floor->belt_x.topic || threads[k].floor->belt_y.topic);
    if (threads_[k].flow_topic)
      subscribers_.push_back(
          subscribe<std_msgs::Float64>(nh, prefixes[k] + "nozzle/flow", kQueueSize,
                                       [this, k](const std_msgs::Float64& message) { onFlow(k, message); }));
    if (threads_[k].belt_topic)
      subscribers_.push_back(subscribe<geometry_msgs::Vector3Stamped>(
          nh, prefixes[k] + "belt/velocity", kQueueSize,
          [this, k](const geometry_msgs::Vector3Stamped& message) { onBelt(k, message); }));
  }
}

void GuideInputs::addSolids(ros::NodeHandle& nh, const GuideBuffer::Options& options)
{
  const auto add = [&](Kind kind, std::size_t index, const char* list, const std::string& name,
                       const GivenMotion& motion, const Pose& pose) {
    const auto* tf = std::get_if<TfMotion>(&motion);
    Guided guided{kind, static_cast<int>(index), list + name, name, ""};
    if (std::holds_alternative<TopicMotion>(motion))
      guided.body = name;
    addGuided(nh, options, std::move(guided), motion, Attach::section, pose, tf ? tf->offset : Pose());
  };
  const SceneConfig& scene = simulation_->config();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    add(Kind::body, b, "bodies/", scene.bodies[b].name, scene.bodies[b].motion.value_or(FixedMotion{}),
        simulation_->state().bodies[b].X_WB);
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    add(Kind::obstacle, k, "obstacles/", scene.obstacles[k].name, scene.obstacles[k].motion,
        simulation_->state().obstacles[k]);
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
  const std::size_t grasps = simulation_->grasps().size();
  if (message.poses.size() != grasps)
    return drops_.drop(
        Drop::wrong_length, "guides",
        std::to_string(message.poses.size()) + " poses, but the scene has " + std::to_string(grasps) + " grasps");
  std::vector<Entry> entries;
  for (std::size_t g = 0; g < grasps; ++g)
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
  const auto refused = [&](std::size_t b) {
    const bool bad = !message.twist.empty() && !isFinite(message.twist[b]);
    if (bad)
      drops_.drop(Drop::not_finite, "bodies", "twist of " + message.name[b]);
    return bad;
  };
  const auto find = [this](const std::string& name, const Pose& X_FH, std::vector<Entry>& entries) {
    for (std::size_t g = 0; g < guided_.size(); ++g)
      if (!guided_[g].body.empty() && guided_[g].body == name)   // a name may be empty, too
        entries.push_back({static_cast<int>(g), X_FH});
    return "nothing follows \"" + name + "\"";
  };
  takeBodies(message, {{kBodiesSource, "bodies"}}, refused, find);
}

Use GuideInputs::use(const Message& message, const Pose& X_WF)
{
  Eigen::Matrix3Xd points = message.points;
  if (message.frame != options_.frame_id)   // an identity would round
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      points.col(i) = X_WF * Eigen::Vector3d(points.col(i));
  bool good = points.cols() == 0 || points.cwiseAbs().maxCoeff() <= kMaxCoordinate;
  for (const Entry& entry : message.entries)
    good = good && (X_WF * entry.X_FH).position.cwiseAbs().maxCoeff() <= kMaxCoordinate;
  if (!good)
    return Use::out_of_range;
  const double time = clock_.secondsAt(message.stamp);
  const int guide = kFirstGuideSource - message.source;
  bool late = points.cols() > 0 && !takePoints(guide, time, points);
  for (const Entry& entry : message.entries)
  {
    const Pose X_WH = X_WF * entry.X_FH;
    late |= guide >= 0 ? !takeBody(guide, entry.guided, time, X_WH)
                       : !takePose(static_cast<std::size_t>(entry.guided), time, X_WH);
  }
  return late ? Use::out_of_order : Use::good;
}

bool GuideInputs::takePose(std::size_t guided, double time, const Pose& X_WH)
{
  const bool later = guided_[guided].buffer->push(time, X_WH);
  if (later)
    takenPose(slender_sim::Input::POSE, guided, guided_[guided].name, time, X_WH);
  return later;
}

void GuideInputs::processPending()
{
  takeHand();
  intake_.processPending();
}

void GuideInputs::onPresent(const std::function<ros::Time()>& present) { intake_.onPresent(present); }

void GuideInputs::takeKept(bool all)
{
  if (all)
    drops_.deliveredKept();
  intake_.takeKept(all);
}

void GuideInputs::apply(double time, SceneInputs& inputs)
{
  tf_->look();
  shareLag();
  std::vector<GraspTarget>* const targets[] = {&inputs.grasps, &inputs.bodies, &inputs.obstacles};
  for (Guided& guided : guided_)
    if (guided.buffer && guided.kind == Kind::nozzle)
      inputs.threads[guided.index].nozzle = guided.buffer->target(time).X_WG;
    else if (guided.buffer)
      (*targets[static_cast<int>(guided.kind)])[guided.index] = guided.buffer->target(time);
  applyGuides(time, inputs);
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
  const int index = guided_[guided].index;
  switch (guided_[guided].kind)
  {
    case Kind::grasp: return simulation.grasps().pose(index);
    case Kind::body: return simulation.state().bodies[index].X_WB;
    case Kind::obstacle: return simulation.state().obstacles[index];
    default: return simulation.state().threads[index].threads.front().ends[1].X_WE;
  }
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
  attachGuides(simulation);
}

void GuideInputs::catchUp(const Simulation& simulation)
{
  for (std::size_t g = 0; g < guided_.size(); ++g)
    if (guided_[g].buffer)
      guided_[g].buffer->catchUpFrom(poseOf(simulation, g));
  attachGuides(simulation);
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
  attachGuides(simulation);
  for (Guide& guide : guides_)
  {
    if (guide.points)
      guide.points->restart(guide.held);
    for (GuideBuffer& body : guide.bodies)
      body.restart(Pose());
  }
  tf_->restart();
}

void GuideInputs::skip(double seconds)
{
  for (Guide& guide : guides_)
    guide.gap_start += seconds;
  forBuffers([seconds](auto& buffer) { buffer.skip(seconds); });
}

}   // namespace slender
