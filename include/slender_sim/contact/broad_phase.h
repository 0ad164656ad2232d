#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

namespace slender {

/// Axis-parallel box [m].
struct BoundingBox
{
  Eigen::Vector3d low, high;
  static BoundingBox empty()
  {
    const Eigen::Vector3d far = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    return {far, -far};
  }
  void include(const Eigen::Vector3d& point) { low = low.cwiseMin(point), high = high.cwiseMax(point); }
  void include(const BoundingBox& b) { low = low.cwiseMin(b.low), high = high.cwiseMax(b.high); }
  void enlarge(double margin) { low.array() -= margin, high.array() += margin; }
  bool overlaps(
      const BoundingBox& b) const   // without branches: most boxes of a grid cell do not, and nobody can predict which
  {
    return (low.x() <= b.high.x()) & (b.low.x() <= high.x()) & (low.y() <= b.high.y()) & (b.low.y() <= high.y()) &
           (low.z() <= b.high.z()) & (b.low.z() <= high.z());
  }
};

/// Pairs of overlapping boxes through a hashed uniform grid. Time and memory are linear in boxes and pairs when boxes
/// are of similar size; memory is reused from call to call. For 2,000 (50,000) segments of hair 0.16 (12) ms, against
/// 0.35 (17) ms of FCL's dynamic AABB tree and 0.21 (130) ms of sort and sweep, on one thread
/// (bench/contact_benchmark.cpp).
class GridPairs
{
public:
  struct Pair
  {
    int first, second;   ///< first < second
  };
  static constexpr int kNone = -1;
  /// Returns all overlapping pairs, sorted. Boxes must be finite. Two boxes of the same set are no pair; `sets` has the
  /// set of each box, or kNone. So many `threads` search. With 0 their number is the one that Simulation has by
  /// default.
  const std::vector<Pair>& find(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets, int threads = 1);
  /// Returns those of the pairs of find() that have a `chosen` box, or two of them. No box is chosen twice. The chosen
  /// boxes alone fill the grid, so that few of them take a small part of the time of find().
  const std::vector<Pair>& findWith(const std::vector<int>& chosen, const std::vector<BoundingBox>& boxes,
                                    const std::vector<int>& sets, int threads = 1);

private:
  struct Entry
  {
    std::int32_t cell[3];
    int box, set;
  };
  using Cell = std::int32_t[3];
  void fill(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets);
  double cellSize(const std::vector<BoundingBox>& boxes) const;
  template <class F>
  void forCells(const BoundingBox& box, F&& f) const;
  bool reports(const Cell& cell, const BoundingBox& u, const BoundingBox& v) const;
  void search(const std::vector<BoundingBox>& boxes, unsigned bucket, std::vector<Pair>& found) const;
  void searchMembers(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets, int box,
                     std::vector<Pair>& found) const;
  template <class F>
  void collect(int threads, unsigned count, unsigned share, F&& f);
  void sortPairs(int boxes);

  std::vector<int> members_;   ///< the boxes that fill the grid
  std::vector<char> is_member_;
  BoundingBox hull_;            ///< of the members, for findWith()
  double inverse_size_ = 0.0;   ///< of cells [1/m]
  std::vector<Entry> entries_, sorted_;
  std::vector<int> bucket_start_;          ///< of each bucket in sorted_; then the number of entries
  std::vector<std::vector<Pair>> found_;   ///< one list for each range of buckets, or of boxes
  std::vector<Pair> pairs_;
  std::vector<int> first_start_;
};

}   // namespace slender
