#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace slender {

/// Divides the numbers 0 ... count - 1 into sets, of which each number belongs to one (union-find). The name of a set
/// is its least number. Memory is reused.
class DisjointSets
{
public:
  /// Each number is a set of its own.
  void begin(int count)
  {
    before_.resize(static_cast<std::size_t>(count));
    std::iota(before_.begin(), before_.end(), 0);
  }
  int count() const { return static_cast<int>(before_.size()); }
  /// Returns the name of the set that contains k.
  int of(int k) const
  {
    while (before_[k] != k)
      k = before_[k];
    return k;
  }
  /// Unites the sets that contain a and b. Returns the name of the new set.
  int unite(int a, int b)
  {
    a = shorten(a), b = shorten(b);
    return before_[std::max(a, b)] = std::min(a, b);
  }

private:
  /// Returns the name of the set, and halves the way to it.
  int shorten(int k)
  {
    while (before_[k] != k)
      k = before_[k] = before_[before_[k]];
    return k;
  }

  std::vector<int> before_;   ///< of each number, a smaller one of its set; the name has itself
};

}   // namespace slender
