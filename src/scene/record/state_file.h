#pragma once

#include <cstdint>
#include <string>

#include "slender_sim/scene/scene_state.h"
#include "slender_sim/world/world_model.h"

namespace slender {

/// What a saved state must have in common with the scene that takes it up again.
std::uint64_t stateFingerprint(const SceneConfig& config, const WorldModel& world);

/// Returns a text if the state `loaded` does not fit the scene with the present state `now`, or an empty text if it
/// fits.
std::string misfit(const SceneState& loaded, const SceneState& now, const WorldModel& world);

}   // namespace slender
