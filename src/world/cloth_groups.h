#pragma once

#include <memory>

#include "step_group.h"

/// Groups of cloths, tracked or not. All throw std::invalid_argument for models that are not valid.
namespace slender {

/// A cloth without contact. The model of the world outlives the group.
std::unique_ptr<StepGroup> makeLoneCloth(const WorldModel& world, int cloth);
/// Cloths with contact, and the obstacles and driven bodies that they meet.
std::unique_ptr<StepGroup> makeTouchingCloths(const WorldModel& world, std::vector<int> cloths);

}   // namespace slender
