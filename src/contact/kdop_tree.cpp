#include "kdop_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slender {

Kdop Kdop::swept(const double* from, const double* to, double radius)
{
  constexpr double kDiagonal = 1.4142135623730952;
  const auto slabs = [](const double* p, double* s) {
    s[0] = p[0];
    s[1] = p[1];
    s[2] = p[2];
    s[3] = p[0] + p[1];
    s[4] = p[0] - p[1];
    s[5] = p[0] + p[2];
    s[6] = p[0] - p[2];
    s[7] = p[1] + p[2];
  };
  double a[8], b[8];
  slabs(from, a);
  slabs(to, b);
  Kdop out;
  for (int k = 0; k < 8; ++k)
  {
    const double r = k < 3 ? radius : kDiagonal * radius;
    const float low = static_cast<float>(std::min(a[k], b[k]) - r), high = static_cast<float>(std::max(a[k], b[k]) + r);
    out.low[k / 4][k % 4] = low - 3e-7f * std::abs(low) - 1e-37f;   // further than the conversion rounds
    out.high[k / 4][k % 4] = high + 3e-7f * std::abs(high) + 1e-37f;
  }
  return out;
}

void KdopTree::build(const Eigen::Matrix3Xd& centers, const std::vector<int>& groups, const std::vector<char>& touching,
                     std::size_t count)
{
  touching_ = touching;
  groups_ = count;
  const int n = static_cast<int>(centers.cols());
  order_.resize(n);
  for (int i = 0; i < n; ++i)
    order_[i] = i;
  // not std::stable_sort(), which takes memory
  std::sort(order_.begin(), order_.end(),
            [&](int i, int j) { return groups[i] != groups[j] ? groups[i] < groups[j] : i < j; });
  nodes_.clear();
  if (n > 0)
    divide(0, n, centers, groups);
  volumes_.resize(nodes_.size());
}

void KdopTree::divide(int from, int to, const Eigen::Matrix3Xd& centers, const std::vector<int>& groups)
{
  const int first = groups[order_[from]], last = groups[order_[to - 1]];
  const std::size_t node = nodes_.size();
  nodes_.push_back({-1 - order_[from], to - from, first == last ? first : -1, false});
  if (to - from == 1)
    return;
  const auto begin = order_.begin();
  int middle;
  if (first != last)
  {
    const int group = groups[order_[(from + to) / 2]];
    const int lower = static_cast<int>(
        std::lower_bound(begin + from, begin + to, group, [&](int i, int g) { return groups[i] < g; }) - begin);
    const int upper = static_cast<int>(
        std::upper_bound(begin + from, begin + to, group, [&](int g, int i) { return g < groups[i]; }) - begin);
    middle = lower > from && (upper == to || (from + to) / 2 - lower < upper - (from + to) / 2) ? lower : upper;
  }
  else
  {
    Eigen::Vector3d low = centers.col(order_[from]), high = low;
    for (int i = from; i < to; ++i)
    {
      low = low.cwiseMin(centers.col(order_[i]));
      high = high.cwiseMax(centers.col(order_[i]));
    }
    int axis;
    (high - low).maxCoeff(&axis);
    middle = (from + to) / 2;
    std::nth_element(begin + from, begin + middle, begin + to, [&](int i, int j) {
      return centers(axis, i) != centers(axis, j) ? centers(axis, i) < centers(axis, j) : i < j;
    });
  }
  divide(from, middle, centers, groups);
  nodes_[node].second = static_cast<int>(nodes_.size());
  divide(middle, to, centers, groups);
}

void KdopTree::refit(const std::vector<Kdop>& volumes, const std::vector<char>& active)
{
  for (std::size_t i = nodes_.size(); i-- > 0;)
  {
    Node& node = nodes_[i];
    if (node.second < 0)
    {
      volumes_[i] = volumes[-1 - node.second];
      node.active = active[-1 - node.second] != 0;
      continue;
    }
    volumes_[i] = volumes_[i + 1];
    volumes_[i].include(volumes_[node.second]);
    node.active = nodes_[i + 1].active || nodes_[node.second].active;
  }
}

void KdopTree::selfPairs(std::vector<Pair>& pairs, std::size_t most) const
{
  if (!nodes_.empty())
    inside(0, pairs, most);
}

void KdopTree::inside(int number, std::vector<Pair>& pairs, std::size_t most) const
{
  const Node& node = nodes_[number];
  if (node.second < 0 || !node.active || apart(node, node))
    return;
  inside(number + 1, pairs, most);
  inside(node.second, pairs, most);
  if (volumes_[number + 1].overlaps(volumes_[node.second]))
    between(number + 1, node.second, pairs, most);
}

/// Of two nodes that overlap.
void KdopTree::between(int a, int b, std::vector<Pair>& pairs, std::size_t most) const
{
  const Node &first = nodes_[a], &second = nodes_[b];
  if (!(first.active || second.active) || apart(first, second) || pairs.size() > most)
    return;
  if (first.leaves == 1 && second.leaves == 1)
  {
    pairs.push_back({-1 - first.second, -1 - second.second});
    return;
  }
  if (first.leaves >= second.leaves)
  {
    for (const int child : {a + 1, first.second})
      if (volumes_[child].overlaps(volumes_[b]))
        between(child, b, pairs, most);
    return;
  }
  for (const int child : {b + 1, second.second})
    if (volumes_[child].overlaps(volumes_[a]))
      between(a, child, pairs, most);
}

}   // namespace slender
