#include "slender_sim/dynamics/chain_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

const ChainKernels& chainKernels()
{
#ifdef SLENDER_X86_KERNELS
  static const ChainKernels& table = pickKernels(baseline::chain_kernels, avx2::chain_kernels, avx512::chain_kernels);
  return table;
#else
  return baseline::chain_kernels;
#endif
}

}   // namespace slender
