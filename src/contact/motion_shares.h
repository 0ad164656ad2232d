#pragma once

#include <algorithm>
#include <vector>

#include "linalg/disjoint_sets.h"

namespace slender {

/// How far several movers may go along their motions. Movers are things that move independently of each other, such as
/// the parts of an island; all that moves as prescribed is one mover, too. Movers that would meet, or depend on each
/// other, are a group, and go the same share of their ways. Memory is reused.
class MotionShares
{
public:
  static constexpr int kPrescribed = -1, kFixed = -2;   ///< the movers of what moves as prescribed, and of what stands
  /// The mover of each point and solid of a surface. Points that are driven belong to kPrescribed, whatever is here.
  std::vector<int> of_point, of_solid;

  /// Each of so many movers may go all of its way. `prescribed_moves`: the motion of kPrescribed is not zero.
  void begin(int movers, bool prescribed_moves)
  {
    prescribed_moves_ = prescribed_moves;
    groups_.begin(movers + 1);
    share_.assign(static_cast<std::size_t>(movers) + 1, 1.0);
  }
  /// What does not move is never united with others or limited.
  bool moves(int mover) const { return mover == kPrescribed ? prescribed_moves_ : mover != kFixed; }
  /// The groups of two movers become one, which goes the smaller one of their shares.
  void unite(int a, int b)
  {
    if (!moves(a) || !moves(b))
      return;
    const double share = std::min(of(a), of(b));
    share_[groups_.unite(index(a), index(b))] = share;
  }
  void uniteAll()
  {
    for (int k = 0; k + 1 < groups_.count(); ++k)
      unite(k, k == 0 ? kPrescribed : 0);
  }
  /// The group of the mover goes no more than this share.
  void limit(int mover, double share)
  {
    if (moves(mover))
      share_[groupOf(mover)] = std::min(share_[groupOf(mover)], share);
  }
  void stopAll()
  {
    uniteAll();
    share_.assign(share_.size(), 0.0);
  }
  /// Returns the share of a mover; 1 for what does not move.
  double of(int mover) const { return moves(mover) ? share_[groupOf(mover)] : 1.0; }
  /// Returns whether two movers go different shares.
  bool differ() const
  {
    const double first = of(0);
    for (int k = 1; k + 1 < groups_.count(); ++k)
      if (of(k) != first)
        return true;
    return prescribed_moves_ && of(kPrescribed) != first;
  }
  double least() const { return *std::min_element(share_.begin(), share_.end()); }

private:
  int index(int mover) const { return mover == kPrescribed ? groups_.count() - 1 : mover; }
  int groupOf(int mover) const { return groups_.of(index(mover)); }

  bool prescribed_moves_ = false;
  DisjointSets groups_;         ///< of movers; the last one is kPrescribed
  std::vector<double> share_;   ///< of the groups that have these names
};

}   // namespace slender
