#pragma once

#include <memory>

#include "step_group.h"
#include "world_objects.h"

/// Groups that have rods or bodies. All throw std::invalid_argument for models that are not valid.
namespace slender {

/// A rod that nothing else meets and that tracks a guide. The model of the world outlives the group.
std::unique_ptr<StepGroup> makeTrackedRod(const WorldModel& world, int rod);
/// Rods, and bodies that welds join with them, in explicit steps. Appends the grasps of the welds to the rods of the
/// state.
std::unique_ptr<StepGroup> makeExplicitRods(const WorldModel& world, WorldContent content, WorldState& state);

}   // namespace slender
