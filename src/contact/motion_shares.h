#pragma once

#include <vector>

namespace slender {

/// How far several movers may go along their motions. Movers are things that move independently of each other, such as
/// the parts of an island. Those that would meet something are blocked, and go the same share of their ways. All others
/// go all of their ways, so that few contacts do not stop what is free. Memory is reused.
struct MotionShares
{
  static constexpr int kPrescribed = -1;   ///< the mover of what moves as prescribed
  std::vector<int> of_point, of_solid;     ///< the mover of each point and solid of a surface
  std::vector<char> blocked;               ///< per mover
  double share = 1.0;                      ///< of the blocked movers

  void block(int mover)
  {
    if (mover != kPrescribed)
      blocked[mover] = 1;
  }
  bool isBlocked(int mover) const { return mover != kPrescribed && blocked[mover]; }
  double of(int mover) const { return isBlocked(mover) ? share : 1.0; }
};

}   // namespace slender
