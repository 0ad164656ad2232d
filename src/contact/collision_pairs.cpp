#include "collision_pairs.h"

#include <algorithm>

#include "slender_sim/contact/distance.h"

namespace slender {

CollisionPairs::CollisionPairs(const CollisionElements& elements) : elements_(elements)
{
  const std::size_t points = elements.point_object.size(), count = elements.elements.size();
  radius_.resize(points);
  for (std::size_t i = 0; i < points; ++i)
    if (const int object = elements.point_object[i]; object >= 0)
      radius_[i] = elements.objects[object].shell + elements.objects[object].core;
  points_.resize(points);
  edges_.resize(elements.edges.size());
  volumes_.resize(count);
  active_.resize(count);
  all_.assign(points, 1);
  Eigen::Matrix3Xd centers(3, count);
  std::vector<int> groups(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    const CollisionElements::Element& e = elements.elements[i];
    groups[i] = e.object;
    centers.col(i) = (elements.reference.col(e.v[0]) + elements.reference.col(e.v[1]) + elements.reference.col(e.v[2])) / 3.0;
  }
  tree_.build(centers, groups);
}

const std::vector<CollisionPair>& CollisionPairs::all(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to)
{
  return ofChanged(from, to, all_);
}

const std::vector<CollisionPair>& CollisionPairs::ofChanged(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                                            const std::vector<char>& changed)
{
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (changed[i])
      points_[i] = Kdop::swept(from.col(i).data(), to.col(i).data(), radius_[i]);
  for (std::size_t i = 0; i < edges_.size(); ++i)
  {
    const CollisionElements::Edge& e = elements_.edges[i];
    if (!(changed[e.a] | changed[e.b]))
      continue;
    edges_[i] = points_[e.a];
    edges_[i].include(points_[e.b]);
  }
  for (std::size_t i = 0; i < volumes_.size(); ++i)
  {
    const auto& v = elements_.elements[i].v;
    active_[i] = changed[v[0]] | changed[v[1]] | changed[v[2]];
    if (!active_[i])
      continue;
    volumes_[i] = points_[v[0]];
    volumes_[i].include(points_[v[1]]);
    volumes_[i].include(points_[v[2]]);
  }
  return find(changed);
}

const std::vector<CollisionPair>& CollisionPairs::find(const std::vector<char>& changed)
{
  pairs_.clear();
  found_.clear();
  tree_.refit(volumes_, active_);
  tree_.selfPairs(found_);
  for (const KdopTree::Pair& p : found_)
    if (elements_.mayTouch(elements_.elements[p.first].object, elements_.elements[p.second].object))
    {
      testElements(p.first, p.second, changed);
      testElements(p.second, p.first, changed);
    }
  return pairs_;
}

/// What a owns against b: points against the face; edges against the edges that b owns, from one side only.
void CollisionPairs::testElements(int a, int b, const std::vector<char>& changed)
{
  const CollisionElements::Element &ea = elements_.elements[a], &eb = elements_.elements[b];
  if (ea.owns_point && eb.corners == 3)
    for (int k = 0; k < 3; ++k)
    {
      const int p = ea.v[k];
      if (!(ea.owns_point & (1 << k)) || p == eb.v[0] || p == eb.v[1] || p == eb.v[2] ||
          !(changed[p] | changed[eb.v[0]] | changed[eb.v[1]] | changed[eb.v[2]]) || !points_[p].overlaps(volumes_[b]))
        continue;
      pairs_.push_back({p, b, false});
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
      if (first.a == second.a || first.a == second.b || first.b == second.a || first.b == second.b ||
          !(changed[first.a] | changed[first.b] | changed[second.a] | changed[second.b]) ||
          !edges_[ea.edge[i]].overlaps(edges_[eb.edge[j]]))
        continue;
      pairs_.push_back({ea.edge[i], eb.edge[j], true});
    }
  }
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
  if (pair.edges)
  {
    const CollisionElements::Edge &a = elements_.edges[pair.first], &b = elements_.edges[pair.second];
    const Eigen::Vector3d a0 = x(a.a), a1 = x(a.b), b0 = x(b.a), b1 = x(b.b);
    const SegmentPair at = closestOfSegments(a0, a1, b0, b1);
    out.point[0] = a.a;
    out.point[1] = a.b;
    out.point[2] = b.a;
    out.point[3] = b.b;
    out.weight[0] = 1.0 - at.s;
    out.weight[1] = at.s;
    out.weight[2] = at.t - 1.0;
    out.weight[3] = -at.t;
    out.inside = at.s > 0.0 && at.s < 1.0 && at.t > 0.0 && at.t < 1.0;
    way = a0 - b0 + at.s * (a1 - a0) - at.t * (b1 - b0);
  }
  else
  {
    const auto& v = elements_.elements[pair.second].v;
    const Eigen::Vector3d p = x(pair.first), corner[3] = {x(v[0]), x(v[1]), x(v[2])};
    const Eigen::Vector3d w = closestOnTriangle(p, corner[0], corner[1], corner[2]);
    out.point[0] = pair.first;
    out.weight[0] = 1.0;
    way.setZero();
    for (int k = 0; k < 3; ++k)
    {
      out.point[k + 1] = v[k];
      out.weight[k + 1] = -w[k];
      way += w[k] * (p - corner[k]);
    }
    out.inside = true;
  }
  out.distance = way.norm();
  out.normal = out.distance > 0.0 ? Eigen::Vector3d(way / out.distance) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  return out;
}

PairPlace CollisionPairs::place(const CollisionPair& pair, const Eigen::Matrix3Xd& x) const
{
  return placeAt(pair, [&](int i) -> Eigen::Vector3d { return x.col(i); });
}

PairPlace CollisionPairs::place(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, double share) const
{
  return placeAt(pair, [&](int i) -> Eigen::Vector3d { return from.col(i) + share * (to.col(i) - from.col(i)); });
}

double CollisionPairs::limit(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, const ApproachLimit& limit) const
{
  const auto moving = [&](int i) { return MovingPoint{from.col(i), to.col(i)}; };
  if (pair.edges)
  {
    const CollisionElements::Edge &a = elements_.edges[pair.first], &b = elements_.edges[pair.second];
    return segmentsLimit(moving(a.a), moving(a.b), moving(b.a), moving(b.b), limit);
  }
  const auto& v = elements_.elements[pair.second].v;
  return pointTriangleLimit(moving(pair.first), moving(v[0]), moving(v[1]), moving(v[2]), limit);
}

}  // namespace slender
