#pragma once

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Side of a face: from its corner side % 3 to the next one; face side / 3.
struct HalfEdge
{
  int low, high;   ///< its vertices
  int side;
  bool forward;   ///< runs from low to high
};

/// All sides; those of one edge follow each other, by face.
inline std::vector<HalfEdge> sortedHalfEdges(const TriangleMesh& mesh)
{
  std::vector<HalfEdge> sides;
  sides.reserve(3 * mesh.triangles.cols());
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
    {
      const int a = mesh.triangles(k, f), b = mesh.triangles((k + 1) % 3, f);
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(3 * f + k), a < b});
    }
  std::sort(sides.begin(), sides.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.side) < std::tie(b.low, b.high, b.side);
  });
  return sides;
}

inline std::string edgeName(const HalfEdge& side)
{
  return "the edge between vertices " + std::to_string(side.low) + " and " + std::to_string(side.high) + " (from 0)";
}

}   // namespace slender
