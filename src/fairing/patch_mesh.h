#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Faces that close a loop of vertices of a mesh, and what improves them. The mesh's own vertices and edges stay as
/// they are.
class PatchMesh
{
public:
  /// `loop` runs so that the patch is left of it; `edge_lengths` are wanted at its vertices [m]; `taken` are edges of
  /// the mesh between vertices of the loop (lower number first), which a patch cannot have again.
  PatchMesh(const TriangleMesh& mesh, const std::vector<int>& loop, const std::vector<double>& edge_lengths,
            std::vector<Eigen::Vector3i> faces, std::set<std::pair<int, int>> taken);

  /// Divides faces at their middle where their vertices are farther apart than wanted there, with flips, until none is
  /// left [Liepa 2003]. Returns how many vertices were added.
  int refine();
  /// Flips edges whose opposite angles exceed pi together.
  void flip();
  /// Moves the inner vertices along the surface towards the middle of their neighbours.
  void even(int sweeps);

  int vertices() const { return static_cast<int>(points_.size()); }
  /// The mesh with this patch, its inner vertices behind the mesh's.
  TriangleMesh joined(const TriangleMesh& mesh) const;
  /// Takes the inner vertices' places.
  void take(const Eigen::Matrix3Xd& vertices);

private:
  Eigen::Vector3d at(int v) const;
  double wanted(int v) const;
  bool canFlip(int a, int b, int c, int d) const;

  const Eigen::Matrix3Xd& outer_;   ///< the mesh's vertices
  int first_;                       ///< number of the first inner vertex
  std::map<int, double> loop_length_;
  std::vector<Eigen::Vector3d> points_;   ///< inner
  std::vector<double> length_;            ///< wanted there [m]
  std::vector<Eigen::Vector3i> faces_;
  std::set<std::pair<int, int>> taken_;
};

/// Triangles over a closed loop of points of least (largest dihedral angle, area), neighbours outside included. `loop`
/// as above; beyond[i] is the third vertex of the mesh's face at the edge from loop[i] to loop[i + 1]. Empty if there
/// are none without an edge of `taken`.
std::vector<Eigen::Vector3i> triangulateLoop(const Eigen::Matrix3Xd& vertices, const std::vector<int>& loop,
                                             const std::vector<int>& beyond,
                                             const std::set<std::pair<int, int>>& taken);

}   // namespace slender
