#pragma once

#include "slender_sim/scene/scene_state.h"

/// Grasps of cloths: how they take hold of vertices.
namespace slender {

/// Holds these vertices where they are: its frame has the world's axes.
ClothGrasp clothGraspOf(const ClothState& cloth, std::vector<int> vertices);
/// Throws std::invalid_argument unless the vertices, ascending, are those of the cloth, differ, and no active grasp but
/// the one at `index` holds them.
void checkVertices(const std::vector<int>& vertices, const ClothConfig& config, const ClothState& cloth,
                   const std::vector<ClothGrasp>& grasps, std::size_t index);
/// Pins the vertices that active grasps hold, and no others.
void gatherPins(const std::vector<ClothGrasp>& grasps, ClothState& cloth);

}   // namespace slender
