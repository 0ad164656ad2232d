#pragma once

#include <memory>
#include <vector>

#include "slender_sim/linalg/block_matrix.h"

namespace slender {

/// Cholesky factorisation of sparse symmetric matrices whose pattern stays while their values change (CHOLMOD).
///
/// The last unknowns may be the multipliers of linear constraints C x = g on the others. Then the matrix is
/// [K C^T; C 0], and it is factored as L D L^T with entries 1 and -1 in D. Each multiplier is eliminated right after
/// the unknowns of its constraint, so that the factor is hardly larger than that of K where constraints are local. It
/// exists if K is positive definite and constraints do not depend on each other.
class SparseCholesky
{
public:
  /// `simplicial`: column by column, without BLAS; better for matrices that are nearly banded, whose dense blocks are
  /// too small for BLAS (and its threads).
  explicit SparseCholesky(bool simplicial = false);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// Lower triangle by columns: rows of column j are rows[starts[j]] .. rows[starts[j + 1] - 1], ascending, the
  /// diagonal among them. Analyses the pattern (fill-reducing order); values() are zero afterwards. The last
  /// `multipliers` unknowns are multipliers; the pattern has their diagonal entries. A `simplicial` factorisation takes
  /// no multipliers.
  void setPattern(int size, std::vector<int> starts, std::vector<int> rows, int multipliers = 0);

  /// Likewise for the matrices of points: 3 x 3 blocks, or one number for all three coordinates. The order is found by
  /// nested dissection of the graph of points (METIS), with the unknowns of a point next to each other and supernodes
  /// wider than CHOLMOD's; factoring and solving take no memory. values() is then not to be used.
  void setPattern(const BlockMatrix& matrix);
  void setPattern(const PointMatrix& matrix);
  /// As factor(), of a matrix with that pattern. Points with fixed[i] != 0 keep their place: their rows and columns are
  /// those of the identity.
  bool factor(const BlockMatrix& matrix, const char* fixed);
  bool factor(const PointMatrix& matrix, const char* fixed);
  /// Likewise with other values in the matrix's pattern, one per entry; those above the diagonal are not read.
  bool factor(const PointMatrix& matrix, const double* values, const char* fixed);
  /// x = A^-1 b for points (4 doubles each; x may be b). Fixed points: x = b.
  void solvePoints(const double* b, double* x) const;
  /// The two halves of solvePoints of a PointMatrix: y = L^-1 b, with y in the order of elimination
  /// and not b, and x = L^-T y, which overwrites y.
  void forwardPoints(const double* b, double* y) const;
  void backwardPoints(double* y, double* x) const;

  int size() const;
  /// One per entry of the pattern.
  double* values();

  /// False when the matrix is not positive definite (or not finite). With multipliers: true only if K is positive
  /// definite for all x with C x = 0, false only if K is not positive definite or constraints depend on each other.
  /// Rounding may hide that they do: see pivot().
  bool factor();
  /// x := A^-1 x after a factor() that returned true.
  void solve(double* x) const;
  /// Returns the size of an unknown's pivot in L D L^T. Factorisations that are `simplicial` or of blocks have none.
  double pivot(int unknown) const;

private:
  void setPointPattern(const BlockMatrix& pattern, int unknowns);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
