#include "parallel_for.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#ifdef SLENDER_TSAN
#include <sanitizer/tsan_interface.h>
#endif

namespace slender {

namespace {

/// Tells the thread sanitizer, which does not see into the library, that what happened before signal() is known after
/// wait().
struct Order
{
#ifdef SLENDER_TSAN
  void signal() { __tsan_release(this); }
  void wait() { __tsan_acquire(this); }
#else
  void signal() {}
  void wait() {}
#endif
};

/// Returns the threads for a call. The arena of each number of threads is kept.
tbb::task_arena& arenaOf(int threads)
{
  constexpr int kMost = 256;   // A scene may ask for more threads than there are processors.
  static const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, kMost);
  threads = std::min(threads, kMost);
  static std::mutex mutex;
  static auto& arenas = *new std::map<int, tbb::task_arena>;   // stays until the process has ended
  const std::lock_guard<std::mutex> lock(mutex);
  return arenas.try_emplace(threads, threads).first->second;
}

/// Returns how many threads work unless the caller says it.
int threadsOfEnvironment()
{
  const char* const text = std::getenv("SLENDER_THREADS");
  const int threads = text ? std::atoi(text) : 0;
  return threads > 0 ? threads : tbb::task_arena::automatic;
}

}   // namespace

void callParallel(int threads, int count, int chunk, void (*call)(const void* f, int k), const void* f)
{
  static const int usual = threadsOfEnvironment();
  if (threads <= 0)
    threads = usual;
  if (threads == 1)
  {
    for (int k = 0; k < count; ++k)
      call(f, k);
    return;
  }
  Order begin, end;
  begin.signal();
  arenaOf(threads).execute([&] {
    const auto run = [&](const tbb::blocked_range<int>& range) {
      begin.wait();
      for (int k = range.begin(); k < range.end(); ++k)
        call(f, k);
      end.signal();
    };
    tbb::parallel_for(tbb::blocked_range<int>(0, count, chunk), run, tbb::simple_partitioner());
  });
  end.wait();
}

}   // namespace slender
