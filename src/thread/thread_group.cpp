#include "slender_sim/thread/thread_group.h"

#include <algorithm>

#include "slender_sim/thread/thread_remesh.h"

namespace slender {

double ThreadGroupState::volumeBalance() const
{
  double sum = dropped_volume + left_volume;
  for (const ThreadState& t : threads)
    sum += t.totalVolume() + t.dropped_volume + t.left_volume - t.fed_volume;
  return sum;
}

void ThreadVolumes::add(const ThreadGroupState& state)
{
  start += state.start_volume;
  left += state.left_volume;
  dropped += state.dropped_volume;
  for (const ThreadState& t : state.threads)
  {
    fed += t.fed_volume;
    present += t.totalVolume();
    left += t.left_volume;
    dropped += t.dropped_volume;
  }
}

double ThreadVolumes::missing() const
{
  const double all = start + fed;
  return all > 0 ? (all - present - left - dropped) / all : 0.0;
}

void breakThreads(ThreadGroupState& state, const ThreadLimits& limits)
{
  const double min_radius = limits.min_radius;
  if (min_radius == 0.0)
    return;
  for (std::size_t k = 0; k < state.threads.size(); ++k)
  {
    ThreadState older;
    while (breakThread(state.threads[k], min_radius, older))
    {
      older.thread_id = state.next_thread_id++;
      state.threads.insert(state.threads.begin() + k + 1, older);
    }
  }
}

void dropThreads(ThreadGroupState& state, const ThreadLimits& limits)
{
  const auto isHeld = [](const ThreadState& t) { return t.ends[0].held || t.ends[1].held; };
  long long lying = 0;   // the limit may be the largest int
  for (std::size_t k = 0; k < state.threads.size();)
  {
    const ThreadState& t = state.threads[k];
    const bool outside =
        std::none_of(t.x.begin(), t.x.end(), [&](const Eigen::Vector3d& x) { return limits.scene.contains(x); });
    const bool lies = std::all_of(t.deposited.begin(), t.deposited.end(), [](char d) { return d != 0; });
    if (lies)
      lying += t.nodes();
    // the stepper leaves max_deposited nodes behind the youngest one
    if (!isHeld(t) && (outside || (lies && lying > limits.max_deposited + 1LL)))
    {
      (outside ? state.left_volume : state.dropped_volume) += t.totalVolume() - t.fed_volume;
      state.left_volume += t.left_volume;
      state.dropped_volume += t.dropped_volume;
      state.threads.erase(state.threads.begin() + k);
    }
    else
      ++k;
  }
}

}   // namespace slender
