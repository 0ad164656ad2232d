#include "slender_sim/energy/hinge_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const HingeKernels& hingeKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const HingeKernels& table = pickKernels(baseline::kHingeKernels, avx2::kHingeKernels, avx512::kHingeKernels);
  return table;
#else
  return baseline::kHingeKernels;
#endif
}

}   // namespace slender
