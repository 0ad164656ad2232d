#pragma once

#include <string>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// Looks for two grasps of rods that leave the rods no room during a step with these inputs: the sections that they
/// hold meet, or next to no room is left for the few edges between them. Returns a sentence that names both grasps, for
/// the message of a failed step; empty when there are none.
std::string overlapOfGrasps(const Simulation& simulation, const WorldInputs& inputs);

}   // namespace slender
