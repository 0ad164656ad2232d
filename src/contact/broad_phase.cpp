#include "slender_sim/contact/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "linalg/parallel_for.h"

namespace slender {

namespace {

unsigned bucketOf(const std::int32_t* cell, unsigned mask)
{
  unsigned h = static_cast<unsigned>(cell[0]) * 73856093u ^ static_cast<unsigned>(cell[1]) * 19349663u ^
               static_cast<unsigned>(cell[2]) * 83492791u;
  h ^= h >> 15;
  return h & mask;
}

std::int32_t cellOf(double coordinate, double inverse_size)
{
  return static_cast<std::int32_t>(std::floor(coordinate * inverse_size));
}

}   // namespace

double GridPairs::cellSize(const std::vector<BoundingBox>& boxes) const
{
  double mean = 0.0, farthest = 0.0;
  for (const int i : members_)
  {
    const BoundingBox& b = boxes[i];
    mean += (b.high - b.low).maxCoeff();
    farthest = std::max({farthest, b.high.cwiseAbs().maxCoeff(), b.low.cwiseAbs().maxCoeff()});
  }
  // No smaller than 32-bit cell numbers allow; larger while a few huge boxes would fill too many cells.
  // Twice the mean: a box then fills about three and a half cells.
  double size = std::max({2.0 * mean / members_.size(), farthest * 1e-9, 1e-300});
  for (;;)
  {
    double count = 0.0;
    for (const int i : members_)
      count += ((boxes[i].high - boxes[i].low).array() / size + 1.0).prod();   // on average over its place in the grid
    if (count <= 8.0 * members_.size())
      return size;
    size *= 1.5;
  }
}

/// Calls f for each cell that a box overlaps.
template <class F>
void GridPairs::forCells(const BoundingBox& box, F&& f) const
{
  Cell low, high;
  for (int k = 0; k < 3; ++k)
  {
    low[k] = cellOf(box.low[k], inverse_size_);
    high[k] = cellOf(box.high[k], inverse_size_);
  }
  for (std::int32_t x = low[0]; x <= high[0]; ++x)
    for (std::int32_t y = low[1]; y <= high[1]; ++y)
      for (std::int32_t z = low[2]; z <= high[2]; ++z)
        f(Cell{x, y, z});
}

/// Sorts the members by the buckets of the cells that they overlap.
void GridPairs::fill(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets)
{
  inverse_size_ = 1.0 / cellSize(boxes);
  entries_.clear();
  for (const int i : members_)
    forCells(boxes[i], [&](const Cell& cell) { entries_.push_back({{cell[0], cell[1], cell[2]}, i, sets[i]}); });
  unsigned buckets = 64;
  while (buckets < entries_.size())
    buckets *= 2;
  bucket_start_.assign(buckets + 1, 0);
  for (const Entry& e : entries_)
    ++bucket_start_[bucketOf(e.cell, buckets - 1)];
  std::partial_sum(bucket_start_.begin(), bucket_start_.end(), bucket_start_.begin());
  sorted_.resize(entries_.size());
  for (auto e = entries_.rbegin(); e != entries_.rend(); ++e)   // Each bucket is filled from its end to its start.
    sorted_[--bucket_start_[bucketOf(e->cell, buckets - 1)]] = *e;
}

/// Of the cells that two boxes overlap, the one with the lowest corner of what they share reports the pair.
bool GridPairs::reports(const Cell& cell, const BoundingBox& u, const BoundingBox& v) const
{
  bool lowest = true;
  for (int c = 0; c < 3; ++c)
    lowest = lowest && cell[c] == cellOf(std::max(u.low[c], v.low[c]), inverse_size_);
  return lowest;
}

void GridPairs::search(const std::vector<BoundingBox>& boxes, unsigned bucket, std::vector<Pair>& found) const
{
  const int from = bucket_start_[bucket], to = bucket_start_[bucket + 1];
  for (int p = from; p < to; ++p)
    for (int q = p + 1; q < to; ++q)
    {
      const Entry &a = sorted_[p], &b = sorted_[q];
      if ((a.set == b.set && a.set != kNone) || a.cell[0] != b.cell[0] || a.cell[1] != b.cell[1] ||
          a.cell[2] != b.cell[2])
        continue;
      const BoundingBox &u = boxes[a.box], &v = boxes[b.box];
      if (u.overlaps(v) && reports(a.cell, u, v))
        found.push_back({std::min(a.box, b.box), std::max(a.box, b.box)});
    }
}

/// Finds the members that overlap a box. Of two members the first one finds the second one.
void GridPairs::searchMembers(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets, int box,
                              std::vector<Pair>& found) const
{
  const BoundingBox& u = boxes[box];
  const auto isPair = [&](int other) {
    return (sets[box] == kNone || sets[box] != sets[other]) && other != box && (other > box || !is_member_[box]) &&
           u.overlaps(boxes[other]);
  };
  const auto take = [&](int other) { found.push_back({std::min(box, other), std::max(box, other)}); };
  const BoundingBox within{u.low.cwiseMax(hull_.low), u.high.cwiseMin(hull_.high)};
  const double cells = ((within.high - within.low).array() * inverse_size_ + 1.0).prod();
  if (cells > static_cast<double>(members_.size()))
  {
    for (const int other : members_)
      if (isPair(other))
        take(other);
    return;
  }
  const auto buckets = static_cast<unsigned>(bucket_start_.size()) - 1;
  forCells(within, [&](const Cell& cell) {
    const unsigned bucket = bucketOf(cell, buckets - 1);
    for (int p = bucket_start_[bucket]; p < bucket_start_[bucket + 1]; ++p)
    {
      const Entry& e = sorted_[p];
      if (std::equal(cell, cell + 3, e.cell) && isPair(e.box) && reports(cell, u, boxes[e.box]))
        take(e.box);
    }
  });
}

/// Calls f(k, found) for 0 <= k < count. Each range of `share` numbers has its own list of pairs.
template <class F>
void GridPairs::collect(int threads, unsigned count, unsigned share, F&& f)
{
  const unsigned lists = (count + share - 1) / share;
  if (found_.size() < lists)
    found_.resize(lists);
  for (auto& found : found_)
    found.clear();
  parallelFor(threads, static_cast<int>(lists), 1, [&](int list) {
    for (unsigned k = list * share; k < std::min(count, (list + 1) * share); ++k)
      f(k, found_[list]);
  });
}

const std::vector<GridPairs::Pair>& GridPairs::find(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets,
                                                    int threads)
{
  constexpr unsigned kShare = 1 << 13;   // A thread searches so many buckets at a time.
  pairs_.clear();
  if (boxes.size() < 2)
    return pairs_;
  members_.resize(boxes.size());
  std::iota(members_.begin(), members_.end(), 0);
  fill(boxes, sets);
  collect(threads, static_cast<unsigned>(bucket_start_.size()) - 1, kShare,
          [&](unsigned bucket, std::vector<Pair>& found) { search(boxes, bucket, found); });
  sortPairs(static_cast<int>(boxes.size()));
  return pairs_;
}

const std::vector<GridPairs::Pair>& GridPairs::findWith(const std::vector<int>& chosen,
                                                        const std::vector<BoundingBox>& boxes,
                                                        const std::vector<int>& sets, int threads)
{
  constexpr unsigned kShare = 1 << 12;   // A thread takes so many boxes at a time.
  pairs_.clear();
  if (chosen.empty())
    return pairs_;
  members_ = chosen;
  is_member_.assign(boxes.size(), false);
  hull_ = BoundingBox::empty();
  for (const int i : chosen)
  {
    is_member_[i] = true;
    hull_.include(boxes[i]);
  }
  fill(boxes, sets);
  collect(threads, static_cast<unsigned>(boxes.size()), kShare, [&](unsigned box, std::vector<Pair>& found) {
    if (hull_.overlaps(boxes[box]))
      searchMembers(boxes, sets, static_cast<int>(box), found);
  });
  sortPairs(static_cast<int>(boxes.size()));
  return pairs_;
}

void GridPairs::sortPairs(int boxes)
{
  first_start_.assign(boxes + 1, 0);
  for (const auto& found : found_)
    for (const Pair& p : found)
      ++first_start_[p.first + 1];
  std::partial_sum(first_start_.begin(), first_start_.end(), first_start_.begin());
  pairs_.resize(first_start_.back());
  for (const auto& found : found_)
    for (const Pair& p : found)
      pairs_[first_start_[p.first]++] = p;
  int from = 0;
  for (int i = 0; i < boxes; ++i)
  {
    std::sort(pairs_.begin() + from, pairs_.begin() + first_start_[i],
              [](const Pair& p, const Pair& q) { return p.second < q.second; });
    from = first_start_[i];
  }
}

}   // namespace slender
