#include "slender_sim/node/tracking_inputs.h"

#include <algorithm>
#include <map>

#include "slender_sim/node/converters.h"
#include "subscribe.h"

namespace slender {
namespace {

constexpr int kQueueSize = 100;
constexpr std::size_t kMaxPending = 300;

bool withinReach(const Eigen::Matrix3Xd& points)
{
  return points.cols() == 0 || points.cwiseAbs().maxCoeff() <= kMaxCoordinate;
}

/// Calls f(buffer) for the buffers of guides: one of the points, or one per body.
template <class Guides, class F>
void forBuffers(Guides& guides, const F& f)
{
  for (auto& guide : guides)
  {
    if (guide.points)
      f(*guide.points);
    for (auto& body : guide.bodies)
      f(body);
  }
}

/// `index`: of a guide of the scene.
const Eigen::Matrix3Xd& guideNow(const Simulation& simulation, int index)
{
  return simulation.state().guide(simulation.guides()[index].object).points;
}

}   // namespace

TrackingInputs::TrackingInputs(ros::NodeHandle& nh, const NodeOptions& options, const GuideBuffer::Options& buffers,
                               const Simulation& simulation, const SimClock& clock, const tf2_ros::Buffer& tf,
                               DropCounter& drops)
  : options_(options),
    buffers_(buffers),
    clock_(clock),
    drops_(drops),
    intake_(options, clock, tf, drops, kMaxPending,
            [this](const Message& message, const Pose& X_WF) { return use(message, X_WF); })
{
  const std::vector<GuideRef>& all = simulation.guides();
  for (std::size_t k = 0; k < all.size(); ++k)
  {
    Guide guide;
    guide.index = static_cast<int>(k);
    guide.of_rod = !all[k].object.isCloth();
    guide.object = all[k].name;
    guide.topic = all.size() == 1 ? std::string() : "tracked/" + all[k].name + "/";
    if (all[k].tracking->guide.byTopic())
      addGuide(all[k].tracking->guide, guideNow(simulation, guide.index), std::move(guide));
  }
  for (std::size_t g = 0; g < guides_.size(); ++g)
  {
    const int index = static_cast<int>(g);
    if (guides_[g].carried && guides_[g].carried->by_tf)
      continue;   // see followFrames()
    if (guides_[g].carried)
      subscribers_.push_back(subscribe<slender_sim::BodyStates>(
          nh, guides_[g].topic, kQueueSize, [this, index](const slender_sim::BodyStates& m) { onBodies(index, m); }));
    else
      subscribers_.push_back(subscribe<sensor_msgs::PointCloud2>(
          nh, guides_[g].topic, kQueueSize, [this, index](const sensor_msgs::PointCloud2& m) { onPoints(index, m); }));
  }
}

void TrackingInputs::takeOver(TrackingInputs& before)
{
  std::map<int, int> moved;
  for (std::size_t j = 0; j < before.guides_.size(); ++j)
    for (std::size_t k = 0; k < guides_.size(); ++k)
    {
      Guide &old = before.guides_[j], &now = guides_[k];
      if (old.of_rod != now.of_rod || old.object != now.object)
        continue;
      moved[static_cast<int>(j)] = static_cast<int>(k);
      // The index in the scene, the topic and the carried guide come from the edited scene.
      old.index = now.index;
      old.topic = now.topic;
      old.carried = now.carried;
      now = std::move(old);
    }
  intake_.takeOver(before.intake_, [&](Message& message) {
    const auto found = moved.find(message.source);
    if (found == moved.end())
      return false;
    message.source = found->second;
    message.what = guides_[found->second].topic;
    return true;
  });
}

/// `guide`: with its topic's prefix.
void TrackingInputs::addGuide(const GuideConfig& config, const Eigen::Matrix3Xd& now, Guide guide)
{
  guide.carried = std::get_if<CarriedGuide>(&config.motion);
  guide.topic += guide.carried && guide.carried->by_tf ? "guide" : guide.carried ? "guide/bodies" : "guide/points";
  GuideBuffer::Options own = buffers_;
  own.coast = config.coast;
  if (guide.carried)
    for (std::size_t b = 0; b < guide.carried->bodies.size(); ++b)
      guide.bodies.emplace_back(own, guide.carried->keeps_offset ? Attach::initial : Attach::section, Pose(),
                                guide.carried->keeps_offset ? std::nullopt : std::optional(guide.carried->offset));
  else
    guide.points = std::make_unique<PointGuideBuffer>(own, now);
  guide.held = now;
  guides_.push_back(std::move(guide));
}

void TrackingInputs::followFrames(TfInputs& tf)
{
  for (std::size_t g = 0; g < guides_.size(); ++g)
  {
    if (!guides_[g].carried || !guides_[g].carried->by_tf)
      continue;
    const int guide = static_cast<int>(g);
    tf.follow(guides_[g].carried->bodies.front(), guides_[g].topic,
              [this, guide](double time, const Pose& X_WF) { return takeBody(guide, 0, time, X_WF); });
  }
}

double TrackingInputs::wantedLag() const
{
  double lag = 0.0;
  const auto ask = [&](const auto& buffer) {
    if (buffer.lastTime() && clock_.seconds() - *buffer.lastTime() <= options_.guide_timeout)
      lag = std::max(lag, buffer.timing().wantedLag());
  };
  forBuffers(guides_, ask);
  return lag;
}

void TrackingInputs::lagAtLeast(double lag)
{
  forBuffers(guides_, [lag](auto& buffer) { buffer.lagAtLeast(lag); });
}

void TrackingInputs::skip(double seconds)
{
  for (Guide& guide : guides_)
    guide.gap_start += seconds;
  forBuffers(guides_, [seconds](auto& buffer) { buffer.skip(seconds); });
}

void TrackingInputs::onPoints(int guide, const sensor_msgs::PointCloud2& message)
{
  drops_.receive();
  const std::string& what = guides_[guide].topic;
  Message taken{{guide, what}};
  const std::string why = fromPoints(message, taken.points);
  if (!why.empty())
    return drops_.drop(Drop::wrong_length, what, why);
  if (taken.points.cols() != guides_[guide].held.cols())
    return drops_.drop(
        Drop::wrong_length, what,
        std::to_string(taken.points.cols()) + " points, but the guide" + (guides_[guide].of_rod ? "" : "'s mesh") +
            " has " + std::to_string(guides_[guide].held.cols()) + (guides_[guide].of_rod ? " nodes" : " vertices"));
  if (!taken.points.allFinite())
    return drops_.drop(Drop::not_finite, what, "all points must be finite");
  intake_.take(std::move(taken), message.header);
}

void TrackingInputs::onBodies(int guide, const slender_sim::BodyStates& message)
{
  drops_.receive();
  const std::string& what = guides_[guide].topic;
  if (!isComplete(message, what, drops_))
    return;
  Message taken{{guide, what}};
  const std::vector<std::string>& names = guides_[guide].carried->bodies;
  for (std::size_t b = 0; b < message.name.size(); ++b)
  {
    const std::optional<Pose> pose = checkedPose(message.pose[b], what, message.name[b], drops_);
    if (!pose)
      return;
    const auto found = std::find(names.begin(), names.end(), message.name[b]);
    if (found == names.end())
      drops_.drop(Drop::unknown_name, what, "\"" + message.name[b] + "\" carries no vertices of the guide");
    else
      taken.bodies.emplace_back(static_cast<int>(found - names.begin()), *pose);
  }
  if (!taken.bodies.empty())
    intake_.take(std::move(taken), message.header);
}

Use TrackingInputs::use(const Message& message, const Pose& X_WF)
{
  Guide& guide = guides_[message.source];
  const double time = clock_.secondsAt(message.stamp);
  Eigen::Matrix3Xd points = message.points;
  if (message.frame != options_.frame_id)   // an identity would round
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      points.col(i) = X_WF * Eigen::Vector3d(points.col(i));
  bool good = withinReach(points);
  for (const auto& [body, pose] : message.bodies)
    good = good && (X_WF * pose.position).cwiseAbs().maxCoeff() <= kMaxCoordinate;
  if (!good)
    return Use::out_of_range;
  bool late = false;
  if (guide.points)
  {
    late = !guide.points->push(time, points);
    if (!late)
      takenPoints(message.source, time, points);
  }
  for (const auto& [body, pose] : message.bodies)
    late |= !takeBody(message.source, body, time, X_WF * pose);
  return late ? Use::out_of_order : Use::good;
}

bool TrackingInputs::takeBody(int guide, int body, double time, const Pose& X_WH)
{
  const bool later = guides_[guide].bodies[body].push(time, X_WH);
  if (later)
    takenBody(guide, body, time, X_WH);
  return later;
}

void TrackingInputs::apply(double time, SceneInputs& inputs)
{
  for (Guide& guide : guides_)
  {
    Eigen::Matrix3Xd& vertices = inputs.guides[guide.index];
    if (guide.points)
      vertices = guide.points->target(time);
    else if (guide.heard())   // until then it stays
      placeBodies(guide, time, vertices);
  }
}

void TrackingInputs::placeBodies(Guide& guide, double time, Eigen::Matrix3Xd& vertices) const
{
  guide.poses.clear();
  for (GuideBuffer& body : guide.bodies)
    guide.poses.push_back(body.target(time).X_WG);
  guide.carried->binding.place(guide.poses, vertices);
  if (guide.catches_up)
  {
    guide.catches_up = false;
    guide.gap = guide.held - vertices;
    const double way = guide.gap.colwise().norm().maxCoeff();
    guide.gap_start = time;
    guide.gap_duration = way > 1e-9 ? std::max(buffers_.catch_up_time, way / buffers_.catch_up_speed) : 0.0;
  }
  const double s = guide.gap_duration > 0.0 ? (time - guide.gap_start) / guide.gap_duration : 1.0;
  if (s < 1.0)
    vertices += (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s) * guide.gap;
}

void TrackingInputs::start(Guide& guide, const Eigen::Matrix3Xd& vertices) const
{
  guide.held = vertices;
  guide.catches_up = true;
}

void TrackingInputs::attachAll(const Simulation& simulation)
{
  for (Guide& guide : guides_)
  {
    const Eigen::Matrix3Xd& now = guideNow(simulation, guide.index);
    start(guide, now);
    if (guide.points)
      guide.points->attachAt(now);
  }
}

void TrackingInputs::restart(const Simulation& simulation)
{
  intake_.clear();
  for (Guide& guide : guides_)
  {
    const Eigen::Matrix3Xd& now = guideNow(simulation, guide.index);
    start(guide, now);
    if (guide.points)
      guide.points->restart(now);
    for (GuideBuffer& body : guide.bodies)
      body.restart(Pose());
  }
}

bool TrackingInputs::Guide::heard() const
{
  return std::any_of(bodies.begin(), bodies.end(), [](const GuideBuffer& body) { return body.lastTime().has_value(); });
}

std::vector<TrackingInputs::Age> TrackingInputs::ages() const
{
  std::vector<Age> ages;
  for (const Guide& guide : guides_)
  {
    if (guide.points)
      ages.push_back(ageOf(guide.topic, *guide.points, clock_.seconds()));
    for (std::size_t b = 0; b < guide.bodies.size(); ++b)   // one may fall silent while others speak
    {
      const std::string& body = guide.carried->bodies[b];
      ages.push_back(ageOf(guide.topic + (guide.carried->by_tf ? " (tf " + body + ")" : " " + body), guide.bodies[b],
                           clock_.seconds()));
      ages.back().missing = !ages.back().seconds && guide.heard();
    }
  }
  return ages;
}

}   // namespace slender
