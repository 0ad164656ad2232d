#pragma once

#include <string>
#include <vector>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

struct MeshDefect
{
  enum Kind
  {
    not_finite,            ///< a vertex
    bad_index,             ///< a face names a vertex that is not there, or one twice
    degenerate_face,       ///< height below 1e-6 of the longest side
    non_manifold_edge,     ///< more than two faces
    opposed_faces,         ///< two faces run along their edge in the same direction
    non_manifold_vertex,   ///< faces that touch there only
    duplicate_vertices,    ///< at the same place
    unreferenced_vertex,   ///< in no face
    empty                  ///< no faces
  };
  Kind kind;
  std::vector<int> vertices, faces;   ///< concerned, from 0
  std::string message;                ///< names them and says what to do
};

/// Everything that keeps a mesh from being simulated as a cloth, in the order of MeshDefect::Kind. Positions within
/// `tolerance` of the bounding box's diagonal count as the same place. Where vertices or indices are unsound, only
/// these are reported.
std::vector<MeshDefect> meshDefects(const TriangleMesh& mesh, double tolerance = 1e-9);

/// Those of connectivity alone: bad_index, non_manifold_edge, opposed_faces, non_manifold_vertex, empty.
std::vector<MeshDefect> topologyDefects(const TriangleMesh& mesh);

/// Throws std::invalid_argument "NAME: ..." with the first five defects and the number of all, if there are any.
void requireSoundMesh(const TriangleMesh& mesh, const std::string& name);

}   // namespace slender
