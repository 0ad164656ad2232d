#pragma once

#include <memory>

#include "step_group.h"

namespace slender {

/// Cloths whose contact is by impulses, tracked or not, and the obstacles and driven bodies that they meet. The model
/// of the world outlives the group. Throws std::invalid_argument for models that are not valid.
std::unique_ptr<StepGroup> makeTouchingCloths(const WorldModel& world, std::vector<int> cloths);

}   // namespace slender
