#pragma once

#include <string>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// Searches for two grasps of rods that overlap during a step with these inputs. Two grasps overlap if the sections
/// that they hold touch, or if the distance is too short for the few edges between them. Returns a sentence that names
/// both grasps, for the message of a failed step, or an empty text if no grasps overlap.
std::string overlapOfGrasps(const Simulation& simulation, const WorldInputs& inputs);

}   // namespace slender
