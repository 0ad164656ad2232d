// Finds what may have passed through a cloth or a curve although no iterate of a solution touched it.
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
  {
    for (int k = 0; k < 3; ++k)
      include(t.object, t.corner[k], t.corner[(k + 1) % 3]);
    displacements_[t.object].has_triangles = true;
  }
}

/// Returns whether anything has moved against a cloth or a curve by more than half of the shortest edge there since
/// begin(). What moves less cannot get to the other side without coming near the rim or the end.
bool ContactPotential::movedFar(const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end)
{
  constexpr double kFar = 0.5;   // of the shortest edge
  takeDisplacements(x_end);
  const auto far = [&](const Displacements& object, const BoundingBox& other) {
    const Eigen::Vector3d most =
        (object.box.high - other.low).cwiseAbs().cwiseMax((other.high - object.box.low).cwiseAbs());
    return most.norm() > kFar * object.shortest_edge;
  };
  for (std::size_t i = 0; i < displacements_.size(); ++i)
  {
    const Displacements& object = displacements_[i];
    if (!std::isfinite(object.shortest_edge) || !surface_.objects[i].others)
      continue;
    for (std::size_t k = 0; k < displacements_.size(); ++k)
      if (const BoundingBox& other = displacements_[k].box;
          k != i && surface_.objects[k].others && other.low.x() <= other.high.x() && far(object, other))
        return true;
    for (std::size_t k = 0; k < solids_end.size() && object.has_triangles; ++k)
    {
      const Eigen::Vector3d way = solids_end[k].position - solids_begin_[k].position;
      if (far(object, {way, way}))
        return true;
    }
  }
  return false;
}

bool ContactPotential::passedThrough(const Eigen::Matrix3Xd& x_end, const std::vector<Pose>& solids_end)
{
  if (!movedFar(x_end, solids_end))
    return false;
  swept_.build(surface_, sheets_, solids_, {x_begin_, x_end, solids_begin_, solids_end}, rangeOfSweeps());
  ApproachLimit limit;
  // Only middle surfaces and centrelines that cross count. Surfaces that slide may come nearer than their thickness on
  // straight ways.
  limit.thickness = 0.0;
  limit.reach = 1e-3 * options_.gap;
  const auto motion = [&](int i) { return MovingPoint{x_begin_.col(i), x_end.col(i)}; };
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
  for (const SheetCandidates::OnSolid& on : swept_.sheets().onSolids())
  {
    if (on.face.corners != 3 || !surface_.objects[on.face.object].others || passes(on))
      continue;
    const MovingPoint middle{solids_begin_[on.solid].position, solids_end[on.solid].position};
    const auto& c = on.face.corner;
    if (crosses(pointTriangleLimit(middle, motion(c[0]), motion(c[1]), motion(c[2]), limit)))
      return true;
  }
  return false;
}

}   // namespace slender
