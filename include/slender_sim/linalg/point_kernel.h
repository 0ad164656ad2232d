#pragma once

#include <type_traits>

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

/// A symmetric matrix D + L + L^T of blocks of 3 x 3, whose points are numbered in the order in which sweeps visit
/// them. L by columns: those of point j are starts[j] .. starts[j + 1] - 1, and all their rows are larger than j.
/// Blocks are stored by columns, nine numbers each; D and its inverse as three columns of four numbers. A point whose
/// blocks of D and of the inverse are zero is held.
template <class Scalar>
struct SweptMatrix
{
  int points = 0;
  const int *starts = nullptr, *rows = nullptr;
  const Scalar *blocks = nullptr, *diagonal = nullptr, *inverse = nullptr;
};

/// A matrix B of blocks of 3 x 3 between points and groups of points, and a vector c of groups. The blocks of point i
/// are starts[i] .. starts[i + 1] - 1. Without `starts` there are no groups.
template <class Scalar>
struct GroupBlocks
{
  const int *starts = nullptr, *groups = nullptr;
  const Scalar *blocks = nullptr, *transposed = nullptr;   ///< of B, and each of them transposed
  Scalar* motion = nullptr;                                ///< c, four numbers per group
};

/// A sparse matrix of numbers that act on the three coordinates of points alike, by rows.
template <class Scalar>
struct PointRows
{
  int rows = 0;
  const int *starts = nullptr, *columns = nullptr;
  const Scalar* values = nullptr;
};

/// What an iteration of conjugate gradients with symmetric sweeps consists of. Vectors have four numbers per point, the
/// last of them unused.
template <class Scalar>
struct SweepKernels
{
  /// t = (D + L^T)^-1 p, q = L^T t, c += B^T t.
  void (*up)(const SweptMatrix<Scalar>& matrix, const GroupBlocks<Scalar>& groups, const Scalar* p, Scalar* t,
             Scalar* q);
  /// q := t + (D + L)^-1 (q - B c). Returns p . q.
  double (*down)(const SweptMatrix<Scalar>& matrix, const GroupBlocks<Scalar>& groups, const Scalar* p, const Scalar* t,
                 Scalar* q);
  /// x += alpha t, r -= alpha q, z = D r. Returns r . z.
  double (*advance)(const SweptMatrix<Scalar>& matrix, double alpha, const Scalar* t, const Scalar* q, Scalar* x,
                    Scalar* r, Scalar* z);
  /// p := z + beta p.
  void (*turn)(int points, double beta, const Scalar* z, Scalar* p);
  /// z := ((D + L) D^-1 (D + L^T))^-1 z.
  void (*precondition)(const SweptMatrix<Scalar>& matrix, Scalar* z);
  /// y += (D + L + L^T) x. Returns x . y.
  double (*multiply)(const SweptMatrix<Scalar>& matrix, const Scalar* x, Scalar* y);
  /// y += factor C x.
  void (*addRows)(const PointRows<Scalar>& c, double factor, const Scalar* x, Scalar* y);
  /// x += alpha p, r -= alpha q, z = r.
  void (*move)(int points, double alpha, const Scalar* p, const Scalar* q, Scalar* x, Scalar* r, Scalar* z);
  double (*dot)(int points, const Scalar* x, const Scalar* y);
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
  /// Sum of x . y over points; the unused parts do not count.
  double (*dot)(int points, const double* x, const double* y);
  SweepKernels<float> single_sweeps;
  SweepKernels<double> double_sweeps;

  template <class Scalar>
  const SweepKernels<Scalar>& sweeps() const
  {
    if constexpr (std::is_same_v<Scalar, float>)
      return single_sweeps;
    else
      return double_sweeps;
  }
};

SLENDER_DECLARE_KERNELS(PointKernels, kPointKernels)

/// The table for this machine.
const PointKernels& pointKernels();

}   // namespace slender
