#include "slender_sim/dynamics/chain_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const ChainKernels& chainKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const ChainKernels& table = pickKernels(baseline::kChainKernels, avx2::kChainKernels, avx512::kChainKernels);
  return table;
#else
  return baseline::kChainKernels;
#endif
}

}   // namespace slender
