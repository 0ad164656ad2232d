#pragma once

#include <cstddef>
#include <string>

#include "slender_sim/scene/scene_state.h"

/// All that a later step reads, as bytes: what saved states consist of. Equal bytes are equal states, bit by bit.
namespace slender {

std::string stateBytes(const RodState& state);
std::string stateBytes(const ThreadGroupState& state);
std::string stateBytes(const ClothState& state);
std::string stateBytes(const SceneState& state);

/// Whether all numbers of the state are finite.
bool allFinite(const SceneState& state);

/// Throws std::runtime_error when the bytes end too early or late, or hold a size that cannot be, or numbers that are
/// not finite.
SceneState stateOfBytes(const char* bytes, std::size_t size);

}   // namespace slender
