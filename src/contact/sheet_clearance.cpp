// The independent check of triangles' distances: it shares no search, no pieces and no minimisation with the potential.
#include <algorithm>
#include <cmath>

#include "contact_potential.h"
#include "convex_minimum.h"
#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/intersection.h"

namespace slender {

namespace {

/// A segment or a triangle.
struct Piece
{
  int corners, object;
  std::array<int, 3> corner;
  double radius;
  unsigned char driven;   ///< bits
  BoundingBox box;

  bool has(int point) const { return std::count(corner.begin(), corner.begin() + corners, point) > 0; }
  int edges() const { return corners == 3 ? 3 : 1; }
  bool isDriven(int k) const { return driven >> k & 1; }
  Eigen::Vector3d at(const Eigen::Matrix3Xd& x, int k) const { return x.col(corner[k % corners]); }
};

std::vector<Piece> piecesOf(const ContactSurface& surface, const Eigen::Matrix3Xd& x, double gap)
{
  std::vector<Piece> pieces;
  for (const ContactSegment& s : surface.segments)
    pieces.push_back({2, s.object, {s.a, s.b, s.b}, s.radius, s.driven, {}});
  for (const ContactTriangle& t : surface.triangles)
    pieces.push_back({3, t.object, t.corner, t.half_thickness, t.driven, {}});
  for (Piece& p : pieces)
  {
    p.box = BoundingBox::empty();
    for (const int i : p.corner)
      p.box.include(Eigen::Vector3d(x.col(i)));
    p.box.enlarge(p.radius + 0.5 * gap);
  }
  std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.box.low.x() < b.box.low.x(); });
  return pieces;
}

/// The distance that a pair may not come below: its thickness, or less if its pieces are near each other at rest.
/// False: they are neighbours.
bool allowed(const ContactSurface& surface, const Piece& a, const Piece& b, double gap, double at_rest, double& least)
{
  least = a.radius + b.radius;
  if (a.object != b.object || !surface.objects[a.object].rest || 0.5 * at_rest >= least + gap)
    return true;
  const double share = 0.5 * at_rest / (least + gap);
  least *= share;
  return share > 1e-6;
}

/// Smallest room between the features of two pieces: corners and triangles, edges and edges.
class PairClearance
{
public:
  PairClearance(const ContactSurface& surface, const Eigen::Matrix3Xd& x, double gap)
    : surface_(surface),
      x_(x),
      gap_(gap)
  {
  }

  double operator()(const Piece& a, const Piece& b) const
  {
    double least = std::min(ofCorners(a, b), ofCorners(b, a));
    for (int i = 0; i < a.edges(); ++i)
      for (int j = 0; j < b.edges(); ++j)
        least = std::min(least, ofEdges(a, i, b, j));
    if (pierces(a, b) || pierces(b, a))
      least = std::min(least, -a.radius - b.radius);
    return least;
  }

private:
  /// Calls distance(positions, offset) for the present and the rest configuration.
  template <class Distance>
  double room(const Piece& a, const Piece& b, Distance distance) const
  {
    const ContactObject& object = surface_.objects[a.object];
    const double at_rest = a.object == b.object && object.rest ? distance(*object.rest, object.first_point) : 0.0;
    double thickness;
    return allowed(surface_, a, b, gap_, at_rest, thickness) ? distance(x_, 0) - thickness : gap_;
  }
  double ofCorners(const Piece& a, const Piece& b) const
  {
    double least = gap_;
    for (int k = 0; k < a.corners && b.corners == 3; ++k)
      if (!b.has(a.corner[k]) && !(a.isDriven(k) && b.driven == 7))
        least = std::min(least, room(a, b, [&](const Eigen::Matrix3Xd& x, int o) {
                           return pointTriangleDistance(x.col(a.corner[k] - o), x.col(b.corner[0] - o),
                                                        x.col(b.corner[1] - o), x.col(b.corner[2] - o));
                         }));
    return least;
  }
  double ofEdges(const Piece& a, int i, const Piece& b, int j) const
  {
    const int i2 = (i + 1) % a.corners, j2 = (j + 1) % b.corners;
    if (b.corner[j] == a.corner[i] || b.corner[j] == a.corner[i2] || b.corner[j2] == a.corner[i] ||
        b.corner[j2] == a.corner[i2] || (a.isDriven(i) && a.isDriven(i2) && b.isDriven(j) && b.isDriven(j2)))
      return gap_;
    return room(a, b, [&](const Eigen::Matrix3Xd& x, int o) {
      return segmentDistance(x.col(a.corner[i] - o), x.col(a.corner[i2] - o), x.col(b.corner[j] - o),
                             x.col(b.corner[j2] - o));
    });
  }
  /// Whether an edge of a passes through the inside of b.
  bool pierces(const Piece& a, const Piece& b) const
  {
    for (int i = 0; i < a.edges() && b.corners == 3; ++i)
    {
      const int i2 = (i + 1) % a.corners;
      if (!b.has(a.corner[i]) && !b.has(a.corner[i2]) && !(a.isDriven(i) && a.isDriven(i2) && b.driven == 7) &&
          segmentMeetsTriangle(a.at(x_, i), a.at(x_, i2), b.at(x_, 0), b.at(x_, 1), b.at(x_, 2)))
        return true;
    }
    return false;
  }

  const ContactSurface& surface_;
  const Eigen::Matrix3Xd& x_;
  double gap_;
};

/// Smallest distance of a face of 1 to 3 corners from a convex piece, by nested searches.
double faceDistance(const ConvexPiece& piece, const Eigen::Vector3d* z, int corners)
{
  const auto distance = [&](const Eigen::Vector3d& p) { return pieceDistance(piece, p).distance; };
  if (corners == 1)
    return distance(z[0]);
  return convexMinimum([&](double s) {
    const Eigen::Vector3d from = z[0] + s * (z[1] - z[0]);
    if (corners == 2)
      return distance(from);
    const Eigen::Vector3d to = z[0] + s * (z[2] - z[0]);
    return convexMinimum([&](double t) { return distance(from + t * (to - from)); });
  });
}

}   // namespace

double ContactPotential::sheetClearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses, double least)
{
  const std::vector<Piece> pieces = piecesOf(surface_, x, options_.gap);
  const PairClearance clearance(surface_, x, options_.gap);
  for (std::size_t p = 0; p < pieces.size(); ++p)
    for (std::size_t q = p + 1; q < pieces.size() && pieces[q].box.low.x() <= pieces[p].box.high.x(); ++q)
    {
      const Piece &a = pieces[p], &b = pieces[q];
      const ContactObject &c = surface_.objects[a.object], &d = surface_.objects[b.object];
      if ((a.corners == 3 || b.corners == 3) && (a.object == b.object ? c.self : c.others && d.others) &&
          a.box.overlaps(b.box))
        least = std::min(least, clearance(a, b));
    }
  for (std::size_t k = 0; k < solids_.size(); ++k)
    for (const Piece& t : pieces)
    {
      const ContactSolid& solid = surface_.solids[k];
      if (t.corners != 3 || !mayTouch(surface_, t.object, solid))
        continue;
      // What is driven does not touch what is driven: the free corners, or the edge between them, remain.
      Eigen::Vector3d z[3];
      int corners = 0, points[3];
      const Pose to_solid = poses[k].inverse();
      for (int i = 0; i < 3; ++i)
        if (solid.body || !t.isDriven(i))
        {
          points[corners] = t.corner[i];
          z[corners++] = to_solid * t.at(x, i);
        }
      if (corners == 0 || passesThrough(surface_, t.object, points, corners, solid))
        continue;
      // No place of the face is farther from its middle than this, and distances do not change faster.
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      double extent = 0.0;
      for (int i = 0; i < corners; ++i)
        middle += z[i] / corners;
      for (int i = 0; i < corners; ++i)
        extent = std::max(extent, (z[i] - middle).norm());
      if (middle.norm() > boundingRadius(solid.shape) + options_.gap + t.radius + extent)
        continue;
      for (const ConvexPiece& piece : solids_[k].pieces)
        if (pieceDistance(piece, middle).distance - extent - t.radius < least)
          least = std::min(least, faceDistance(piece, z, corners) - t.radius);
    }
  return least;
}

}   // namespace slender
