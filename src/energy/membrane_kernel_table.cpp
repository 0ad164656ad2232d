#include "slender_sim/energy/membrane_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const MembraneKernels& membraneKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const MembraneKernels& table =
      pickKernels(baseline::kMembraneKernels, avx2::kMembraneKernels, avx512::kMembraneKernels);
  return table;
#else
  return baseline::kMembraneKernels;
#endif
}

}   // namespace slender
