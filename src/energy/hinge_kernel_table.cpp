#include "slender_sim/energy/hinge_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const HingeKernels& hingeKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const HingeKernels& table = pickKernels(baseline::hinge_kernels, avx2::hinge_kernels, avx512::hinge_kernels);
  return table;
#else
  return baseline::hinge_kernels;
#endif
}

}   // namespace slender
