#include "slender_sim/linalg/banded_ldlt.h"

#include "slender_sim/linalg/banded_ldlt_kernel.h"
#include "slender_sim/linalg/isa.h"

namespace slender {

namespace {

const BandKernels& kernels()
{
  static const BandKernels& table = SLENDER_PICK_KERNELS(kBandKernels);
  return table;
}

}   // namespace

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
  BandCarry carry;
  eliminate(panels_.data(), 0, n, nullptr, carry);
  return {n * Block - carry.negative - carry.zero, carry.negative, carry.zero};
}

template <int HalfBandwidth, int Block>
void BandedLdlt<HalfBandwidth, Block>::eliminate(Panel* assembled, int from, int to, double* x, BandCarry& carry)
{
  kernels().eliminate(assembled, panels_.data() + from, from, to, x, carry);
}

template <int HalfBandwidth, int Block>
void BandedLdlt<HalfBandwidth, Block>::substitute(double* x) const
{
  kernels().substitute(panels_.data(), blocks_, x);
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

}   // namespace slender
