#pragma once

#include <memory>

#include "island.h"

/// The islands of cloths, tracked or not. All throw std::invalid_argument for models that are not valid.
namespace slender {

/// A cloth without contact. The model of the world outlives the island.
std::unique_ptr<ClothIsland> makeLoneCloth(const WorldModel& world, int cloth);
/// Cloths with contact, and the obstacles and driven bodies that they meet.
std::unique_ptr<ClothIsland> makeTouchingCloths(const WorldModel& world, std::vector<int> cloths);

}   // namespace slender
