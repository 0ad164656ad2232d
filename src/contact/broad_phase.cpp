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
  for (const BoundingBox& b : boxes)
  {
    mean += (b.high - b.low).maxCoeff();
    farthest = std::max({farthest, b.high.cwiseAbs().maxCoeff(), b.low.cwiseAbs().maxCoeff()});
  }
  // No smaller than 32-bit cell numbers allow; larger while a few huge boxes would fill too many cells.
  // Twice the mean: a box then fills about three and a half cells.
  double size = std::max({2.0 * mean / boxes.size(), farthest * 1e-9, 1e-300});
  for (;;)
  {
    double count = 0.0;
    for (const BoundingBox& b : boxes)
      count += ((b.high - b.low).array() / size + 1.0).prod();   // on average over its place in the grid
    if (count <= 8.0 * boxes.size())
      return size;
    size *= 1.5;
  }
}

/// Sorts the boxes by the buckets of the cells that they overlap.
void GridPairs::fillBuckets(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets, double inverse_size)
{
  entries_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i)
  {
    std::int32_t low[3], high[3];
    for (int k = 0; k < 3; ++k)
    {
      low[k] = cellOf(boxes[i].low[k], inverse_size);
      high[k] = cellOf(boxes[i].high[k], inverse_size);
    }
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z)
          entries_.push_back({{x, y, z}, static_cast<int>(i), sets[i]});
  }
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

void GridPairs::search(const std::vector<BoundingBox>& boxes, double inverse_size, unsigned bucket,
                       std::vector<Pair>& found) const
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
      if (!u.overlaps(v))
        continue;
      // of the cells that both fill, the one with the lowest corner of what they share reports the pair
      bool reports = true;
      for (int c = 0; c < 3; ++c)
        reports = reports && a.cell[c] == cellOf(std::max(u.low[c], v.low[c]), inverse_size);
      if (reports)
        found.push_back({std::min(a.box, b.box), std::max(a.box, b.box)});
    }
}

const std::vector<GridPairs::Pair>& GridPairs::find(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets,
                                                    int threads)
{
  constexpr unsigned kShare = 1 << 13;   // A thread searches so many buckets at a time.
  pairs_.clear();
  if (boxes.size() < 2)
    return pairs_;
  const double inverse_size = 1.0 / cellSize(boxes);
  fillBuckets(boxes, sets, inverse_size);
  const auto buckets = static_cast<unsigned>(bucket_start_.size()) - 1;
  const unsigned shares = (buckets + kShare - 1) / kShare;
  if (found_.size() < shares)
    found_.resize(shares);
  for (auto& found : found_)
    found.clear();
  parallelFor(threads, static_cast<int>(shares), 1, [&](int k) {
    for (unsigned bucket = k * kShare; bucket < std::min(buckets, (k + 1) * kShare); ++bucket)
      search(boxes, inverse_size, bucket, found_[k]);
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
