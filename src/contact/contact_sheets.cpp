// The parts of ContactPotential that concern triangles.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_potential.h"
#include "slender_sim/contact/distance.h"

namespace slender {

bool ContactPotential::add(const Place& place, const SheetCandidates::Pair& pair, Batch& out) const
{
  const Eigen::Matrix3Xd& x = place.x;
  const double thickness = thicknessOf(pair), range = thickness + pair.scale * options_.gap;
  Contact contact;
  PairGap gap;
  int object, other;
  double radius;   // of the second piece
  const auto at = [&](int k) -> Eigen::Vector3d { return x.col(contact.point[k]); };
  if (pair.edges)
  {
    const SheetPieces::Edge &a = sheets_.edges[pair.first], &b = sheets_.edges[pair.second];
    const Eigen::Vector3d a0 = x.col(a.a), a1 = x.col(a.b), b0 = x.col(b.a), b1 = x.col(b.b);
    if (segmentDistance(a0, a1, b0, b1) >= range)
      return true;
    gap = edgesGap(a0, a1, b0, b1, thickness, place.with_stiffness);
    contact.point[0] = a.a;
    contact.point[1] = a.b;
    contact.point[2] = b.a;
    contact.point[3] = b.b;
    object = a.object;
    other = b.object;
    radius = thickness * b.radius / (a.radius + b.radius);
  }
  else
  {
    const SheetPieces::Point& p = sheets_.points[pair.first];
    const ContactTriangle& t = surface_.triangles[pair.second];
    contact.point[0] = p.point;
    std::copy(t.corner.begin(), t.corner.end(), contact.point + 1);
    gap = pointTriangleGap(at(0), at(1), at(2), at(3), thickness);
    contact.first_points = 1;
    object = p.object;
    other = t.object;
    radius = thickness * t.half_thickness / (p.radius + t.half_thickness);
  }
  if (gap.gap >= range - thickness)
    return true;
  // behind the pairs of segments, and segments on solids; points behind edges
  contact.first = static_cast<std::int64_t>(surface_.segments.size() + solids_.size()) + pair.first +
                  (pair.edges ? 0 : static_cast<std::int64_t>(sheets_.edges.size()));
  contact.second = pair.second;
  contact.solid = -1;
  contact.material.setZero();
  contact.position = (radius + 0.5 * gap.gap / gap.weight) * gap.normal;
  for (int k = pair.edges ? 2 : 1; k < 4; ++k)
    contact.position -= gap.place[k] * x.col(contact.point[k]);
  contact.object = object;
  contact.other = other;
  return addContact(place, gap, contact, pair.scale, out);
}

bool ContactPotential::add(const Place& place, const SheetCandidates::OnSolid& on, Batch& out) const
{
  if (passes(on))
    return true;
  const Pose& pose = place.poses[on.solid];
  const SheetPieces::Face& face = on.face;
  const ConvexPiece& piece = solids_[on.solid].pieces[on.piece];
  const Eigen::Quaterniond to_solid = pose.orientation.conjugate();
  Eigen::Vector3d z[3];
  for (int k = 0; k < face.corners; ++k)
    z[k] = to_solid * Eigen::Vector3d(place.x.col(face.corner[k]) - pose.position);
  const double radius = face.radius;
  if (leastFaceDistance(piece, z, face.corners) >= radius + options_.gap)
    return true;
  PairGap gap = facePieceGap(z, face.corners, radius, piece);
  if (gap.gap >= options_.gap)
    return true;
  Contact contact;
  contact.first = static_cast<std::int64_t>(surface_.segments.size() + solids_.size() + sheets_.edges.size() +
                                            sheets_.points.size()) +
                  3 * on.solid + face.corners - 1;
  contact.second = (static_cast<std::int64_t>(face.index) << 32) + on.piece;
  std::copy(face.corner.begin(), face.corner.end(), contact.point);
  contact.point[3] = -1;
  contact.first_points = face.corners;
  contact.solid = on.solid;
  contact.material = -(gap.gap / gap.weight + radius) * gap.normal;
  for (int k = 0; k < face.corners; ++k)
    contact.material += gap.place[k] * z[k];
  gap.normal = pose.orientation * gap.normal;
  contact.object = face.object;
  contact.other = -1;
  setPlaces(place.poses, gap.normal, contact);
  return addContact(place, gap, contact, rangeOf(face.object, on.solid), out);
}

bool ContactPotential::thinSheetsToFit(const Eigen::Matrix3Xd& x)
{
  for (const SheetCandidates::Pair& pair : near_.sheets().pairs())
  {
    const int object = pair.edges ? sheets_.edges[pair.first].object : sheets_.points[pair.first].object,
              other = pair.edges ? sheets_.edges[pair.second].object : surface_.triangles[pair.second].object;
    if (!isStrand(object) && !isStrand(other))
      continue;
    double distance;
    if (pair.edges)
    {
      const SheetPieces::Edge &a = sheets_.edges[pair.first], &b = sheets_.edges[pair.second];
      distance = segmentDistance(x.col(a.a), x.col(a.b), x.col(b.a), x.col(b.b));
    }
    else
    {
      const auto& c = surface_.triangles[pair.second].corner;
      distance = pointTriangleDistance(x.col(sheets_.points[pair.first].point), x.col(c[0]), x.col(c[1]), x.col(c[2]));
    }
    if (!fit(thin_sheets_, keyOf(pair), distance, pair.thickness))
      return false;
  }
  std::sort(thin_sheets_.begin(), thin_sheets_.end());
  return true;
}

}   // namespace slender
