#pragma once

#include <ctime>

namespace slender::study {

/// CPU time of the calling thread [s]: unlike the wall clock it does not count what other processes take.
inline double threadSeconds()
{
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}   // namespace slender::study
