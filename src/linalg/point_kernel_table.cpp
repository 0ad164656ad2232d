#include "slender_sim/linalg/isa.h"
#include "slender_sim/linalg/point_kernel.h"

namespace slender {

const PointKernels& pointKernels()
{
  static const PointKernels& table = SLENDER_PICK_KERNELS(kPointKernels);
  return table;
}

}   // namespace slender
