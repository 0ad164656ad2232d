#pragma once

#include <functional>

#include "study/framework/scene_cases.h"
#include "slender_sim/geometry/triangle_mesh.h"

/// Meshes and pictures of meshes that several studies share.
namespace slender::study {

/// The faces whose middle is to be kept, and their vertices.
TriangleMesh cutAway(const TriangleMesh& mesh, const std::function<bool(const Eigen::Vector3d&)>& keep);

/// Closed grid of `along` x `around` vertices on at(s, t), s and t from 0 to 2 pi; two triangles per cell, outside
/// where d/ds x d/dt points.
TriangleMesh closedGrid(int along, int around, const std::function<Eigen::Vector3d(double, double)>& at);

/// Draws the edges of the faces from `first_face` on that are turned to the camera.
void drawFaces(Plot& picture, const std::string& label, const TriangleMesh& mesh, const Camera& camera,
               Eigen::Index first_face = 0, const Eigen::Vector3d& shift = Eigen::Vector3d::Zero());

}   // namespace slender::study
