#pragma once

#include "slender_sim/linalg/isa.h"

namespace slender {

template <int HalfBandwidth, int Block>
struct BandPanel;
struct BandCarry;

/// Entry points of one instruction set's factorisation (src/linalg/banded_ldlt_kernel.cpp is compiled once for each).
struct BandKernels
{
  /// Both panel pointers are those of block `from`.
  void (*eliminate)(BandPanel<10, 4>* panels, BandPanel<10, 4>* factors, int from, int to, double* x, BandCarry& carry);
  void (*substitute)(const BandPanel<10, 4>* panels, int blocks, double* x);
  void (*solve)(const BandPanel<10, 4>* panels, int blocks, double* x);
  void (*solve8)(const BandPanel<10, 4>* panels, int blocks, double* x);
};

SLENDER_DECLARE_KERNELS(BandKernels, kBandKernels)

}   // namespace slender
