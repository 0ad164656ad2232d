#include "slender_sim/energy/isotropic_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const IsotropicKernels& isotropicKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const IsotropicKernels& table =
      pickKernels(baseline::kIsotropicKernels, avx2::kIsotropicKernels, avx512::kIsotropicKernels);
  return table;
#else
  return baseline::kIsotropicKernels;
#endif
}

}   // namespace slender
