#pragma once

#include <algorithm>
#include <vector>

#include "mesh_tree.h"
#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/contact/solids.h"

namespace slender {

/// A solid taken apart into convex pieces.
struct SolidPieces
{
  std::vector<ConvexPiece> pieces;
  std::vector<MeshTree> tree;   ///< of a mesh: one; of other shapes: none
};

/// A motion of the points and solids of a contact surface.
struct SurfaceMotion
{
  const Eigen::Matrix3Xd &x, &x_end;
  const std::vector<Pose>&solids, &solids_end;
};

/// Whether an object of a surface and one of its solids may touch.
inline bool mayTouch(const ContactSurface& surface, int object, const ContactSolid& solid)
{
  const ContactObject& o = surface.objects[object];
  return o.solids && (solid.only < 0 || solid.only == o.owner) &&
         std::find(solid.ignores.begin(), solid.ignores.end(), object) == solid.ignores.end();
}

}   // namespace slender
