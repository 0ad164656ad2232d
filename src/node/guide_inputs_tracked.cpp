// Guides of tracked cloths and rods by message or tf.
#include "slender_sim/node/guide_inputs.h"

#include <algorithm>
#include <map>

#include "subscribe.h"

namespace slender {
namespace {

constexpr int kGuideQueueSize = 100;

}   // namespace

bool GuideInputs::Guide::heard() const
{
  return std::any_of(bodies.begin(), bodies.end(), [](const GuideBuffer& body) { return body.lastTime().has_value(); });
}

const GuideRef& GuideInputs::refOf(const Guide& guide) const { return simulation_->guides()[guide.index]; }

void GuideInputs::addGuides(ros::NodeHandle& nh, const GuideBuffer::Options& options)
{
  const std::vector<GuideRef>& all = simulation_->guides();
  for (std::size_t k = 0; k < all.size(); ++k)
  {
    const GuideConfig& config = all[k].tracking->guide;
    if (!config.byTopic())
      continue;
    Guide guide;
    guide.index = k;
    guide.held = simulation_->state().guide(all[k].object).points;
    guide.carried = std::get_if<CarriedGuide>(&config.motion);
    guide.by_tf = guide.carried && guide.carried->by_tf;
    guide.topic =
        (all.size() == 1 ? std::string() : "tracked/" + all[k].name + "/") + (guide.by_tf     ? "guide"
                                                                              : guide.carried ? "guide/bodies"
                                                                                              : "guide/points");
    GuideBuffer::Options own = options;
    own.coast = config.coast;
    for (std::size_t b = 0; guide.carried && b < guide.carried->bodies.size(); ++b)
      guide.bodies.emplace_back(own, guide.carried->keeps_offset ? Attach::initial : Attach::section, Pose(),
                                guide.carried->keeps_offset ? std::nullopt : std::optional(guide.carried->offset));
    if (!guide.carried)
      guide.points = std::make_unique<PointGuideBuffer>(own, guide.held);
    const int g = static_cast<int>(guides_.size());
    if (guide.carried && !guide.by_tf)
      subscribers_.push_back(subscribe<slender_sim::BodyStates>(
          nh, guide.topic, kGuideQueueSize, [this, g](const slender_sim::BodyStates& m) { onGuideBodies(g, m); }));
    else if (!guide.carried)
      subscribers_.push_back(subscribe<sensor_msgs::PointCloud2>(
          nh, guide.topic, kGuideQueueSize, [this, g](const sensor_msgs::PointCloud2& m) { onGuidePoints(g, m); }));
    guides_.push_back(std::move(guide));
  }
}

/// Takes over the guides of objects that exist in both scenes. Adds their sources to `moved`.
void GuideInputs::takeOverGuides(GuideInputs& before, std::map<int, int>& moved)
{
  for (std::size_t j = 0; j < before.guides_.size(); ++j)
    for (std::size_t k = 0; k < guides_.size(); ++k)
    {
      Guide &old = before.guides_[j], &now = guides_[k];
      const GuideRef &old_ref = before.refOf(old), &ref = refOf(now);
      if (old_ref.object.kind != ref.object.kind || old_ref.name != ref.name)
        continue;
      moved[sourceOfGuide(j)] = sourceOfGuide(k);
      // The index in the scene, the topic and the carried guide come from the edited scene.
      old.index = now.index;
      old.topic = now.topic;
      old.carried = now.carried;
      now = std::move(old);
    }
}

void GuideInputs::onGuidePoints(int guide, const sensor_msgs::PointCloud2& message)
{
  drops_.receive();
  const std::string& what = guides_[guide].topic;
  Message taken{{sourceOfGuide(guide), what}};
  const std::string why = fromPoints(message, taken.points);
  if (!why.empty())
    return drops_.drop(Drop::wrong_length, what, why);
  const Eigen::Index expected = guides_[guide].held.cols();
  const bool of_cloth = refOf(guides_[guide]).object.isCloth();
  if (taken.points.cols() != expected)
    return drops_.drop(Drop::wrong_length, what,
                       std::to_string(taken.points.cols()) + " points, but the guide" + (of_cloth ? "'s mesh" : "") +
                           " has " + std::to_string(expected) + (of_cloth ? " vertices" : " nodes"));
  if (!taken.points.allFinite())
    return drops_.drop(Drop::not_finite, what, "all points must be finite");
  intake_.take(std::move(taken), message.header);
}

void GuideInputs::onGuideBodies(int guide, const slender_sim::BodyStates& message)
{
  const std::vector<std::string>& names = guides_[guide].carried->bodies;
  const auto find = [&names](const std::string& name, const Pose& X_FH, std::vector<Entry>& entries) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end())
      entries.push_back({static_cast<int>(found - names.begin()), X_FH});
    return "\"" + name + "\" carries no vertices of the guide";
  };
  takeBodies(
      message, {{sourceOfGuide(guide), guides_[guide].topic}}, [](std::size_t) { return false; }, find);
}

bool GuideInputs::takeBody(int guide, int body, double time, const Pose& X_WH)
{
  const bool later = guides_[guide].bodies[body].push(time, X_WH);
  if (later)
    takenPose(slender_sim::Input::GUIDE_BODY, guide, guides_[guide].carried->bodies[body], time, X_WH, body);
  return later;
}

bool GuideInputs::takePoints(int guide, double time, const Eigen::Matrix3Xd& points)
{
  const bool later = guides_[guide].points->push(time, points);
  if (later)
    takenPoints(guide, time, points);
  return later;
}

void GuideInputs::applyGuides(double time, SceneInputs& inputs)
{
  for (Guide& guide : guides_)
  {
    if (guide.points)
      inputs.guides[guide.index] = guide.points->target(time);
    else if (guide.heard())   // until then it stays
      placeBodies(guide, time, inputs.guides[guide.index]);
  }
}

void GuideInputs::placeBodies(Guide& guide, double time, Eigen::Matrix3Xd& vertices) const
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
    guide.gap_duration = way > 1e-9 ? std::max(options_.catch_up_time, way / options_.catch_up_speed) : 0.0;
  }
  const double s = guide.gap_duration > 0.0 ? (time - guide.gap_start) / guide.gap_duration : 1.0;
  if (s < 1.0)
    vertices += (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s) * guide.gap;
}

/// All guides go on from where they are now.
void GuideInputs::attachGuides(const Simulation& simulation)
{
  for (Guide& guide : guides_)
  {
    guide.held = simulation.state().guide(refOf(guide).object).points;
    guide.catches_up = true;
    if (guide.points)
      guide.points->attachAt(guide.held);
  }
}

}   // namespace slender
