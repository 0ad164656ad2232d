#pragma once

#include <memory>

#include "step_group.h"
#include "world_objects.h"

namespace slender {

/// Rods, and bodies that welds join with them, in explicit steps. Appends the grasps of the welds to the rods of the
/// state. The model of the world outlives the group. Throws std::invalid_argument for models that are not valid.
std::unique_ptr<StepGroup> makeExplicitRods(const WorldModel& world, WorldContent content, WorldState& state);

}   // namespace slender
