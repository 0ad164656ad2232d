#pragma once

#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {

/// What holds the objects of an instant, as the nodes' markers show it. A grasp of a rod is a box, or a ball where it
/// holds a position only. A grasp of a cloth is a ball at each vertex that the scene lets it hold. A nozzle is a
/// cylinder above its spout. Without `scene` there are no nozzles, and grasps of cloths are one ball each.
std::vector<ObjectMesh> holderMeshes(const SceneSnapshot& instant, const SceneConfig* scene);

/// A piece of each plane among the obstacles but the one at the height of the ground, about as large as `box`, around
/// its middle.
std::vector<ObjectMesh> planeMeshes(const SceneSnapshot& instant, const SceneConfig& scene,
                                    const Eigen::AlignedBox3d& box, const std::optional<double>& ground);

/// Height of a thread's floor, or of a horizontal plane among the obstacles.
std::optional<double> groundOf(const SceneConfig* scene);

}   // namespace slender
