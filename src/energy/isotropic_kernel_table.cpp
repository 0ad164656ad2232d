#include "slender_sim/energy/isotropic_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const IsotropicKernels& isotropicKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const IsotropicKernels& table =
      pickKernels(baseline::isotropic_kernels, avx2::isotropic_kernels, avx512::isotropic_kernels);
  return table;
#else
  return baseline::isotropic_kernels;
#endif
}

}   // namespace slender
