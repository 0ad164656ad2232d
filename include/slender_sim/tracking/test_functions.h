#pragma once

#include <string>
#include <vector>

#include <Eigen/SparseCore>

#include "slender_sim/geometry/mesh_subdivision.h"

namespace slender {

/// Corresponding test functions on a guide and on what tracks it, by their values at the vertices (thesis 6.4.1).
struct TestFunctions
{
  using Values = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  std::vector<std::string> names;   ///< one per function
  Values guide;                     ///< S-bar, functions x guide vertices
  Values tracked;                   ///< S, functions x tracked vertices

  int count() const { return static_cast<int>(names.size()); }
};

/// A region as the user paints it: vertices of the guide and of the tracked mesh.
struct PaintedRegion
{
  std::string name;
  std::vector<int> guide, tracked;
};

/// One function per region: 1 at its vertices, 0 elsewhere. Throws std::invalid_argument naming a region with a vertex
/// that is not there, or without any.
TestFunctions paintedRegions(const std::vector<PaintedRegion>& regions, int guide_vertices, int tracked_vertices);

/// Likewise on a linear subdivision of the guide, where a region without tracked vertices has the guide's function,
/// prolonged.
TestFunctions paintedRegions(const std::vector<PaintedRegion>& regions, const Subdivision& subdivision);

/// The guide's hat functions, one per vertex, prolonged to its linear subdivision. With `vertices` only those of these
/// guide vertices.
TestFunctions subdivisionBasis(const Subdivision& subdivision, const std::vector<int>& vertices = {});

/// One function per region of faces (0 ... regions - 1), for a guide that is the tracked mesh: at a vertex the share of
/// the area around it that belongs to the region, so that all functions sum to 1. Throws std::invalid_argument naming a
/// region without faces.
TestFunctions regionBasis(const TriangleMesh& mesh, const std::vector<int>& region_of_face);

}   // namespace slender
