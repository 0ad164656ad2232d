#include "sheet_candidates.h"

#include <cmath>
#include <cstdint>

#include "slender_sim/contact/distance.h"
#include "pair_gap.h"

namespace slender {

namespace {

const double kCorner = std::sqrt(3.0);   // of a cube, from its middle, over half its side
constexpr double kMet = 1e-6;            // of thickness and gap: pieces that are nearer at rest are neighbours

/// Thickness and scale of a pair, by the distance that `distance` gives at points. False: they are neighbours.
template <class Distance>
bool fitToRest(const ContactSurface& surface, int a, int b, double gap, Distance&& distance,
               SheetCandidates::Pair& pair)
{
  const ContactObject& object = surface.objects[a];
  if (a != b || !object.rest)
    return true;
  const double most = 0.5 * distance(*object.rest, object.first_point), reach = pair.thickness + gap;
  if (most < reach)
    pair.scale = most / reach;
  pair.thickness *= pair.scale;
  return pair.scale > kMet;
}

}   // namespace

void SheetCandidates::build(const ContactSurface& surface, const SheetPieces& pieces,
                            const std::vector<SolidPieces>& solids, const SurfaceMotion& motion, const Slack& slack)
{
  pairs_.clear();
  on_solids_.clear();
  gap_ = slack.gap;
  findPairs(surface, pieces, motion, slack);
  for (std::size_t k = 0; k < solids.size(); ++k)
  {
    const ContactSolid& solid = surface.solids[k];
    const bool plane = std::holds_alternative<Plane>(solid.shape);
    findOnSolid(surface,
                plane        ? pieces.corners
                : solid.body ? pieces.whole
                             : pieces.faces,
                static_cast<int>(k), solids[k], motion, slack);
  }
}

void SheetCandidates::buildTree(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x)
{
  const std::size_t objects = surface.objects.size(), count = pieces.elements.size();
  touching_.assign(objects * objects, 0);
  for (std::size_t i = 0; i < count; ++i)   // of rods: with cloths only
    if (const int object = pieces.elements[i].object; pieces.elements[i].corners == 3)
      for (std::size_t k = 0; k < objects; ++k)
      {
        const ContactObject& a = surface.objects[object];
        const bool meet = static_cast<int>(k) == object ? a.self : a.others && surface.objects[k].others;
        touching_[object * objects + k] = touching_[k * objects + object] = meet;
      }
  groups_.resize(count);
  centers_.resize(3, static_cast<Eigen::Index>(count));
  for (std::size_t i = 0; i < count; ++i)
  {
    const SheetPieces::Element& e = pieces.elements[i];
    groups_[i] = e.object;
    centers_.col(i) = (x.col(e.corner[0]) + x.col(e.corner[1]) + x.col(e.corner[2])) / 3.0;
  }
  tree_.build(centers_, groups_, touching_, objects);
  volumes_.resize(count);
  active_.assign(count, 1);
  tree_built_ = true;
}

void SheetCandidates::findPairs(const ContactSurface& surface, const SheetPieces& pieces, const SurfaceMotion& motion,
                                const Slack& slack)
{
  if (!tree_built_)
    buildTree(surface, pieces, motion.x);
  // The volumes are those in a frame that moves with the points on average.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const SheetPieces::Point& p : pieces.points)
    mean += motion.x_end.col(p.point) - motion.x.col(p.point);
  mean /= static_cast<double>(pieces.points.size());
  const double around = 0.5 * slack.gap + kCorner * slack.margin;
  points_.resize(static_cast<std::size_t>(surface.points));
  strays_.resize(static_cast<std::size_t>(surface.points));
  for (const SheetPieces::Point& p : pieces.points)
  {
    const Eigen::Vector3d end = motion.x_end.col(p.point) - mean;
    points_[p.point] = Kdop::swept(motion.x.col(p.point).data(), end.data(), p.radius + around);
    strays_[p.point] = (end - motion.x.col(p.point)).norm() + around;
  }
  edges_.resize(pieces.edges.size());
  for (std::size_t i = 0; i < edges_.size(); ++i)
  {
    edges_[i] = points_[pieces.edges[i].a];
    edges_[i].include(points_[pieces.edges[i].b]);
  }
  for (std::size_t i = 0; i < volumes_.size(); ++i)
  {
    const auto& corner = pieces.elements[i].corner;
    volumes_[i] = points_[corner[0]];
    volumes_[i].include(points_[corner[1]]);
    volumes_[i].include(points_[corner[2]]);
  }
  found_.clear();
  tree_.refit(volumes_, active_);
  tree_.selfPairs(found_);
  for (const KdopTree::Pair& p : found_)
    testElements(surface, pieces, motion.x, p.first, p.second);
  const auto rank = [](const Pair& p) { return (static_cast<std::int64_t>(p.first) << 32) + p.second; };
  std::sort(pairs_.begin(), pairs_.end(),
            [&](const Pair& a, const Pair& b) { return a.edges != b.edges ? a.edges : rank(a) < rank(b); });
}

void SheetCandidates::testElements(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x,
                                   int a, int b)
{
  const SheetPieces::Element &e = pieces.elements[a], &f = pieces.elements[b];
  for (const int i : e.edge)
    for (const int j : f.edge)
      if (i >= 0 && j >= 0)
        testEdges(surface, pieces, x, std::min(i, j), std::max(i, j));
  for (int k = 0; k < 3; ++k)
  {
    if (e.point[k] >= 0 && f.corners == 3)
      testPoint(surface, pieces, x, e.point[k], b);
    if (f.point[k] >= 0 && e.corners == 3)
      testPoint(surface, pieces, x, f.point[k], a);
  }
}

void SheetCandidates::testEdges(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x,
                                int a, int b)
{
  if (!edges_[a].overlaps(edges_[b]))
    return;
  const SheetPieces::Edge &e = pieces.edges[a], &f = pieces.edges[b];
  if (e.a == f.a || e.a == f.b || e.b == f.a || e.b == f.b || (e.driven && f.driven))
    return;
  const auto distance = [&](const Eigen::Matrix3Xd& y, int first) {
    return segmentDistance(y.col(e.a - first), y.col(e.b - first), y.col(f.a - first), y.col(f.b - first));
  };
  Pair pair{true, a, b, e.radius + f.radius, 1.0};
  const double stray = std::max(strays_[e.a], strays_[e.b]) + std::max(strays_[f.a], strays_[f.b]);
  if (distance(x, 0) <= pair.thickness + stray && fitToRest(surface, e.object, f.object, gap_, distance, pair))
    pairs_.push_back(pair);
}

void SheetCandidates::testPoint(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x,
                                int number, int element)
{
  const SheetPieces::Point& p = pieces.points[number];
  if (!points_[p.point].overlaps(volumes_[element]))
    return;
  const int triangle = pieces.triangleOf(element);
  const ContactTriangle& t = surface.triangles[triangle];
  const auto& c = t.corner;
  if (p.point == c[0] || p.point == c[1] || p.point == c[2] || (p.driven && t.driven == 7))
    return;
  const auto distance = [&](const Eigen::Matrix3Xd& y, int first) {
    return pointTriangleDistance(y.col(p.point - first), y.col(c[0] - first), y.col(c[1] - first), y.col(c[2] - first));
  };
  Pair pair{false, number, triangle, p.radius + t.half_thickness, 1.0};
  const double stray = strays_[p.point] + std::max({strays_[c[0]], strays_[c[1]], strays_[c[2]]});
  if (distance(x, 0) <= pair.thickness + stray && fitToRest(surface, p.object, t.object, gap_, distance, pair))
    pairs_.push_back(pair);
}

void SheetCandidates::findOnSolid(const ContactSurface& surface, const std::vector<SheetPieces::Face>& faces, int solid,
                                  const SolidPieces& pieces, const SurfaceMotion& motion, const Slack& slack)
{
  const Pose& pose = motion.solids[solid];
  const ContactSolid& properties = surface.solids[solid];
  const Eigen::Quaterniond to_solid = pose.orientation.conjugate();
  const double reach = pieces.reach, shift = slack.shift[solid], turn = slack.turn[solid];
  for (const SheetPieces::Face& face : faces)
  {
    Eigen::Vector3d z[3], middle = Eigen::Vector3d::Zero();
    double moved2 = 0.0, farthest2 = 0.0, half2 = 0.0;
    for (int k = 0; k < face.corners; ++k)
    {
      const int i = face.corner[k];
      z[k] = motion.x.col(i) - pose.position;
      moved2 = std::max(moved2, (motion.x_end.col(i) - motion.x.col(i)).squaredNorm());
      farthest2 = std::max(farthest2, z[k].squaredNorm());
      middle += z[k] / face.corners;
    }
    for (int k = 0; k < face.corners; ++k)
      half2 = std::max(half2, (z[k] - middle).squaredNorm());
    // how far a point of the face may come nearer, seen from the solid
    const double moved = std::sqrt(moved2) + kCorner * slack.margin;
    const double range = slack.gap + face.radius + moved + shift + turn * (std::sqrt(farthest2) + moved + shift);
    if (middle.norm() > reach + std::sqrt(half2) + range || !mayTouch(surface, face.object, properties) ||
        passesThrough(surface, face.object, face.corner.data(), face.corners, properties))
      continue;
    for (int k = 0; k < face.corners; ++k)
      z[k] = to_solid * z[k];
    const auto add = [&](int piece) {
      if (leastFaceDistance(pieces.pieces[piece], z, face.corners) <= range)
        on_solids_.push_back({solid, piece, face});
    };
    if (pieces.tree.empty())
    {
      add(0);
      continue;
    }
    BoundingBox box = BoundingBox::empty();
    for (int k = 0; k < face.corners; ++k)
      box.include(z[k]);
    box.enlarge(range);
    triangles_.clear();
    pieces.tree[0].query(box, triangles_);
    for (const int triangle : triangles_)
      add(triangle);
  }
}

}   // namespace slender
