#include "slender_sim/linalg/banded_ldlt.h"

#include "slender_sim/linalg/banded_ldlt_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

namespace {

const BandKernels& kernels()
{
#ifdef SLENDER_X86_KERNELS
  static const BandKernels& table = pickKernels(baseline::band_kernels, avx2::band_kernels, avx512::band_kernels);
  return table;
#else
  return baseline::band_kernels;
#endif
}

}  // namespace

template <int HalfBandwidth, int Block>
void BandedLdlt<HalfBandwidth, Block>::resize(int blocks)
{
  blocks_ = blocks;
  panels_.resize(blocks);
}

template <int HalfBandwidth, int Block>
Inertia BandedLdlt<HalfBandwidth, Block>::factor(int count)
{
  const int n = count < 0 ? blocks_ : count;
  const int negative = kernels().factor(panels_.data(), n);
  if (negative < 0)
    return {0, 0, 1};
  return {n * Block - negative, negative, 0};
}

template <int HalfBandwidth, int Block>
void BandedLdlt<HalfBandwidth, Block>::solve(double* x, int count) const
{
  kernels().solve(panels_.data(), count < 0 ? blocks_ : count, x);
}

template <int HalfBandwidth, int Block>
void BandedLdlt<HalfBandwidth, Block>::solve8(double* x, int count) const
{
  kernels().solve8(panels_.data(), count < 0 ? blocks_ : count, x);
}

template class BandedLdlt<10, 4>;

}  // namespace slender
