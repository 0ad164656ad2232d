#pragma once

#include <vector>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Edges of a triangle mesh whose faces agree in orientation, and what lies beside them.
struct MeshTopology
{
  Eigen::Matrix2Xi edges;            ///< tail and head, in the direction in which the left face runs along it
  Eigen::Matrix2Xi edge_faces;       ///< left and right face; right -1: boundary
  Eigen::Matrix2Xi edge_opposites;   ///< third vertices of those faces; right -1: boundary
  Eigen::Matrix3Xi face_edges;       ///< edge k of a face joins its corners k and k+1
  Eigen::Matrix4Xi hinges;           ///< of inner edges: tail, head, third vertex of the left face, of the right face
  std::vector<int> hinge_edges;      ///< edge of each hinge
  /// Closed curves of boundary vertices, in the direction of their faces (left of it).
  std::vector<std::vector<int>> boundaries;
  std::vector<char> on_boundary;   ///< per vertex

  int edgeCount() const { return static_cast<int>(edges.cols()); }
  int hingeCount() const { return static_cast<int>(hinges.cols()); }
};

/// Edges are numbered as the faces come to them. Throws std::invalid_argument naming vertices and faces where an edge
/// has more than two faces, its two faces run along it in the same direction, or faces touch in a vertex only (see
/// meshDefects).
MeshTopology meshTopology(const TriangleMesh& mesh);

}   // namespace slender
