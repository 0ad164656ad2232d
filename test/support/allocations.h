#pragma once

#include <atomic>

/// Requests of memory are counted where malloc can be replaced, see step_allocations.cpp.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define SLENDER_COUNTS_ALLOCATIONS

namespace slender::test {

extern std::atomic<long> allocations;   ///< since the program began

}   // namespace slender::test
#endif
