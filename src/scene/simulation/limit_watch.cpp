#include "slender_sim/scene/limit_watch.h"

#include <algorithm>
#include <cmath>

namespace slender {

namespace {

using LimitKind = LimitExcess::Kind;

constexpr double kExcursionEnd = 0.95;   // share of the limit; an excursion ends below it
constexpr double kNextRelease = 0.1;     // [s] time after which a lasting excursion releases the next grasp

const char* limitName(LimitKind kind)
{
  static const char* const names[] = {"strain", "force", "torque", "speed"};
  return names[static_cast<int>(kind)];
}

/// Largest distance that one of the points moves [m]. Returns 0 if the numbers of points differ or are 0.
double largestMove(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to)
{
  return from.cols() == to.cols() && from.cols() > 0 ? (to - from).colwise().norm().maxCoeff() : 0.0;
}

double moveTo(const Pose& from, const GraspTarget& to) { return (to.X_WG.position - from.position).norm(); }

bool hasInput(const std::optional<GivenMotion>& motion)
{
  return motion && !std::holds_alternative<FixedMotion>(*motion);
}

/// Limit of the strain of a rod [-] for scenes that give none.
double defaultStrainLimit(const RodConfig& rod)
{
  const Material& material = rod.material;
  if (material.inextensible)
    return kInextensibleStrain;
  const double area = M_PI * rod.cross_section.a.front() * rod.cross_section.b.front();
  const double modulus = material.stretch_modulus ? *material.stretch_modulus / area : material.youngs_modulus;
  return modulus >= kStiffModulus ? kStiffStrain : kSoftStrain;
}

double edgeLength(const ClothModel& model, const Eigen::Matrix3Xd& x, int edge)
{
  return (x.col(model.topology.edges(1, edge)) - x.col(model.topology.edges(0, edge))).norm();
}

const Pose& nozzlePose(const ThreadGroupState& group) { return group.threads.front().ends[1].X_WE; }

}   // namespace

LimitWatch::LimitWatch(Simulation& simulation) : simulation_(simulation), limits_(simulation.config().limits)
{
  for (const RodConfig& rod : simulation.config().rods)
    rod_strain_limits_.push_back(limits_.strain.value_or(defaultStrainLimit(rod)));
  cloth_strain_limit_ = limits_.strain.value_or(kSoftStrain);
  for (int c = 0; c < static_cast<int>(simulation.config().cloths.size()); ++c)
  {
    const ClothModel& model = simulation.clothModel(c);
    cloth_lengths_.emplace_back(model.topology.edgeCount());
    for (int e = 0; e < model.topology.edgeCount(); ++e)
      cloth_lengths_.back()[e] = edgeLength(model, model.rest.vertices, e);
  }
}

/// Returns true if a value is within its limit and no excursion of it is under way.
bool LimitWatch::isQuiet(const Key& key, double value, double limit) const
{
  return value <= limit && (excursions_.empty() || excursions_.count(key) == 0);
}

/// Begins or ends the excursion of a value. `subject` is the text for messages, for example "grasp 'left': its force".
void LimitWatch::look(const Key& key, double value, double limit, const std::string& subject, const char* unit,
                      std::vector<int> to_release, std::vector<LimitExcess>& begun)
{
  const auto found = excursions_.find(key);
  if (value <= (found == excursions_.end() ? limit : kExcursionEnd * limit))
  {
    if (found != excursions_.end())
      excursions_.erase(found);
    return;
  }
  const double now = simulation_.state().time;
  if (found != excursions_.end() && (limits_.on_limit != OnLimit::release || now < found->second.next_action))
    return;
  Excursion& excursion = excursions_[key];
  const std::string text = subject + " " + shortNumber(value, 4) + unit + " exceeds limits." + limitName(key.first) +
                           " = " + shortNumber(limit, 4) + unit + " (t = " + shortNumber(now, 6) + " s)";
  excursion.worst = {key.first, value, limit, std::move(to_release), text};
  act(excursion);
  if (found != excursions_.end())
    return;   // the same excursion goes on
  ++count_;
  begun.push_back(excursion.worst);
}

void LimitWatch::act(Excursion& excursion)
{
  const std::string& why = excursion.worst.text;
  switch (limits_.on_limit)
  {
    case OnLimit::warn: return;
    case OnLimit::hold: held_ = held_.empty() ? why : held_; return;
    case OnLimit::stop: stopped_ = stopped_.empty() ? why : stopped_; return;
    case OnLimit::release:
      excursion.next_action = simulation_.state().time + kNextRelease;
      for (const int grasp : excursion.worst.to_release)
      {
        if (!simulation_.grasps().isActive(grasp))
          continue;
        simulation_.grasps().release(grasp);
        released_.push_back({grasp, why});
      }
  }
}

std::vector<LimitExcess> LimitWatch::checkInputs(SceneInputs& inputs)
{
  std::vector<LimitExcess> begun;
  released_.clear();
  if (!held_.empty())
  {
    holdInputs(inputs);
    return begun;
  }
  const SceneConfig& config = simulation_.config();
  const SceneState& state = simulation_.state();
  int index = 0;
  // texts and lists are made only when something is to be told: a quiet step takes no memory
  const auto see = [&](double move, const char* kind, const std::string& name, int grasp = -1) {
    const Key key{LimitKind::speed, index++};
    const double speed = move / config.time.step;
    if (!isQuiet(key, speed, limits_.speed))
      look(key, speed, limits_.speed, kind + (" '" + name) + "': the speed of its input", " m/s",
           grasp < 0 ? std::vector<int>{} : std::vector<int>{grasp}, begun);
  };
  for (std::size_t g = 0; g < simulation_.grasps().size(); ++g)
  {
    const int grasp = static_cast<int>(g);
    const bool driven = simulation_.grasps().isActive(grasp) &&
                        !std::holds_alternative<FixedMotion>(simulation_.grasps()[g].config->motion);
    see(driven ? moveTo(simulation_.grasps().pose(grasp), inputs.grasps[g]) : 0.0, "grasp",
        simulation_.grasps()[g].config->name, grasp);
  }
  for (std::size_t b = 0; b < config.bodies.size(); ++b)
    see(hasInput(config.bodies[b].motion) ? moveTo(state.bodies[b].X_WB, inputs.bodies[b]) : 0.0, "body",
        config.bodies[b].name);
  for (std::size_t k = 0; k < config.obstacles.size(); ++k)
    see(hasInput(config.obstacles[k].motion) ? moveTo(state.obstacles[k], inputs.obstacles[k]) : 0.0, "obstacle",
        config.obstacles[k].name);
  for (std::size_t k = 0; k < config.threads.size(); ++k)
    see(config.threads[k].nozzle && hasInput(config.threads[k].nozzle->motion)
            ? (inputs.threads[k].nozzle.position - nozzlePose(state.threads[k]).position).norm()
            : 0.0,
        "thread", config.threads[k].name);
  std::size_t next = 0;
  for (const GuideRef& guide : simulation_.guides())
    see(largestMove(state.guide(guide.object).points, inputs.guides[next++]), guide.object.isCloth() ? "cloth" : "rod",
        guide.name);
  if (!held_.empty())
    holdInputs(inputs);
  return begun;
}

/// Replaces the targets of all driven objects by their present places, at rest. Flows, belts and wind go on.
void LimitWatch::holdInputs(SceneInputs& inputs) const
{
  const SceneState& state = simulation_.state();
  for (std::size_t g = 0; g < inputs.grasps.size(); ++g)
    inputs.grasps[g] = {simulation_.grasps().pose(static_cast<int>(g)), Twist{}};
  for (std::size_t b = 0; b < inputs.bodies.size(); ++b)
    inputs.bodies[b] = {state.bodies[b].X_WB, Twist{}};
  for (std::size_t k = 0; k < inputs.obstacles.size(); ++k)
    inputs.obstacles[k] = {state.obstacles[k], Twist{}};
  for (std::size_t k = 0; k < inputs.threads.size(); ++k)
    if (simulation_.config().threads[k].nozzle)
      inputs.threads[k].nozzle = nozzlePose(state.threads[k]);
  for (std::size_t g = 0; g < inputs.guides.size(); ++g)
    inputs.guides[g] = state.guide(simulation_.guides()[g].object).points;
}

std::vector<LimitExcess> LimitWatch::checkStep()
{
  std::vector<LimitExcess> begun;
  released_.clear();
  for (std::size_t g = 0; g < simulation_.grasps().size(); ++g)
  {
    const int grasp = static_cast<int>(g);
    const GraspConfig& config = *simulation_.grasps()[g].config;
    const double force_limit = config.limits.force.value_or(limits_.force),
                 torque_limit = config.limits.torque.value_or(limits_.torque);
    if (std::isinf(force_limit) && std::isinf(torque_limit))
      continue;
    const bool active = simulation_.grasps().isActive(grasp);
    const Wrench& wrench = simulation_.grasps().wrench(grasp);
    const auto see = [&](const Key& key, double value, double limit, const char* unit) {
      if (!isQuiet(key, value, limit))
        look(key, value, limit, "grasp '" + config.name + "': its " + limitName(key.first), unit, {grasp}, begun);
    };
    see({LimitKind::force, grasp}, active ? wrench.force.norm() : 0.0, force_limit, " N");
    see({LimitKind::torque, grasp}, active ? wrench.torque.norm() : 0.0, torque_limit, " N m");
  }
  checkStrains(begun);
  return begun;
}

void LimitWatch::checkStrains(std::vector<LimitExcess>& begun)
{
  if (limits_.strain && std::isinf(*limits_.strain))
    return;
  const int rods = static_cast<int>(simulation_.config().rods.size());
  for (int r = 0; r < rods; ++r)
  {
    const RodModel& model = simulation_.rodModel(r);
    const Eigen::Matrix3Xd& x = simulation_.state().rods[r].x;
    const auto stretch = [&](int j) { return (x.col((j + 1) % x.cols()) - x.col(j)).norm() / model.rest_length[j]; };
    const auto name = [&](int j) { return "rod '" + model.name + "', edge " + std::to_string(j); };
    checkStrain({LimitKind::strain, r}, rod_strain_limits_[r], model.edges(), stretch, name, {ObjectRef::rod, r},
                begun);
  }
  for (int c = 0; c < static_cast<int>(simulation_.config().cloths.size()); ++c)
  {
    const ClothModel& model = simulation_.clothModel(c);
    const Eigen::Matrix3Xd& x = simulation_.state().cloths[c].x;
    const auto stretch = [&](int e) { return edgeLength(model, x, e) / cloth_lengths_[c][e]; };
    const auto name = [&](int e) {
      const auto [a, b] = std::minmax({model.topology.edges(0, e), model.topology.edges(1, e)});
      return "cloth '" + model.name + "', between vertices " + std::to_string(a) + " and " + std::to_string(b);
    };
    checkStrain({LimitKind::strain, rods + c}, cloth_strain_limit_, model.topology.edgeCount(), stretch, name,
                {ObjectRef::cloth, c}, begun);
  }
}

/// Checks the largest strain of the edges of a rod or cloth. stretch(edge) is the length of an edge over that at rest.
/// name(edge) is for messages.
template <class Stretch, class Name>
void LimitWatch::checkStrain(const Key& key, double limit, int edges, const Stretch& stretch, const Name& name,
                             const ObjectRef& object, std::vector<LimitExcess>& begun)
{
  double strain = 0.0;
  int worst = 0;
  for (int e = 0; e < edges; ++e)
    if (const double here = std::abs(stretch(e) - 1.0); here > strain)
    {
      strain = here;
      worst = e;
    }
  if (!isQuiet(key, strain, limit))
    look(key, strain, limit, name(worst) + ": its strain", "", mostLoaded(object), begun);
}

/// Returns the active grasp with the largest force of a rod or cloth. Returns no grasp if there is none, and without
/// `on_limit: release`.
std::vector<int> LimitWatch::mostLoaded(const ObjectRef& object) const
{
  if (limits_.on_limit != OnLimit::release)
    return {};
  int most = -1;
  double largest = -1.0;
  for (std::size_t g = 0; g < simulation_.grasps().size(); ++g)
  {
    const int grasp = static_cast<int>(g);
    if (!(simulation_.grasps()[g].object == object) || !simulation_.grasps().isActive(grasp))
      continue;
    const double force = simulation_.grasps().wrench(grasp).force.norm();
    if (force > largest)
    {
      largest = force;
      most = grasp;
    }
  }
  return most < 0 ? std::vector<int>{} : std::vector<int>{most};
}

void LimitWatch::goOn() { held_.clear(); }

void LimitWatch::reset()
{
  excursions_.clear();
  released_.clear();
  held_.clear();
  stopped_.clear();
}

std::vector<std::string> LimitWatch::lasting() const
{
  std::vector<std::string> texts;
  for (const auto& [key, excursion] : excursions_)
    texts.push_back(excursion.worst.text);
  return texts;
}

}   // namespace slender
