#pragma once

#ifdef _OPENMP
#include <omp.h>
#endif

namespace slender {

/// Calls f(k) for 0 <= k < count, in any order, on this many threads. If `threads` is 0, OpenMP chooses their number.
/// A thread takes `chunk` numbers at a time. f must not throw, because that ends the
/// process. So it ends if memory runs out in f.
template <class F>
void parallelFor(int threads, int count, [[maybe_unused]] int chunk, F&& f)
{
  if (threads == 1 || count == 1)
  {
    for (int k = 0; k < count; ++k)   // OpenMP would take memory for its one thread
      f(k);
    return;
  }
#ifdef _OPENMP
#pragma omp parallel for schedule(dynamic, chunk) num_threads(threads > 0 ? threads : omp_get_max_threads())
#endif
  for (int k = 0; k < count; ++k)
    f(k);
}

}   // namespace slender
