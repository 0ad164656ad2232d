#include "slender_sim/energy/hinge_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const HingeKernels& hingeKernels()
{
  static const HingeKernels& table = SLENDER_PICK_KERNELS(kHingeKernels);
  return table;
}

}   // namespace slender
