#pragma once

#include <type_traits>

namespace slender {

/// Calls call(f, k) for 0 <= k < count: parallelFor() without its types.
void callParallel(int threads, int count, int chunk, void (*call)(const void* f, int k), const void* f);

/// Calls f(k) for 0 <= k < count, in any order, on this many threads. If `threads` is 0, their number is that of the
/// environment variable SLENDER_THREADS, or else that of the processors. A thread takes `chunk` numbers at a time.
/// Threads that wait for work sleep soon, so that other processes may use the processors. If f throws, so does this
/// function.
template <class F>
void parallelFor(int threads, int count, int chunk, F&& f)
{
  if (threads == 1 || count <= chunk)
  {
    for (int k = 0; k < count; ++k)
      f(k);
    return;
  }
  using Function = std::remove_reference_t<F>;
  callParallel(
      threads, count, chunk, [](const void* g, int k) { (*static_cast<const Function*>(g))(k); }, &f);
}

}   // namespace slender
