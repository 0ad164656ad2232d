#pragma once

#include <array>
#include <vector>

#include "slender_sim/contact/impulses/collision_surface.h"

namespace slender {

/// Sheets and solids in one list of triangles, lone edges (capsules) and lone points (spheres) over one list of points:
/// those of the sheets, then those of the solids. Planes are apart.
struct CollisionElements
{
  struct Element
  {
    std::array<int, 3> v;      ///< of a lone edge two count, of a lone point one
    std::array<int, 3> edge;   ///< that joins v[k] and v[k + 1]; -1: none
    int object;
    int corners;
    unsigned char owns_point, owns_edge;   ///< bits: each point and edge is owned by one element
  };
  struct Edge
  {
    int a, b;
    int object;
    bool lone;
  };
  struct Object
  {
    double shell;      ///< it repels up to here [m]: half the thickness of a sheet, nothing of a solid
    double core;       ///< radius [m] of spheres and capsules, else zero
    double friction;   ///< negative: that of the other
    bool solid;
  };

  explicit CollisionElements(const CollisionSurface& surface);

  bool mayTouch(int a, int b) const { return touching[static_cast<std::size_t>(a) * objects.size() + b]; }
  double friction(int a, int b) const;
  /// Moves solids' points to poses; columns from `sheet_points` on.
  void place(const std::vector<Pose>& poses, Eigen::Matrix3Xd& x) const;

  int sheet_points = 0, sheet_count = 0;
  Eigen::Matrix3Xd reference;      ///< all points: sheets at rest, solids in their frames
  std::vector<int> point_object;   ///< -1: a point of no triangle
  std::vector<Element> elements;
  std::vector<Edge> edges;
  std::vector<Object> objects;   ///< sheets, then solids
  std::vector<int> planes;       ///< objects
  std::vector<char> touching;
};

}   // namespace slender
