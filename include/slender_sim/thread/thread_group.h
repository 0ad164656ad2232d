#pragma once

#include <vector>

#include "slender_sim/thread/thread_model.h"

namespace slender {

/// The threads into which one thread has broken. Ids of nodes and threads are unique over all of them.
struct ThreadGroupState
{
  /// the one that hangs on the nozzle (or the newest part) first, then the others by age, youngest first
  std::vector<ThreadState> threads;
  std::uint64_t next_thread_id = 1;
  double dropped_volume = 0.0;   ///< [m^3] of whole threads taken away because too many lay on the floor
  double left_volume = 0.0;      ///< [m^3] of whole threads that had left the region
  double start_volume = 0.0;     ///< [m^3] that was there at the start

  /// Fluid that is there, was dropped or has left, less what was fed [m^3]: constant.
  double volumeBalance() const;
};

/// Where the fluid of one or several threads is [m^3].
struct ThreadVolumes
{
  double start = 0.0;     ///< there at the start
  double fed = 0.0;       ///< came out of the nozzle since
  double present = 0.0;   ///< there now
  double left = 0.0;      ///< was taken away outside the region
  double dropped = 0.0;   ///< was taken away because more nodes lay on the floor than `edges.deposited` allows

  void add(const ThreadGroupState& state);
  /// Fluid that is not accounted for, over all that there ever was [-]. Round-off makes it about 1e-13 after an hour of
  /// steps.
  double missing() const;
  /// A larger difference than this is a defect, not round-off.
  static constexpr double kMostMissing = 1e-9;
};

/// Breaks threads where they are thinner than ThreadLimits::min_radius; and takes away whole ones that have left the
/// scene, and the oldest of those that only lie about.
void breakThreads(ThreadGroupState& state, const ThreadLimits& limits);
void dropThreads(ThreadGroupState& state, const ThreadLimits& limits);

}   // namespace slender
