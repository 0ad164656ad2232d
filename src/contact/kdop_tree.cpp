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
  group_.clear();
  const int n = static_cast<int>(centers.cols());
  order_.resize(n);
  for (int i = 0; i < n; ++i)
    order_[i] = i;
  // not std::stable_sort(), which takes memory
  std::sort(order_.begin(), order_.end(),
            [&](int i, int j) { return groups[i] != groups[j] ? groups[i] < groups[j] : i < j; });
  second_.clear();
  leaves_.clear();
  if (n > 0)
    divide(0, n, centers, groups);
  volumes_.resize(second_.size());
  active_.resize(second_.size());
}

void KdopTree::divide(int from, int to, const Eigen::Matrix3Xd& centers, const std::vector<int>& groups)
{
  const std::size_t node = second_.size();
  leaves_.push_back(to - from);
  group_.push_back(groups[order_[from]] == groups[order_[to - 1]] ? groups[order_[from]] : -1);
  if (to - from == 1)
  {
    second_.push_back(-1 - order_[from]);
    return;
  }
  second_.push_back(0);
  const auto begin = order_.begin();
  int middle;
  const int first = groups[order_[from]], last = groups[order_[to - 1]];
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
  second_[node] = static_cast<int>(second_.size());
  divide(middle, to, centers, groups);
}

void KdopTree::refit(const std::vector<Kdop>& volumes, const std::vector<char>& active)
{
  for (int i = static_cast<int>(second_.size()) - 1; i >= 0; --i)
  {
    const int second = second_[i];
    if (second < 0)
    {
      volumes_[i] = volumes[-1 - second];
      active_[i] = active[-1 - second];
      continue;
    }
    volumes_[i] = volumes_[i + 1];
    volumes_[i].include(volumes_[second]);
    active_[i] = active_[i + 1] | active_[second];
  }
}

void KdopTree::selfPairs(std::vector<Pair>& pairs, std::size_t most) const
{
  if (!second_.empty())
    inside(0, pairs, most);
}

void KdopTree::inside(int node, std::vector<Pair>& pairs, std::size_t most) const
{
  const int second = second_[node];
  if (second < 0 || !active_[node] || apart(node, node))
    return;
  inside(node + 1, pairs, most);
  inside(second, pairs, most);
  if (volumes_[node + 1].overlaps(volumes_[second]))
    between(node + 1, second, pairs, most);
}

/// Of two nodes that overlap.
void KdopTree::between(int a, int b, std::vector<Pair>& pairs, std::size_t most) const
{
  if (!(active_[a] | active_[b]) || apart(a, b) || pairs.size() > most)
    return;
  if (leaves_[a] == 1 && leaves_[b] == 1)
  {
    pairs.push_back({-1 - second_[a], -1 - second_[b]});
    return;
  }
  const bool first = leaves_[a] >= leaves_[b];
  const int divided = first ? a : b, other = first ? b : a;
  for (const int child : {divided + 1, second_[divided]})
    if (volumes_[child].overlaps(volumes_[other]))
      first ? between(child, other, pairs, most) : between(other, child, pairs, most);
}

}   // namespace slender
