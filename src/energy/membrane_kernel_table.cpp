#include "slender_sim/energy/membrane_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const MembraneKernels& membraneKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const MembraneKernels& table =
      pickKernels(baseline::membrane_kernels, avx2::membrane_kernels, avx512::membrane_kernels);
  return table;
#else
  return baseline::membrane_kernels;
#endif
}

}   // namespace slender
