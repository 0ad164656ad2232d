#pragma once

#include <string>

#include "slender_sim/scene/simulation.h"

/// Returns what the message of a failed step says beside the reason of the failure.
namespace slender {

/// What is near the place of a failed step, for its message: the nearest active grasp, weld or held end of the same
/// object, and the nearest thing that the object may touch, each with its distance. "; the nearest grasp is 'left',
/// 0.01 m away; the nearest contact partner is obstacle 'box', 0.001 m away". Empty where nothing is near, or no place
/// is known.
std::string surroundingsOf(const Simulation& simulation, const FailurePlace& place);

/// Searches for two grasps of rods that overlap during a step with these inputs. Two grasps overlap if the sections
/// that they hold touch, or if the distance is too short for the few edges between them. Returns a sentence that names
/// both grasps, for the message of a failed step, or an empty text if no grasps overlap.
std::string overlapOfGrasps(const Simulation& simulation, const WorldInputs& inputs);

}   // namespace slender
