#include "slender_sim/linalg/isa.h"

namespace slender {

Isa bestIsa()
{
#ifdef SLENDER_X86_KERNELS
  static const Isa isa = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")
                             ? Isa::avx512
                         : __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? Isa::avx2
                                                                                           : Isa::baseline;
  return isa;
#else
  return Isa::baseline;
#endif
}

const char* toString(Isa isa)
{
  return isa == Isa::avx512 ? "avx512" : isa == Isa::avx2 ? "avx2" : "baseline";
}

}  // namespace slender
