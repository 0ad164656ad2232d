#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const RodKernels& rodKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const RodKernels& table = pickKernels(baseline::kRodKernels, avx2::kRodKernels, avx512::kRodKernels);
  return table;
#else
  return baseline::kRodKernels;
#endif
}

}   // namespace slender
