// What the tracked cloths of a scene follow.
#include <algorithm>
#include <stdexcept>

#include "slender_sim/scene/simulation.h"

namespace slender {

void Simulation::startTracking(int cloth)
{
  const TrackingConfig& tracking = *config_.cloths[cloth].tracking;
  SceneCloth& held = state_.cloths[cloth];
  tracking.guide.evaluate(0.0, held.guide);
  held.guide_forces.setZero(3, tracking.constraints->count());
}

void Simulation::addGuideInputs(SceneInputs& inputs, double time) const
{
  inputs.guides.resize(config_.cloths.size());
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    if (const auto& tracking = config_.cloths[k].tracking)
    {
      if (tracking->guide.byTopic() || std::holds_alternative<ClothGuide>(tracking->guide.motion))
      {
        inputs.guides[k] = state_.cloths[k].guide;
      }
      else
      {
        tracking->guide.evaluate(time, inputs.guides[k]);
      }
    }
  }
}

void Simulation::checkGuides(const SceneInputs& inputs) const
{
  if (inputs.guides.size() != config_.cloths.size())
  {
    throw std::invalid_argument("inputs.guides has " + std::to_string(inputs.guides.size()) + " entries; must have " +
                                std::to_string(config_.cloths.size()) + ", one per cloth of the scene");
  }
  for (std::size_t k = 0; k < config_.cloths.size(); ++k)
  {
    const Eigen::Index expected = config_.cloths[k].tracking ? config_.cloths[k].tracking->guide.mesh.vertices.cols() : 0;
    if (inputs.guides[k].cols() != expected)
    {
      throw std::invalid_argument("inputs.guides of " + config_.cloths[k].name + " has " + std::to_string(inputs.guides[k].cols()) +
                                  " vertices; must have " + std::to_string(expected));
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
      const ClothPlace& place = cloth_places_[k];
      held.guide = guideVertices(static_cast<int>(k), inputs);
      held.guide_forces = place.group >= 0 ? touching_cloths_[place.group].group.averageForces(place.index) : cloth_steppers_[k]->averageForces();
      report.tracking_error = std::max(report.tracking_error, trackingError(static_cast<int>(k)).met / tracking->size);
      report.forces_at_bound += static_cast<int>(held.cloth.at_bound.size());
    }
  }
}

Simulation::TrackingError Simulation::trackingError(int cloth) const
{
  const auto& tracking = config_.cloths.at(static_cast<std::size_t>(cloth)).tracking;
  TrackingError error;
  if (!tracking)
  {
    return error;
  }
  const SceneCloth& held = state_.cloths[static_cast<std::size_t>(cloth)];
  const WeakConstraints& constraints = *tracking->constraints;
  const Eigen::Matrix3Xd targets = constraints.averages(held.guide);
  for (int i = 0; i < constraints.count(); ++i)
  {
    double& worst = std::binary_search(held.cloth.at_bound.begin(), held.cloth.at_bound.end(), i) ? error.at_bound : error.met;
    worst = std::max(worst, constraints.distance(i, targets, held.cloth.x));
  }
  return error;
}

}  // namespace slender
