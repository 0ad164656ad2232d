#include "island_finder.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace slender {

/// Sorts the boxes along x, and compares each with those that begin before it ends.
bool IslandFinder::joinNear(const std::vector<Reach>& parts, double margin)
{
  boxes_.resize(parts.size());
  order_.clear();
  for (std::size_t k = 0; k < parts.size(); ++k)
  {
    const BoundingBox& box = parts[k].box;
    if ((!parts[k].has_points && !parts[k].is_solid) || (box.low.array() > box.high.array()).any())
      continue;   // touches nothing, or has no parts now
    order_.push_back(static_cast<int>(k));
    boxes_[k] = {box.low.array() - margin, box.high.array() + margin};
    if (!boxes_[k].low.allFinite() || !boxes_[k].high.allFinite())
    {
      const Eigen::Vector3d far = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
      boxes_[k] = {-far, far};
    }
  }
  std::sort(order_.begin(), order_.end(), [this](int a, int b) {
    return boxes_[a].low.x() != boxes_[b].low.x() ? boxes_[a].low.x() < boxes_[b].low.x() : a < b;
  });
  bool joined = false;
  for (std::size_t i = 0; i < order_.size(); ++i)
    for (std::size_t k = i + 1; k < order_.size() && boxes_[order_[k]].low.x() <= boxes_[order_[i]].high.x(); ++k)
    {
      const int a = order_[i], b = order_[k];
      if (boxes_[a].overlaps(boxes_[b]) && parts[a].mayTouch(parts[b]) && sets_.of(a) != sets_.of(b))
      {
        join(a, b);
        joined = true;
      }
    }
  return joined;
}

int IslandFinder::find()
{
  const int parts = sets_.count();
  int islands = 0;
  island_of_.resize(static_cast<std::size_t>(parts));
  for (int k = 0; k < parts; ++k)   // the name of a set is its first part
    island_of_[k] = sets_.of(k) == k ? islands++ : island_of_[sets_.of(k)];
  start_.assign(static_cast<std::size_t>(islands) + 1, 0);
  for (int k = 0; k < parts; ++k)
    ++start_[island_of_[k] + 1];
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  parts_.resize(static_cast<std::size_t>(parts));
  order_.assign(start_.begin(), start_.end() - 1);
  for (int k = 0; k < parts; ++k)
    parts_[order_[island_of_[k]]++] = k;
  return islands;
}

void IslandFinder::partsOf(int island, std::vector<int>& parts) const
{
  parts.assign(parts_.begin() + start_[island], parts_.begin() + start_[island + 1]);
}

}   // namespace slender
