#pragma once

#include <Eigen/SparseCore>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

struct Subdivision
{
  /// its first vertices are those of the coarse mesh, in their order
  TriangleMesh mesh;
  /// fine x coarse vertices: fine = coarse * weights^T, rows sum to 1
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights;
};

/// Divides each face into four plane ones through the middles of its edges, `levels` times (>= 0). Column j of the
/// weights is the coarse mesh's hat function of vertex j at the fine vertices.
Subdivision subdivide(const TriangleMesh& mesh, int levels);

}   // namespace slender
