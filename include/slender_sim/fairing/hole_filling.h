#pragma once

#include <string>
#include <vector>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

struct HoleOptions
{
  /// of the patch [m]; 0: that of the edges around, from place to place; so that kMostFaces suffice
  double edge_length = 0.0;
  int max_rounds = 30;   ///< of flowing and remeshing the patch
};

/// What closed a hole.
struct HoleReport
{
  bool ok = true;
  std::string message;                  ///< empty when ok; otherwise the reason and what to change
  int first_vertex = 0, vertices = 0;   ///< added to the mesh
  int first_face = 0, faces = 0;
  int rounds = 0, steps = 0;
  /// the last round changed the energy by less than 1e-4 of it; false: max_rounds was too few
  bool stationary = true;
  double energy = 0.0;   ///< 1/2 int H^2 of the patch and the ring around it [-]
};

/// Longest loop that is closed [edges]: work grows with its third power.
constexpr int kLongestHole = 1000;
constexpr int kMostFaces = 1000000;   ///< of a patch

/// Closes a boundary loop of the mesh (one of MeshTopology::boundaries) by a patch that continues the surface around it
/// smoothly (G1): triangles over the loop of least dihedral angle and area [Barequet & Sharir 1995; Liepa 2003],
/// refined to the edge length, then Willmore flow to the stationary surface with the ring around held, in rounds
/// between which the patch is refined, flipped to Delaunay and evened out. Vertices and faces are added behind those
/// that are there. Holes with three to about six edges may need no vertices. On failure the mesh is untouched.
HoleReport fillHole(TriangleMesh& mesh, const std::vector<int>& loop, const HoleOptions& options = {});

}   // namespace slender
