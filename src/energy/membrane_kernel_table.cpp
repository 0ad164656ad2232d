#include "slender_sim/energy/membrane_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const MembraneKernels& membraneKernels()
{
  static const MembraneKernels& table = SLENDER_PICK_KERNELS(kMembraneKernels);
  return table;
}

}   // namespace slender
