// What the tracked cloths of a scene follow.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "slender_sim/scene/simulation.h"

namespace slender {

void Simulation::startTracking(int cloth)
{
  tracks_ = true;
  const TrackingConfig& tracking = *config_.cloths[cloth].tracking;
  SceneCloth& held = state_.cloths[cloth];
  if (tracking.sets.size() > 1)
    tracking.guide.evaluate(0.0, held.guide, &held.guide_velocity);
  else
    tracking.guide.evaluate(0.0, held.guide);
  held.guide_forces.setZero(3, tracking.sets[0].constraints->count());
}

namespace {

/// The set takes over in the step that begins after so many.
bool isDue(const FunctionSet& set, std::uint64_t steps, double step)
{
  return set.from && std::ceil(*set.from / step - 1e-6) == static_cast<double>(steps);
}

}   // namespace

bool Simulation::functionsDue() const
{
  for (const ClothConfig& config : config_.cloths)
  {
    for (std::size_t s = 0; config.tracking && s < config.tracking->sets.size(); ++s)
      if (isDue(config.tracking->sets[s], state_.steps, config_.time.step))
        return true;
  }
  return false;
}

/// Where the scene says so, at the start of a step; of several that are due in it the latest.
void Simulation::takeOver()
{
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    const auto& tracking = config_.cloths[k].tracking;
    const FunctionSet* latest = nullptr;
    for (std::size_t s = 0; tracking && s < tracking->sets.size(); ++s)
    {
      const FunctionSet& set = tracking->sets[s];
      if (isDue(set, state_.steps, config_.time.step) && (!latest || *set.from > *latest->from))
        latest = &set;
    }
    if (latest)
      takeOver(state_.cloths[k], *tracking, static_cast<std::size_t>(latest - tracking->sets.data()), latest->blend);
  }
}

/// The guide's speed is that of the last step, as the cloth's is: where it jumped just then the cloth did, too.
void Simulation::takeOver(SceneCloth& held, const TrackingConfig& tracking, std::size_t set, double blend) const
{
  const WeakConstraints& functions = *tracking.sets[set].constraints;
  held.blend = FunctionBlend::between(functions, held.guide, held.guide_velocity, held.cloth.x, held.cloth.v,
                                      state_.time, blend);
  held.cloth.average_set = static_cast<int>(set);
  held.cloth.at_bound.clear();
  held.guide_forces.setZero(3, functions.count());
}

void Simulation::setFunctions(int cloth, const std::string& set, std::optional<double> blend)
{
  const ClothConfig& config = config_.cloths.at(static_cast<std::size_t>(cloth));
  if (!config.tracking)
    throw std::invalid_argument("cloth " + config.name + " tracks no guide");
  const auto& sets = config.tracking->sets;
  const auto found = std::find_if(sets.begin(), sets.end(), [&set](const FunctionSet& one) { return one.name == set; });
  if (sets.size() < 2)
  {
    throw std::invalid_argument("cloth " + config.name +
                                " has one set of test functions; give its test_functions as a list of named ones");
  }
  if (found == sets.end())
  {
    std::string known;
    for (const FunctionSet& one : sets)
      known += " " + one.name;
    throw std::invalid_argument("no test functions \"" + set + "\"; cloth " + config.name + " has:" + known);
  }
  if (blend && !(std::isfinite(*blend) && *blend >= 0))
    throw std::invalid_argument("blend must be a time [s], 0 or more");
  SceneCloth& held = state_.cloths[static_cast<std::size_t>(cloth)];
  if (!held.cloth.pins.empty())   // without any they are as independent as when they were read
  {
    std::vector<char> pinned(static_cast<std::size_t>(held.cloth.x.cols()), 0);
    for (const int vertex : held.cloth.pins)
      pinned[static_cast<std::size_t>(vertex)] = 1;
    found->constraints->requireIndependent(pinned);
  }
  takeOver(held, *config.tracking, static_cast<std::size_t>(found - sets.begin()), blend.value_or(found->blend));
}

const FunctionSet& Simulation::functions(int cloth) const
{
  return config_.cloths.at(static_cast<std::size_t>(cloth))
      .tracking->sets.at(static_cast<std::size_t>(state_.cloths[cloth].cloth.average_set));
}

void Simulation::addGuideInputs(SceneInputs& inputs, double time) const
{
  if (!tracks_)
    return;
  inputs.guides.resize(config_.cloths.size());
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    if (const auto& tracking = config_.cloths[k].tracking)
      if (tracking->guide.byTopic() || std::holds_alternative<ClothGuide>(tracking->guide.motion))
        inputs.guides[k] = state_.cloths[k].guide;
      else
        tracking->guide.evaluate(time, inputs.guides[k]);
    else
      inputs.guides[k].resize(3, 0);
  }
}

void Simulation::checkGuides(const SceneInputs& inputs) const
{
  const std::size_t needed = tracks_ ? config_.cloths.size() : 0;
  if (inputs.guides.size() != needed)
  {
    throw std::invalid_argument("inputs.guides has " + std::to_string(inputs.guides.size()) + " entries; must have " +
                                std::to_string(needed) + ", one per cloth of a scene that tracks anything");
  }
  for (std::size_t k = 0; k < needed; ++k)
  {
    const Eigen::Index expected =
        config_.cloths[k].tracking ? config_.cloths[k].tracking->guide.mesh.vertices.cols() : 0;
    if (inputs.guides[k].cols() != expected)
    {
      throw std::invalid_argument("inputs.guides of " + config_.cloths[k].name + " has " +
                                  std::to_string(inputs.guides[k].cols()) + " vertices; must have " +
                                  std::to_string(expected));
    }
  }
}

/// At the end of the step: a cloth that guides has been stepped when this is asked for.
const Eigen::Matrix3Xd& Simulation::guideVertices(int cloth, const SceneInputs& inputs) const
{
  const auto* preview = std::get_if<ClothGuide>(&config_.cloths[cloth].tracking->guide.motion);
  return preview ? state_.cloths[preview->cloth].cloth.x : inputs.guides[cloth];
}

/// After a step.
void Simulation::takeGuides(const SceneInputs& inputs, StepReport& report)
{
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    if (const auto& tracking = config_.cloths[k].tracking)
    {
      SceneCloth& held = state_.cloths[k];
      const Eigen::Matrix3Xd& guide = guideVertices(static_cast<int>(k), inputs);
      if (tracking->sets.size() > 1)
        held.guide_velocity = (guide - held.guide) / config_.time.step;
      held.guide = guide;
      if (!held.blend.active(state_.time))
        held.blend = FunctionBlend();
      held.guide_forces = cloth_steppers_[k]
                              ? cloth_steppers_[k]->averageForces()
                              : touching_cloths_[cloth_places_[k].group].group.averageForces(cloth_places_[k].index);
      report.tracking_error =
          std::max(report.tracking_error, errorOf(static_cast<int>(k), cloth_inputs_[k].averages).met / tracking->size);
      report.forces_at_bound += static_cast<int>(held.cloth.at_bound.size());
    }
  }
}

Simulation::TrackingError Simulation::trackingError(int cloth) const
{
  if (!config_.cloths.at(static_cast<std::size_t>(cloth)).tracking)
    return TrackingError();
  const SceneCloth& held = state_.cloths[static_cast<std::size_t>(cloth)];
  Eigen::Matrix3Xd targets = functions(cloth).constraints->averages(held.guide);
  held.blend.apply(state_.time, targets);
  return errorOf(cloth, targets);
}

/// From what its averages shall be, 3 x count.
Simulation::TrackingError Simulation::errorOf(int cloth, const Eigen::Matrix3Xd& targets) const
{
  const SceneCloth& held = state_.cloths[static_cast<std::size_t>(cloth)];
  const WeakConstraints& constraints = *functions(cloth).constraints;
  TrackingError error;
  error.blend = held.blend.left(state_.time);
  for (int i = 0; i < constraints.count(); ++i)
  {
    double& worst =
        std::binary_search(held.cloth.at_bound.begin(), held.cloth.at_bound.end(), i) ? error.at_bound : error.met;
    worst = std::max(worst, constraints.distance(i, targets, held.cloth.x));
  }
  return error;
}

}   // namespace slender
