#include "collision_pairs.h"

#include <algorithm>
#include <limits>

#include "slender_sim/contact/distance.h"

namespace slender {

namespace {

constexpr double kMargin = 0.5;   // of shells
constexpr long kPlaceWork = 2;    // of a WorkBudget: where a pair lies

double leastAlong(const CollisionPair& pair, const Eigen::Matrix3Xd& x)
{
  double least = std::numeric_limits<double>::infinity();
  const int second = pair.edges ? 2 : 1;
  double along[4];
  for (int i = 0; i < 4; ++i)
    along[i] = pair.normal.dot(x.col(pair.point[i]) - x.col(pair.point[3]));
  for (int i = 0; i < second; ++i)
    for (int j = second; j < 4; ++j)
      least = std::min(least, along[i] - along[j]);
  return least;
}

}   // namespace

CollisionPairs::CollisionPairs(const CollisionElements& elements) : elements_(elements)
{
  const std::size_t points = elements.point_object.size(), count = elements.elements.size();
  radius_.resize(points);
  margin_.resize(points);
  for (std::size_t i = 0; i < points; ++i)
    if (const int object = elements.point_object[i]; object >= 0)
    {
      margin_[i] = kMargin * elements.objects[object].shell;
      radius_[i] = elements.objects[object].shell + elements.objects[object].core + margin_[i];
    }
  points_.resize(points);
  edges_.resize(elements.edges.size());
  volumes_.resize(count);
  active_.resize(count);
  strayed_.resize(points);
  searched_.resize(3, points);
  Eigen::Matrix3Xd centers(3, count);
  std::vector<int> groups(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    const CollisionElements::Element& e = elements.elements[i];
    groups[i] = e.object;
    centers.col(i) =
        (elements.reference.col(e.v[0]) + elements.reference.col(e.v[1]) + elements.reference.col(e.v[2])) / 3.0;
  }
  tree_.build(centers, groups, elements.touching, elements.objects.size());
}

const std::vector<CollisionPair>& CollisionPairs::find(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                                       WorkBudget& budget)
{
  pairs_.clear();
  std::fill(strayed_.begin(), strayed_.end(), 1);
  searched_ = to;
  search(from, budget);
  return pairs_;
}

const std::vector<CollisionPair>& CollisionPairs::update(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                                         WorkBudget& budget)
{
  bool any = false;
  for (std::size_t i = 0; i < points_.size(); ++i)
  {
    // most ends lie between the start and the first end: impulses stop motions
    strayed_[i] =
        to.col(i) != searched_.col(i) && pointSegmentDistance(to.col(i), from.col(i), searched_.col(i)) > margin_[i];
    if (strayed_[i])
      searched_.col(i) = to.col(i);
    any = any || strayed_[i];
  }
  if (!any)
    return pairs_;
  const auto strayed = [&](const CollisionPair& p) {
    return strayed_[p.point[0]] | strayed_[p.point[1]] | strayed_[p.point[2]] | strayed_[p.point[3]];
  };
  pairs_.erase(std::remove_if(pairs_.begin(), pairs_.end(), strayed), pairs_.end());
  search(from, budget);
  return pairs_;
}

/// Adds all pairs of points that strayed.
void CollisionPairs::search(const Eigen::Matrix3Xd& from, WorkBudget& budget)
{
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (strayed_[i])
      points_[i] = Kdop::swept(from.col(i).data(), searched_.col(i).data(), radius_[i]);
  for (std::size_t i = 0; i < edges_.size(); ++i)
  {
    const CollisionElements::Edge& e = elements_.edges[i];
    if (!(strayed_[e.a] | strayed_[e.b]))
      continue;
    edges_[i] = points_[e.a];
    edges_[i].include(points_[e.b]);
  }
  for (std::size_t i = 0; i < volumes_.size(); ++i)
  {
    const auto& v = elements_.elements[i].v;
    active_[i] = strayed_[v[0]] | strayed_[v[1]] | strayed_[v[2]];
    if (!active_[i])
      continue;
    volumes_[i] = points_[v[0]];
    volumes_[i].include(points_[v[1]]);
    volumes_[i].include(points_[v[2]]);
  }
  found_.clear();
  tree_.refit(volumes_, active_);
  tree_.selfPairs(found_, static_cast<std::size_t>(budget.left()));
  budget.spend(static_cast<long>(volumes_.size() + found_.size()));
  for (const KdopTree::Pair& p : found_)
  {
    if (budget.spent())
      return;
    const std::size_t before = pairs_.size();
    testElements(p.first, p.second, from);
    testElements(p.second, p.first, from);
    budget.spend(kPlaceWork * static_cast<long>(pairs_.size() - before));
  }
}

void CollisionPairs::add(int first, int second, bool edges, const int (&point)[4], const Eigen::Matrix3Xd& from)
{
  if (!(strayed_[point[0]] | strayed_[point[1]] | strayed_[point[2]] | strayed_[point[3]]))
    return;
  CollisionPair pair{first, second, edges, {point[0], point[1], point[2], point[3]}, 0.0, 0.0, Eigen::Vector3d::Zero()};
  const PairPlace at = place(pair, from);
  const double thickness = core(pair);
  pair.gap = at.distance - thickness;
  pair.normal = at.normal;
  const double room = thickness + 0.5 * pair.gap;
  pair.room = leastAlong(pair, from) > room ? room : std::numeric_limits<double>::infinity();   // the normal is rounded
  pairs_.push_back(pair);
}

/// What a owns against b: points against the face; edges against the edges that b owns, from one side only.
void CollisionPairs::testElements(int a, int b, const Eigen::Matrix3Xd& from)
{
  const CollisionElements::Element &ea = elements_.elements[a], &eb = elements_.elements[b];
  if (ea.owns_point && eb.corners == 3)
    for (int k = 0; k < 3; ++k)
    {
      const int p = ea.v[k];
      if ((ea.owns_point & (1 << k)) && p != eb.v[0] && p != eb.v[1] && p != eb.v[2] &&
          points_[p].overlaps(volumes_[b]))
        add(p, b, false, {p, eb.v[0], eb.v[1], eb.v[2]}, from);
    }
  if (a > b || !ea.owns_edge || !eb.owns_edge)
    return;
  for (int i = 0; i < 3; ++i)
  {
    if (!(ea.owns_edge & (1 << i)))
      continue;
    const CollisionElements::Edge& first = elements_.edges[ea.edge[i]];
    for (int j = 0; j < 3; ++j)
    {
      if (!(eb.owns_edge & (1 << j)))
        continue;
      const CollisionElements::Edge& second = elements_.edges[eb.edge[j]];
      if (first.a != second.a && first.a != second.b && first.b != second.a && first.b != second.b &&
          edges_[ea.edge[i]].overlaps(edges_[eb.edge[j]]))
        add(ea.edge[i], eb.edge[j], true, {first.a, first.b, second.a, second.b}, from);
    }
  }
}

bool CollisionPairs::separated(const CollisionPair& pair, const Eigen::Matrix3Xd& to)
{
  return leastAlong(pair, to) > pair.room;
}

int CollisionPairs::object(const CollisionPair& pair, bool second) const
{
  if (pair.edges)
    return elements_.edges[second ? pair.second : pair.first].object;
  return second ? elements_.elements[pair.second].object : elements_.point_object[pair.first];
}

double CollisionPairs::core(const CollisionPair& pair) const
{
  return elements_.objects[object(pair, false)].core + elements_.objects[object(pair, true)].core;
}

double CollisionPairs::shell(const CollisionPair& pair) const
{
  return elements_.objects[object(pair, false)].shell + elements_.objects[object(pair, true)].shell;
}

template <class Position>
PairPlace CollisionPairs::placeAt(const CollisionPair& pair, Position x) const
{
  PairPlace out;
  Eigen::Vector3d way;
  const Eigen::Vector3d p[4] = {x(pair.point[0]), x(pair.point[1]), x(pair.point[2]), x(pair.point[3])};
  std::copy(pair.point, pair.point + 4, out.point);
  if (pair.edges)
  {
    const SegmentPair at = closestOfSegments(p[0], p[1], p[2], p[3]);
    out.weight[0] = 1.0 - at.s;
    out.weight[1] = at.s;
    out.weight[2] = at.t - 1.0;
    out.weight[3] = -at.t;
    out.inside = at.s > 0.0 && at.s < 1.0 && at.t > 0.0 && at.t < 1.0;
    way = p[0] - p[2] + at.s * (p[1] - p[0]) - at.t * (p[3] - p[2]);
  }
  else
  {
    const Eigen::Vector3d w = closestOnTriangle(p[0], p[1], p[2], p[3]);
    out.weight[0] = 1.0;
    way.setZero();
    for (int k = 0; k < 3; ++k)
    {
      out.weight[k + 1] = -w[k];
      way += w[k] * (p[0] - p[k + 1]);
    }
    out.inside = w.minCoeff() > 0.0;
  }
  out.distance = way.norm();
  out.normal = out.distance > 0.0 ? Eigen::Vector3d(way / out.distance) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  return out;
}

PairPlace CollisionPairs::place(const CollisionPair& pair, const Eigen::Matrix3Xd& x) const
{
  return placeAt(pair, [&](int i) -> Eigen::Vector3d { return x.col(i); });
}

PairPlace CollisionPairs::place(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                double share) const
{
  return placeAt(pair, [&](int i) -> Eigen::Vector3d { return from.col(i) + share * (to.col(i) - from.col(i)); });
}

double CollisionPairs::limit(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                             const ApproachLimit& limit) const
{
  MovingPoint p[4];
  for (int i = 0; i < 4; ++i)
    p[i] = {from.col(pair.point[i]), to.col(pair.point[i])};
  return pair.edges ? segmentsLimit(p[0], p[1], p[2], p[3], limit) : pointTriangleLimit(p[0], p[1], p[2], p[3], limit);
}

}   // namespace slender
