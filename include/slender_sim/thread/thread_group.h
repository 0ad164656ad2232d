#pragma once

#include <vector>

#include "slender_sim/thread/thread_stepper.h"

namespace slender {

/// The threads into which one thread has broken. Ids of nodes and threads are unique over all of them.
struct ThreadGroupState
{
  std::vector<ThreadState> threads;   ///< the one that hangs on the nozzle (or the newest part) first, then the others by age, youngest first
  std::uint64_t next_thread_id = 1;
  double dropped_volume = 0.0;        ///< [m^3] of whole threads taken away

  /// Fluid that is there or was dropped, less what was fed [m^3]: constant.
  double volumeBalance() const;
};

/// Breaks threads where they are thinner than ThreadLimits::min_radius; and takes away whole ones that have left the scene, and the oldest of
/// those that only lie about.
void breakThreads(ThreadGroupState& state, const ThreadLimits& limits);
void dropThreads(ThreadGroupState& state, const ThreadLimits& limits);

/// Steps a thread that may break (ThreadLimits::min_radius), and all that has broken off it.
class ThreadGroup
{
public:
  /// Throws std::invalid_argument for a model that is not valid.
  ThreadGroup(std::shared_ptr<const ThreadModel> model, const NewtonConfig& newton) : stepper_(std::move(model), newton) {}

  /// Advances all threads by `duration` [s]; the inputs are common, held ends and the flow concern the thread that has them. On failure
  /// the state is untouched and the report says why.
  StepReport step(ThreadGroupState& state, const ThreadInputs& inputs, double duration);

  /// On the holders of the ends, as of the last successful step.
  const std::array<EndLoad, 2>& endLoads() const { return loads_; }

private:
  ThreadStepper stepper_;
  ThreadGroupState work_;
  std::array<EndLoad, 2> loads_;
};

}  // namespace slender
