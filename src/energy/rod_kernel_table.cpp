#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const RodKernels& rodKernels()
{
  static const RodKernels& table = SLENDER_PICK_KERNELS(kRodKernels);
  return table;
}

}   // namespace slender
