#include "slender_sim/linalg/isa.h"
#include "slender_sim/linalg/point_kernel.h"

namespace slender {

const PointKernels& pointKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const PointKernels& table = pickKernels(baseline::kPointKernels, avx2::kPointKernels, avx512::kPointKernels);
  return table;
#else
  return baseline::kPointKernels;
#endif
}

}   // namespace slender
