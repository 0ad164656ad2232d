#pragma once

namespace slender {
namespace {

/// Treats denormal numbers as zero while it lives. In a long band round-off couplings decay geometrically along the rod
/// until they are denormal, and from there on every operation on them would trap to microcode (20 times slower at 10^5
/// nodes).
class FlushDenormals
{
public:
#if defined(__SSE2__)
  FlushDenormals() : saved_(__builtin_ia32_stmxcsr()) { __builtin_ia32_ldmxcsr(saved_ | 0x8040); }
  ~FlushDenormals() { __builtin_ia32_ldmxcsr(saved_); }

private:
  unsigned saved_;
#else
  FlushDenormals() {}
#endif
};

}   // namespace
}   // namespace slender
