#include "slender_sim/linalg/isa.h"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace slender {

namespace {

/// Tools that simulate a processor do not know all of the wide instructions.
[[maybe_unused]] Isa widestAllowed()
{
  const char* const word = std::getenv("SLENDER_ISA");
  const std::string limit = word ? word : "";
  return limit == "baseline" ? Isa::baseline : limit == "avx2" ? Isa::avx2 : Isa::avx512;
}

}   // namespace

Isa bestIsa()
{
#ifdef SLENDER_X86_KERNELS
  static const Isa offered =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")
          ? Isa::avx512
      : __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? Isa::avx2
                                                                        : Isa::baseline;
  static const Isa isa = std::min(offered, widestAllowed());
  return isa;
#else
  return Isa::baseline;
#endif
}

}   // namespace slender
