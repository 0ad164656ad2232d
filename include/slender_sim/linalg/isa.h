#pragma once

namespace slender {

enum class Isa
{
  baseline,
  avx2,
  avx512
};

/// Widest instruction set that both this machine and this build offer, and that SLENDER_ISA (baseline, avx2) in the
/// environment does not forbid.
Isa bestIsa();
const char* toString(Isa isa);

/// Picks among the per-instruction-set tables of a kernel.
template <class Table>
const Table& pickKernels(const Table& baseline, const Table& avx2, const Table& avx512)
{
  switch (bestIsa())
  {
    case Isa::avx512: return avx512;
    case Isa::avx2: return avx2;
    default: return baseline;
  }
}

}   // namespace slender
