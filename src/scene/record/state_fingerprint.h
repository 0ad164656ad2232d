#pragma once

#include <cstdint>

#include "slender_sim/scene/config.h"
#include "slender_sim/world/world_model.h"

namespace slender {

/// What a saved state must have in common with the scene that takes it up again.
std::uint64_t stateFingerprint(const SceneConfig& config, const WorldModel& world);

}   // namespace slender
