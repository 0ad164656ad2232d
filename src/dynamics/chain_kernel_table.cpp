#include "slender_sim/dynamics/chain_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const ChainKernels& chainKernels()
{
  static const ChainKernels& table = SLENDER_PICK_KERNELS(kChainKernels);
  return table;
}

}   // namespace slender
