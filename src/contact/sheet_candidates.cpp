#include "sheet_candidates.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "slender_sim/contact/distance.h"
#include "pair_gap.h"

namespace slender {

namespace {

const double kCorner = std::sqrt(3.0);   // of a cube, from its middle, over half its side
constexpr double kMet = 1e-6;            // of thickness and gap: pieces that are nearer at rest are neighbours

/// A pair of pieces as one number. The numbers sort as pairs do: pairs of a point and a triangle start at kPoints.
using Key = std::uint64_t;
constexpr Key kPoints = Key{1} << 62;
Key keyOf(int first, int second) { return (static_cast<Key>(first) << 31) + static_cast<Key>(second); }
int firstOf(Key key) { return static_cast<int>(key % kPoints >> 31); }
int secondOf(Key key) { return static_cast<int>(key % (Key{1} << 31)); }

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

Kdop volume(const std::vector<Kdop>& points, const SheetPieces::Edge& edge)
{
  Kdop out = points[edge.a];
  out.include(points[edge.b]);
  return out;
}

Kdop volume(const std::vector<Kdop>& points, const std::array<int, 3>& corner)
{
  Kdop out = points[corner[0]];
  out.include(points[corner[1]]);
  out.include(points[corner[2]]);
  return out;
}

}   // namespace

void SheetCandidates::build(const ContactSurface& surface, const SheetPieces& pieces,
                            const std::vector<SolidPieces>& solids, const SurfaceMotion& motion, const Slack& slack)
{
  pairs_.clear();
  on_solids_.clear();
  gap_ = slack.gap;
  findPairs(surface, pieces, motion, slack);
  const std::vector<SheetPieces::Face>* lists[3] = {&pieces.corners, &pieces.whole, &pieces.faces};
  for (auto& balls : balls_)
    balls.clear();
  for (std::size_t k = 0; k < solids.size(); ++k)
  {
    const ContactSolid& solid = surface.solids[k];
    const int list = std::holds_alternative<Plane>(solid.shape) ? 0 : solid.body ? 1 : 2;
    if (balls_[list].empty())
      setBalls(*lists[list], motion, slack.margin, balls_[list]);
    findOnSolid(surface, *lists[list], balls_[list], static_cast<int>(k), solids[k], motion, slack);
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
  skin_.resize(objects);
  edge_counts_.resize(objects);
  setSkins(pieces, x);
  volumes_.resize(count);
  active_.resize(count);
  known_.clear();
  tree_built_ = true;
}

void SheetCandidates::setSkins(const SheetPieces& pieces, const Eigen::Matrix3Xd& x)
{
  constexpr double kSkin = 0.1;   // of the mean edge; 0.05 to 0.15 take about the same time, 0.2 takes more
  std::fill(skin_.begin(), skin_.end(), 0.0);
  std::fill(edge_counts_.begin(), edge_counts_.end(), 0);
  for (const SheetPieces::Edge& e : pieces.edges)
  {
    skin_[e.object] += kSkin * (x.col(e.b) - x.col(e.a)).norm();
    ++edge_counts_[e.object];
  }
  for (std::size_t k = 0; k < skin_.size(); ++k)
    skin_[k] /= std::max(1, edge_counts_[k]);
}

void SheetCandidates::findPairs(const ContactSurface& surface, const SheetPieces& pieces, const SurfaceMotion& motion,
                                const Slack& slack)
{
  if (!tree_built_)
    buildTree(surface, pieces, motion.x);
  setVolumes(pieces, motion, slack);
  updateNeighbours(surface, pieces);
  for (const Key key : neighbours_)
    key < kPoints ? testEdges(surface, pieces, motion.x, firstOf(key), secondOf(key))
                  : testPoint(surface, pieces, motion.x, firstOf(key), secondOf(key));
}

/// Sets the volumes of points in the frame of their mean, and how far they stray from their places in it.
void SheetCandidates::setVolumes(const SheetPieces& pieces, const SurfaceMotion& motion, const Slack& slack)
{
  Eigen::Vector3d begin = Eigen::Vector3d::Zero(), end = begin;
  for (const SheetPieces::Point& p : pieces.points)
  {
    begin += motion.x.col(p.point);
    end += motion.x_end.col(p.point);
  }
  begin /= static_cast<double>(pieces.points.size());
  end /= static_cast<double>(pieces.points.size());
  const double around = 0.5 * slack.gap + kCorner * slack.margin;
  points_.resize(static_cast<std::size_t>(motion.x.cols()));
  strays_.resize(points_.size());
  for (const SheetPieces::Point& p : pieces.points)
  {
    const Eigen::Vector3d from = motion.x.col(p.point) - begin, to = motion.x_end.col(p.point) - end;
    points_[p.point] = Kdop::swept(from.data(), to.data(), p.radius + around);
    strays_[p.point] = (to - from).norm() + around;
  }
}

/// Finds the neighbours of points that have left their skins.
void SheetCandidates::updateNeighbours(const ContactSurface& surface, const SheetPieces& pieces)
{
  constexpr double kMany = 0.5;   // of the points: if more have left, the list begins anew
  left_.assign(points_.size(), 0);
  std::size_t count = 0;
  for (const SheetPieces::Point& p : pieces.points)
    if (known_.empty() || !known_[p.point].contains(points_[p.point]))
    {
      left_[p.point] = 1;
      ++count;
    }
  if (count == 0)
    return;
  if (static_cast<double>(count) > kMany * static_cast<double>(pieces.points.size()) ||
      neighbours_.size() > most_neighbours_)
  {
    left_.assign(points_.size(), 1);
    neighbours_.clear();
  }
  const bool anew = neighbours_.empty();
  known_.resize(points_.size());
  for (const SheetPieces::Point& p : pieces.points)
    if (left_[p.point])
    {
      known_[p.point] = points_[p.point];
      known_[p.point].enlarge(static_cast<float>(skin_[p.object]));
    }
  for (std::size_t i = 0; i < volumes_.size(); ++i)
  {
    const auto& corner = pieces.elements[i].corner;
    volumes_[i] = volume(known_, corner);
    active_[i] = left_[corner[0]] | left_[corner[1]] | left_[corner[2]];
  }
  found_.clear();
  fresh_.clear();
  tree_.refit(volumes_, active_);
  tree_.selfPairs(found_);
  for (const KdopTree::Pair& p : found_)
    addNeighbours(surface, pieces, p.first, p.second);
  std::sort(fresh_.begin(), fresh_.end());
  merged_.clear();
  std::set_union(neighbours_.begin(), neighbours_.end(), fresh_.begin(), fresh_.end(), std::back_inserter(merged_));
  neighbours_.swap(merged_);
  if (anew)
    most_neighbours_ = 2 * neighbours_.size() + pieces.points.size();
}

/// Adds the pairs of pieces that two elements own.
void SheetCandidates::addNeighbours(const ContactSurface& surface, const SheetPieces& pieces, int a, int b)
{
  const SheetPieces::Element &e = pieces.elements[a], &f = pieces.elements[b];
  for (int k = 0; k < 3 && e.edge[k] >= 0; ++k)
    for (int l = 0; l < 3 && f.edge[l] >= 0; ++l)
      addEdges(pieces, std::min(e.edge[k], f.edge[l]), std::max(e.edge[k], f.edge[l]));
  for (int k = 0; k < 3 && e.point[k] >= 0 && f.corners == 3; ++k)
    addPoint(surface, pieces, e.point[k], b);
  for (int k = 0; k < 3 && f.point[k] >= 0 && e.corners == 3; ++k)
    addPoint(surface, pieces, f.point[k], a);
}

void SheetCandidates::addEdges(const SheetPieces& pieces, int a, int b)
{
  const SheetPieces::Edge &e = pieces.edges[a], &f = pieces.edges[b];
  if (e.a == f.a || e.a == f.b || e.b == f.a || e.b == f.b || (e.driven && f.driven))
    return;
  if (volume(known_, e).overlaps(volume(known_, f)))
    fresh_.push_back(keyOf(a, b));
}

void SheetCandidates::addPoint(const ContactSurface& surface, const SheetPieces& pieces, int number, int element)
{
  const SheetPieces::Point& p = pieces.points[number];
  const int triangle = pieces.triangleOf(element);
  const ContactTriangle& t = surface.triangles[triangle];
  const auto& c = t.corner;
  if (p.point == c[0] || p.point == c[1] || p.point == c[2] || (p.driven && t.driven == 7))
    return;
  if (known_[p.point].overlaps(volumes_[element]))
    fresh_.push_back(kPoints + keyOf(number, triangle));
}

void SheetCandidates::testEdges(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x,
                                int a, int b)
{
  const SheetPieces::Edge &e = pieces.edges[a], &f = pieces.edges[b];
  if (!volume(points_, e).overlaps(volume(points_, f)))
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
                                int number, int triangle)
{
  const SheetPieces::Point& p = pieces.points[number];
  const ContactTriangle& t = surface.triangles[triangle];
  const auto& c = t.corner;
  if (!points_[p.point].overlaps(volume(points_, c)))
    return;
  const auto distance = [&](const Eigen::Matrix3Xd& y, int first) {
    return pointTriangleDistance(y.col(p.point - first), y.col(c[0] - first), y.col(c[1] - first), y.col(c[2] - first));
  };
  Pair pair{false, number, triangle, p.radius + t.half_thickness, 1.0};
  const double stray = strays_[p.point] + std::max({strays_[c[0]], strays_[c[1]], strays_[c[2]]});
  if (distance(x, 0) <= pair.thickness + stray && fitToRest(surface, p.object, t.object, gap_, distance, pair))
    pairs_.push_back(pair);
}

/// Balls in which faces remain while points stay near their motions.
void SheetCandidates::setBalls(const std::vector<SheetPieces::Face>& faces, const SurfaceMotion& motion, double margin,
                               std::vector<Ball>& balls)
{
  for (const SheetPieces::Face& face : faces)
  {
    Ball ball{Eigen::Vector3d::Zero(), 0.0, 0.0};
    for (int k = 0; k < face.corners; ++k)
    {
      const int i = face.corner[k];
      ball.middle += motion.x.col(i) / face.corners;
      ball.moved = std::max(ball.moved, (motion.x_end.col(i) - motion.x.col(i)).squaredNorm());
    }
    for (int k = 0; k < face.corners; ++k)
      ball.half = std::max(ball.half, (motion.x.col(face.corner[k]) - ball.middle).squaredNorm());
    ball.moved = std::sqrt(ball.moved) + kCorner * margin;
    ball.half = std::sqrt(ball.half);
    balls.push_back(ball);
  }
}

void SheetCandidates::findOnSolid(const ContactSurface& surface, const std::vector<SheetPieces::Face>& faces,
                                  const std::vector<Ball>& balls, int solid, const SolidPieces& pieces,
                                  const SurfaceMotion& motion, const Slack& slack)
{
  const Pose& pose = motion.solids[solid];
  const ContactSolid& properties = surface.solids[solid];
  const Eigen::Quaterniond to_solid = pose.orientation.conjugate();
  const double reach = pieces.reach, shift = slack.shift[solid], turn = slack.turn[solid];
  for (std::size_t f = 0; f < faces.size(); ++f)
  {
    const SheetPieces::Face& face = faces[f];
    const Ball& ball = balls[f];
    // how far a point of the face may come nearer, seen from the solid
    // The distance at which a point of the face may still touch the solid, because both move and the solid turns: the
    // sum of a part that is the same at all distances and of the turn of the ball's middle.
    const double far2 = (ball.middle - pose.position).squaredNorm(), moved = ball.moved + shift,
                 same = slack.gap + face.radius + moved + turn * (ball.half + moved), near = reach + ball.half + same;
    if ((1.0 - turn) * (1.0 - turn) * far2 > near * near && turn < 1.0)
      continue;
    const double range = same + turn * std::sqrt(far2);
    if (!mayTouch(surface, face.object, properties) ||
        passesThrough(surface, face.object, face.corner.data(), face.corners, properties))
      continue;
    Eigen::Vector3d z[3];
    for (int k = 0; k < face.corners; ++k)
      z[k] = to_solid * (motion.x.col(face.corner[k]) - pose.position);
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
