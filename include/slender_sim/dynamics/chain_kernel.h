#pragma once

#include "slender_sim/linalg/isa.h"

/// Structure-of-arrays view of the constraints c_j = (|e_j|^2 - L_j^2) / (2 L_j) = 0 of one chain, for the hot loops of
/// FastProjection. Edge j runs from node j to j+1. Every array is readable from index -kHalo to nodes + kHalo; of a
/// closed chain the halo repeats it.
namespace slender {

struct ChainArrays
{
  static constexpr int kHalo = 8;

  int nodes = 0, edges = 0;
  bool closed = false;
  double* x[3];   ///< nodes [m]
  /// edges at the start of the step over their rest lengths; zero beyond the ends of an open chain
  double* direction[3];
  double* s[3];           ///< present edges over their rest lengths; likewise
  double* inverse_mass;   ///< per node [1/kg], 0: held, or carried by a body
  double *rest_length, *inverse_rest;
  double* active;   ///< per edge 1, or 0: no end can move on its own
  /// tridiagonal system of the multipliers; upper[j] couples edge j to j+1, lower[j] to j-1
  double *c, *diagonal, *upper, *lower;
  double *pivot, *factor;   ///< of its elimination: inverse pivots and multipliers
  double *lambda, *total;   ///< [N s^2], last correction and sum
};

struct ChainKernels
{
  /// directions := edges / rest lengths.
  void (*takeDirections)(const ChainArrays& chain);
  /// s, c and the system at x. Returns the largest | |e|^2/L^2 - 1 | of the active edges; not a number if any is.
  double (*constraints)(const ChainArrays& chain);
  /// Eliminates the system without the corners that close a chain, from both ends towards the middle.
  void (*factor)(const ChainArrays& chain);
  /// Solves with it in place.
  void (*solve)(const ChainArrays& chain, double* b);
  /// x moves by lambda, total grows by it.
  void (*apply)(const ChainArrays& chain);
};

SLENDER_DECLARE_KERNELS(ChainKernels, kChainKernels)

/// The table for this machine.
const ChainKernels& chainKernels();

}   // namespace slender
