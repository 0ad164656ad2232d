#pragma once

#include <string>
#include <vector>

#include "slender_sim/BodyStates.h"
#include "slender_sim/ClothState.h"
#include "slender_sim/Fields.h"
#include "slender_sim/MeshStamped.h"
#include "slender_sim/RodState.h"
#include "slender_sim/ThreadState.h"
#include "slender_sim/scene/snapshot.h"

/// Messages of a bag as objects of a snapshot. All of these throw BagError for a message whose arrays do not fit each
/// other, or which has numbers that are not finite.
namespace slender {

/// `what`: of which message.
void requireArrays(bool fits, const std::string& what);

/// `scene`: the recorded one, which says what a rod or a cloth tracks; null: it is not known.
void addSnapshot(const slender_sim::RodState& rod, const SceneConfig* scene, SceneSnapshot& out);
void addSnapshot(const slender_sim::ThreadState& thread, SceneSnapshot& out);
/// `meshes`: all that the bag has, in the order of their stamps.
void addSnapshot(const slender_sim::ClothState& cloths, const std::vector<slender_sim::MeshStamped>& meshes,
                 const SceneConfig* scene, SceneSnapshot& out);
void addSnapshot(const slender_sim::BodyStates& states, std::vector<SolidSnapshot>& solids);
void addSnapshot(const slender_sim::Fields& fields, SceneSnapshot& out);

}   // namespace slender
