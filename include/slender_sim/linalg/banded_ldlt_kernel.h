#pragma once

namespace slender {

template <int HalfBandwidth, int Block>
struct BandPanel;

/// Entry points of one instruction set's factorisation (src/linalg/banded_ldlt_kernel.cpp is compiled once for each).
struct BandKernels
{
  /// Returns the number of negative pivots, or -1 - i when pivot i is zero or not finite.
  int (*factor)(BandPanel<10, 4>* panels, int blocks);
  void (*solve)(const BandPanel<10, 4>* panels, int blocks, double* x);
  void (*solve8)(const BandPanel<10, 4>* panels, int blocks, double* x);
};

namespace baseline { extern const BandKernels band_kernels; }
namespace avx2 { extern const BandKernels band_kernels; }
namespace avx512 { extern const BandKernels band_kernels; }

}  // namespace slender
