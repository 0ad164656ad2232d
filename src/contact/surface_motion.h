#pragma once

#include <algorithm>
#include <vector>

#include "mesh_tree.h"
#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/contact_surface.h"
#include "slender_sim/contact/solids.h"

namespace slender {

/// A solid taken apart into convex pieces.
struct SolidPieces
{
  std::vector<ConvexPiece> pieces;
  std::vector<MeshTree> tree;   ///< of a mesh: one; of other shapes: none
  double reach = 0.0;           ///< boundingRadius() [m]
  /// A ball inside the solid, and its centre in the solid's frame [m]. Zero: none is known, as in a mesh that is open
  /// or does not contain the mean of its vertices.
  double ball = 0.0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
};

/// A motion of the points and solids of a contact surface.
struct SurfaceMotion
{
  const Eigen::Matrix3Xd &x, &x_end;
  const std::vector<Pose>&solids, &solids_end;
  MovingPoint of(int point) const { return {x.col(point), x_end.col(point)}; }
};

/// Whether an object of a surface and one of its solids may touch.
inline bool mayTouch(const ContactSurface& surface, int object, const ContactSolid& solid)
{
  const ContactObject& o = surface.objects[object];
  return o.solids && (solid.only < 0 || solid.only == o.owner) &&
         std::find(solid.ignores.begin(), solid.ignores.end(), object) == solid.ignores.end();
}

/// Returns true if the piece of an object with these points passes through a solid, because the object ignores the
/// solid there.
inline bool passesThrough(const ContactSurface& surface, int object, const int* points, int count,
                          const ContactSolid& solid)
{
  const ContactObject& o = surface.objects[object];
  if (!o.ignored || solid.number < 0)
    return false;
  for (const IgnoredSolid& ignored : *o.ignored)
    if (ignored.number == solid.number)
      return ignored.points.empty() || std::any_of(points, points + count, [&](int point) {
               return ignored.points[static_cast<std::size_t>(point - o.first_point)] != 0;
             });
  return false;
}

/// Returns true if a segment and a solid may touch.
inline bool mayTouch(const ContactSurface& surface, const ContactSegment& segment, const ContactSolid& solid)
{
  const int points[2] = {segment.a, segment.b};
  return (solid.body || !segment.prescribed()) && mayTouch(surface, segment.object, solid) &&
         !passesThrough(surface, segment.object, points, 2, solid);
}

}   // namespace slender
