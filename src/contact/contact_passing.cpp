// Finds what may have passed through a cloth, a curve or a solid although no iterate of a solution touched it.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_potential.h"

namespace slender {

void ContactPotential::takeDisplacements(const Eigen::Matrix3Xd& x_end)
{
  displacements_.assign(surface_.objects.size(), {});
  const auto include = [&](int object, int a, int b) {
    Displacements& own = displacements_[object];
    for (const int point : {a, b})
      own.box.include(x_end.col(point) - x_begin_.col(point));
    own.shortest_edge = std::min(own.shortest_edge, (x_end.col(b) - x_end.col(a)).norm());
  };
  for (const ContactSegment& s : surface_.segments)
    include(s.object, s.a, s.b);
  for (const ContactTriangle& t : surface_.triangles)
    for (int k = 0; k < 3; ++k)
      include(t.object, t.corner[k], t.corner[(k + 1) % 3]);
}

/// How deep [m] what moves straight may get into a solid before it counts as having passed through: half of the radius
/// of the ball in the solid or in the body that the object belongs to, whichever is smaller. What slides around a
/// solid, or rolls over it, gets less deep on straight ways, unless its step is long. It is infinite for pairs that are
/// never examined: those without a ball, and a body and its own solid.
double ContactPotential::depthOfPassing(int object, int solid) const
{
  const int carrier = surface_.objects[object].carrier;
  if (carrier == solid || std::holds_alternative<Plane>(solids_[solid].pieces.front()))
    return kInfinity;
  const auto radius = [&](int k) { return k >= 0 && solids_[k].ball > 0.0 ? solids_[k].ball : kInfinity; };
  return 0.5 * std::min(radius(solid), radius(carrier));
}

/// Whether a piece of an object crosses the core of a solid. The core of a mesh is the ball in it. Besides, the surface
/// of a round body may come as near to a triangle as its radius less half of the ball in the body.
bool ContactPotential::crossesCore(const SurfaceMotion& motion, const int* corner, int corners, int object, int solid,
                                   int piece, double radius) const
{
  const double depth = depthOfPassing(object, solid);
  if (!std::isfinite(depth))
    return false;
  MovingPoint moving[3];
  for (int k = 0; k < corners; ++k)
    moving[k] = motion.of(corner[k]);
  const auto crosses = [&](const ConvexPiece& core, const RigidMotion& way, double thickness) {
    ApproachLimit limit;
    limit.thickness = thickness;
    limit.reach = 1e-3 * options_.gap;
    const double share = thickness > 0.0 ? faceSolidLimit(moving, corners, core, way, limit) : 1.0;
    return share > 0.0 && share < 1.0;   // 0: the piece is there at the start.
  };
  const SolidPieces& whole = solids_[solid];
  const ConvexPiece& part = whole.pieces[piece];
  const RigidMotion& way = rigid_[solid];
  if (!std::holds_alternative<Triangle>(part))
    return crosses(withoutLayer(part, depth), way, radius);
  const int carrier = surface_.objects[object].carrier;
  const double of_body = carrier >= 0 ? solids_[carrier].ball : 0.0;
  const Pose middle{whole.middle, Eigen::Quaterniond::Identity()};
  return (of_body > 0.0 && crosses(part, way, radius - 0.5 * of_body)) ||
         (whole.ball > 0.0 && crosses(Sphere{whole.ball - depth}, {way.from * middle, way.at(1.0) * middle}, radius));
}

/// Returns whether anything has moved so far since begin() that passedThrough() has to examine it. What moves less
/// cannot get to the other side without coming near the rim, the end, or the surface.
bool ContactPotential::movedFar(const Eigen::Matrix3Xd& x_end)
{
  constexpr double kFar = 0.5;   // of the shortest edge
  takeDisplacements(x_end);
  const auto way = [](const BoundingBox& a, const BoundingBox& b) {
    return (a.high - b.low).cwiseAbs().cwiseMax((b.high - a.low).cwiseAbs()).norm();
  };
  const int objects = static_cast<int>(displacements_.size()), solids = static_cast<int>(rigid_.size());
  const auto isEmpty = [](const BoundingBox& box) { return box.low.x() > box.high.x(); };
  for (int i = 0; i < objects; ++i)
  {
    const Displacements& object = displacements_[i];
    for (int k = 0; k < solids && !isEmpty(object.box); ++k)
      if (const double depth = depthOfPassing(i, k);
          std::isfinite(depth) &&
          way(object.box, {rigid_[k].shift, rigid_[k].shift}) + rigid_[k].turn.norm() * solids_[k].reach > depth)
        return true;
    for (int k = 0; k < objects && surface_.objects[i].others; ++k)
      if (const BoundingBox& other = displacements_[k].box; k != i && surface_.objects[k].others && !isEmpty(other) &&
                                                            way(object.box, other) > kFar * object.shortest_edge)
        return true;
  }
  return false;
}

bool ContactPotential::passedThrough(const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end)
{
  const SurfaceMotion whole{x_begin_, x_end, solids_begin_, solids_end};
  setRigid(whole);
  if (!movedFar(x_end))
    return false;
  swept_.build(surface_, sheets_, solids_, whole, rangeOfSweeps());
  ApproachLimit limit;
  // Only middle surfaces and centrelines that cross count. Surfaces that slide may come nearer than their thickness on
  // straight ways.
  limit.thickness = 0.0;
  limit.reach = 1e-3 * options_.gap;
  const auto motion = [&](int i) { return whole.of(i); };
  const auto crosses = [](double share) { return share > 0.0 && share < 1.0; };   // 0: they cross at the start
  for (const GridPairs::Pair& pair : swept_.pairs())
  {
    const ContactSegment &a = surface_.segments[pair.first], &b = surface_.segments[pair.second];
    if (a.object != b.object && crosses(segmentsLimit(motion(a.a), motion(a.b), motion(b.a), motion(b.b), limit)))
      return true;
  }
  for (const SheetCandidates::Pair& pair : swept_.sheets().pairs())
  {
    if (pair.edges)
    {
      const SheetPieces::Edge &a = sheets_.edges[pair.first], &b = sheets_.edges[pair.second];
      if (a.object != b.object && crosses(segmentsLimit(motion(a.a), motion(a.b), motion(b.a), motion(b.b), limit)))
        return true;
      continue;
    }
    const SheetPieces::Point& p = sheets_.points[pair.first];
    const ContactTriangle& t = surface_.triangles[pair.second];
    if (p.object != t.object && crosses(pointTriangleLimit(motion(p.point), motion(t.corner[0]), motion(t.corner[1]),
                                                           motion(t.corner[2]), limit)))
      return true;
  }
  for (const Candidates::OnSolid& on : swept_.onSolids())
  {
    const ContactSegment& s = surface_.segments[on.segment];
    const int ends[2] = {s.a, s.b};
    if (!passes(on) && crossesCore(whole, ends, 2, s.object, on.solid, on.piece, s.radius))
      return true;
  }
  for (const SheetCandidates::OnSolid& on : swept_.sheets().onSolids())
    if (!passes(on) &&
        crossesCore(whole, on.face.corner.data(), on.face.corners, on.face.object, on.solid, on.piece, on.face.radius))
      return true;
  return false;
}

}   // namespace slender
