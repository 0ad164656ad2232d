#pragma once

#include <memory>

#include "island.h"
#include "joined_objects.h"

/// The islands that have rods or bodies. All throw std::invalid_argument for models that are not valid.
namespace slender {

/// A rod that nothing else meets and that tracks a guide. The model of the world outlives the island.
std::unique_ptr<RodIsland> makeTrackedRod(const WorldModel& world, int rod);
/// Rods, and bodies that welds join with them, in explicit steps. Appends the grasps of the welds to the rods of the state.
std::unique_ptr<RodIsland> makeExplicitRods(const WorldModel& world, IslandContent content, WorldState& state);

}   // namespace slender
