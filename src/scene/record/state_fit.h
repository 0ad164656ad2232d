#pragma once

#include <string>

#include "slender_sim/scene/scene_state.h"
#include "slender_sim/world/world_model.h"

namespace slender {

/// What does not fit between a state that takes over and the scene, whose state is `now`; empty when all does.
std::string misfit(const SceneState& loaded, const SceneState& now, const WorldModel& world);

}   // namespace slender
