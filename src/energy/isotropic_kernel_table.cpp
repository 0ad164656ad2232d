#include "slender_sim/energy/isotropic_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const IsotropicKernels& isotropicKernels()
{
  static const IsotropicKernels& table = SLENDER_PICK_KERNELS(kIsotropicKernels);
  return table;
}

}   // namespace slender
