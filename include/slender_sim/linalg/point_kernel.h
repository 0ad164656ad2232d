#pragma once

#include "slender_sim/linalg/isa.h"

/// Products of the sparse matrices of points. Points have 4 doubles, the last of them unused; vectors are aligned to 64
/// bytes.
namespace slender {

/// L of a supernodal Cholesky factorisation as CHOLMOD keeps it: supernode s has the columns first[s] .. first[s + 1] -
/// 1 and the rows rows[row_starts[s]] .. rows[row_starts[s + 1] - 1], those of its own columns first; values by columns
/// from value_starts[s] on.
struct SupernodalFactor
{
  int supernodes = 0;
  const int *first = nullptr, *row_starts = nullptr, *value_starts = nullptr, *rows = nullptr;
  const double* values = nullptr;
};

/// A symmetric matrix D + L + L^T of points: blocks as for multiplyBlocks, and those of a matrix that acts on each
/// coordinate alike, if any (full rows; what is right of the diagonal counts, from `right` on), times `factor`.
struct SweptMatrix
{
  int points = 0;
  const int *starts = nullptr, *rows = nullptr;
  const double* blocks = nullptr;
  const int *right = nullptr, *ends = nullptr;   ///< null: no such matrix
  const unsigned* offsets = nullptr;             ///< four times the columns
  const double* values = nullptr;
  double factor = 0;
  /// in which points are visited downwards: each after its neighbours of lower number
  const int* order = nullptr;
  const double* inverse = nullptr;   ///< D^-1: per point three columns of four; zero keeps a point zero
};

struct PointKernels
{
  /// y = A x (factor 0) or y += factor A x, full rows; offsets are four times the columns. Returns x . A x.
  double (*multiply)(int rows, const int* starts, const unsigned* offsets, const double* values, double factor,
                     const double* x, double* y);
  /// y += A x for a symmetric matrix of 3 x 3 blocks: lower triangle by columns, the diagonal block first, blocks by
  /// columns.
  void (*multiplyBlocks)(int columns, const int* starts, const int* rows, const double* values, const double* x,
                         double* y);
  /// x := L^-1 x, and x := L^-T x, for each coordinate.
  void (*forwardSupernodal)(const SupernodalFactor& factor, double* x);
  void (*backwardSupernodal)(const SupernodalFactor& factor, double* x);
  /// x := (D + L)^-1 x; x := (D + L^T)^-1 b.
  void (*sweepDown)(const SweptMatrix& matrix, double* x);
  void (*sweepUp)(const SweptMatrix& matrix, const double* b, double* x);
  /// y = D x: per point three columns of four. Returns x . y.
  double (*multiplyDiagonal)(int points, const double* diagonal, const double* x, double* y);
  /// Sum of x . y over points; the unused parts do not count.
  double (*dot)(int points, const double* x, const double* y);
};

SLENDER_DECLARE_KERNELS(PointKernels, kPointKernels)

/// The table for this machine.
const PointKernels& pointKernels();

}   // namespace slender
