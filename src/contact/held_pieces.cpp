#include "held_pieces.h"

#include <algorithm>

#include "pair_gap.h"
#include "slender_sim/contact/solids.h"

namespace slender {

void HeldPieces::build(const ContactSurface& surface)
{
  pieces_.clear();
  passing_.clear();
  for (std::size_t i = 0; i < surface.segments.size(); ++i)
    if (const ContactSegment& s = surface.segments[i]; s.driven == 1 || s.driven == 2)
    {
      const int corner[2] = {s.a, s.b};
      add({false, static_cast<int>(i), s.object, s.radius, 2, 0, {}}, corner, s.driven);
    }
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    if (const ContactTriangle& t = surface.triangles[i]; t.driven != 0 && t.driven != 7)
      add({true, static_cast<int>(i), t.object, t.half_thickness, 3, 0, {}}, t.corner.data(), t.driven);
}

void HeldPieces::add(Piece piece, const int* corner, unsigned char driven)
{
  int last = piece.corners;
  for (int k = 0; k < piece.corners; ++k)
    if (driven >> k & 1)
      piece.corner[piece.held++] = corner[k];
    else
      piece.corner[--last] = corner[k];
  pieces_.push_back(piece);
}

void HeldPieces::update(const ContactSurface& surface, const std::vector<SolidPieces>& solids,
                        const SurfaceMotion& motion, double gap)
{
  passing_.clear();
  for (std::size_t k = 0; k < solids.size() && !pieces_.empty(); ++k)
  {
    const ContactSolid& solid = surface.solids[k];
    if (solid.body)
      continue;
    const bool plane = std::holds_alternative<Plane>(solid.shape);   // which triangles touch with free corners alone
    const Pose to_solid[2] = {motion.solids[k].inverse(), motion.solids_end[k].inverse()};
    for (const Piece& piece : pieces_)
      if (!(plane && piece.triangle) && mayTouch(surface, piece.object, solid) &&
          isInTheWay(piece, solids[k], to_solid, motion, gap))
        passing_.emplace_back(static_cast<int>(k), piece.triangle, piece.index);
  }
}

/// Returns true if the solid must pass through the piece. If a distance is d0 at the start of a motion and d1 at its
/// end, and points move by at most m, then the distance is at least (d0 + d1 - m) / 2 during the motion.
bool HeldPieces::isInTheWay(const Piece& piece, const SolidPieces& solid, const Pose (&to_solid)[2],
                            const SurfaceMotion& motion, double gap)
{
  constexpr double kApart = 0.01;   // of the gap: barriers keep more
  Eigen::Vector3d start[3], end[3], middle = Eigen::Vector3d::Zero();
  double moved = 0.0, extent = 0.0;
  for (int k = 0; k < piece.corners; ++k)
  {
    start[k] = to_solid[0] * Eigen::Vector3d(motion.x.col(piece.corner[k]));
    end[k] = to_solid[1] * Eigen::Vector3d(motion.x_end.col(piece.corner[k]));
    middle += start[k] / piece.corners;
    if (k < piece.held)
      moved = std::max(moved, (end[k] - start[k]).norm());
  }
  for (int k = 0; k < piece.corners; ++k)
    extent = std::max(extent, (start[k] - middle).norm());
  // Between held vertices and the solid a layer of cloth needs its thickness, and a gap on both of its sides.
  const double needed = piece.triangle ? 2.0 * (piece.radius + gap) : gap;
  if (middle.norm() > solid.reach + extent + piece.radius + needed + moved)
    return false;
  const double most = needed + moved, before = roomOf(solid, start, piece.held, piece.radius, most),
               after = roomOf(solid, end, piece.held, piece.radius, most);
  return 0.5 * (before + after - moved) < needed ||
         roomOf(solid, start, piece.corners, piece.radius, gap) < kApart * gap;
}

/// Smallest distance [m] of a piece of 1 to 3 corners from a solid, in whose frame they are, less the radius. It is at
/// least 0 and at most `most`.
double HeldPieces::roomOf(const SolidPieces& solid, const Eigen::Vector3d* corner, int corners, double radius,
                          double most)
{
  double least = most;
  const auto look = [&](const ConvexPiece& piece) {
    if (leastFaceDistance(piece, corner, corners) - radius >= least)
      return;
    const FacePlane plane = separatingPlane(piece, corner, corners, radius);
    least = plane.meets ? 0.0 : std::max(0.0, std::min(least, plane.distance - radius));
  };
  if (solid.tree.empty())
  {
    look(solid.pieces[0]);
    return least;
  }
  BoundingBox box = BoundingBox::empty();
  for (int k = 0; k < corners; ++k)
    box.include(corner[k]);
  box.enlarge(radius + most);
  near_.clear();
  solid.tree[0].query(box, near_);
  for (const int triangle : near_)
    look(solid.pieces[triangle]);
  return least;
}

bool HeldPieces::letPass(int solid, bool triangle, int index) const
{
  return !passing_.empty() &&
         std::binary_search(passing_.begin(), passing_.end(), std::make_tuple(solid, triangle, index));
}

}   // namespace slender
