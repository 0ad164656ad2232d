#include "slender_sim/linalg/isa.h"
#include "slender_sim/linalg/point_kernel.h"

namespace slender {

const PointKernels& pointKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const PointKernels& table = pickKernels(baseline::point_kernels, avx2::point_kernels, avx512::point_kernels);
  return table;
#else
  return baseline::point_kernels;
#endif
}

}   // namespace slender
