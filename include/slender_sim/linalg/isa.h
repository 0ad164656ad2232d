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

/// Picks among the tables of a kernel, one per instruction set.
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

/// Declares the table `kernels` of each instruction set.
#define SLENDER_DECLARE_KERNELS(Table, kernels) \
  namespace baseline {                          \
  extern const Table kernels;                   \
  }                                             \
  namespace avx2 {                              \
  extern const Table kernels;                   \
  }                                             \
  namespace avx512 {                            \
  extern const Table kernels;                   \
  }

/// The table `kernels` for this processor. Each file *_kernel.cpp is compiled once per instruction set and defines a
/// table of this name in the namespace of that set; without x86 there is only the baseline.
#ifdef SLENDER_X86_KERNELS
#define SLENDER_PICK_KERNELS(kernels) ::slender::pickKernels(baseline::kernels, avx2::kernels, avx512::kernels)
#else
#define SLENDER_PICK_KERNELS(kernels) baseline::kernels
#endif
