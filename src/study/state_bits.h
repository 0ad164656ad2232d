#pragma once

#include "slender_sim/scene/simulation.h"

/// Whether a step that was refused has left everything that a later one reads as it was, bit for bit.
namespace slender::study {

bool sameBits(const RodState& a, const RodState& b);
bool sameBits(const ClothState& a, const ClothState& b);
bool sameBits(const SceneCloth& a, const SceneCloth& b);
bool sameBits(const ThreadGroupState& a, const ThreadGroupState& b);
/// Time, rods, threads and cloths.
bool sameBits(const SceneState& a, const SceneState& b);

}  // namespace slender::study
