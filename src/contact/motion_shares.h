#pragma once

#include <algorithm>
#include <vector>

namespace slender {

/// How far several movers may go along their motions. Movers are things that move independently of each other, such as
/// the parts of an island; all that moves as prescribed is one mover, too. Those that would meet something are blocked,
/// and go the same share of their ways. All others go all of their ways, so that few contacts do not stop what is free.
/// Memory is reused.
struct MotionShares
{
  static constexpr int kPrescribed = -1, kFixed = -2;   ///< the movers of what moves as prescribed, and of what stands
  /// The mover of each point and solid of a surface. Points that are driven belong to kPrescribed, whatever is here.
  std::vector<int> of_point, of_solid;
  std::vector<char> blocked;         ///< per mover
  bool prescribed_moves = false;     ///< The motion of kPrescribed is not zero.
  bool prescribed_blocked = false;   ///< kPrescribed is blocked. Counts if it moves.
  double share = 1.0;                ///< of the blocked movers

  void block(int mover)
  {
    if (mover == kPrescribed)
      prescribed_blocked = true;
    else if (mover != kFixed)
      blocked[mover] = 1;
  }
  void blockAll()
  {
    blocked.assign(blocked.size(), 1);
    prescribed_blocked = true;
  }
  bool moves(int mover) const { return mover == kPrescribed ? prescribed_moves : mover != kFixed; }
  bool isBlocked(int mover) const
  {
    return moves(mover) && (mover == kPrescribed ? prescribed_blocked : blocked[mover] != 0);
  }
  bool anyFree() const
  {
    return (prescribed_moves && !prescribed_blocked) || std::find(blocked.begin(), blocked.end(), 0) != blocked.end();
  }
  double of(int mover) const { return isBlocked(mover) ? share : 1.0; }
};

}   // namespace slender
