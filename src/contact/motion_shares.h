#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

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
    parent_.resize(static_cast<std::size_t>(movers) + 1);
    std::iota(parent_.begin(), parent_.end(), 0);
    share_.assign(parent_.size(), 1.0);
  }
  /// What does not move is never united with others or limited.
  bool moves(int mover) const { return mover == kPrescribed ? prescribed_moves_ : mover != kFixed; }
  /// The groups of two movers become one, which goes the smaller one of their shares.
  void unite(int a, int b)
  {
    if (!moves(a) || !moves(b))
      return;
    const int one = shorten(a), other = shorten(b), from = std::max(one, other), to = std::min(one, other);
    parent_[from] = to;   // The ways to groups stay short if movers come in the order of a chain.
    share_[to] = std::min(share_[to], share_[from]);
  }
  void uniteAll()
  {
    for (std::size_t k = 0; k + 1 < parent_.size(); ++k)
      unite(static_cast<int>(k), k == 0 ? kPrescribed : 0);
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
    for (std::size_t k = 1; k + 1 < parent_.size(); ++k)
      if (of(static_cast<int>(k)) != first)
        return true;
    return prescribed_moves_ && of(kPrescribed) != first;
  }
  double least() const { return *std::min_element(share_.begin(), share_.end()); }

private:
  int index(int mover) const { return mover == kPrescribed ? static_cast<int>(parent_.size()) - 1 : mover; }
  int groupOf(int mover) const
  {
    int k = index(mover);
    while (parent_[k] != k)
      k = parent_[k];
    return k;
  }
  /// Returns the group, and halves the way to it.
  int shorten(int mover)
  {
    int k = index(mover);
    while (parent_[k] != k)
      k = parent_[k] = parent_[parent_[k]];
    return k;
  }

  bool prescribed_moves_ = false;
  std::vector<int> parent_;     ///< of movers; the last one is kPrescribed
  std::vector<double> share_;   ///< per mover, of its group if it has no parent
};

}   // namespace slender
