#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const RodKernels& rodKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const RodKernels& table = pickKernels(baseline::rod_kernels, avx2::rod_kernels, avx512::rod_kernels);
  return table;
#else
  return baseline::rod_kernels;
#endif
}

}   // namespace slender
