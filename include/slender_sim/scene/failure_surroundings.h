#pragma once

#include <string>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// What is near the place of a failed step, for its message: the nearest active grasp, weld or held end of the same
/// object, and the nearest thing that the object may touch, each with its distance. "; the nearest grasp is 'left',
/// 0.01 m away; the nearest contact partner is obstacle 'box', 0.001 m away". Empty where nothing is near, or no place
/// is known.
std::string surroundingsOf(const Simulation& simulation, const FailurePlace& place);

}   // namespace slender
