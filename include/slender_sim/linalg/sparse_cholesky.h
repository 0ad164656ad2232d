#pragma once

#include <memory>
#include <vector>

namespace slender {

/// Cholesky factorisation of sparse symmetric matrices whose pattern stays while their values change (CHOLMOD).
class SparseCholesky
{
public:
  /// `simplicial`: column by column, without BLAS; better for matrices that are nearly banded, whose dense blocks are too small for BLAS (and its
  /// threads).
  explicit SparseCholesky(bool simplicial = false);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;

  /// Lower triangle by columns: rows of column j are rows[starts[j]] .. rows[starts[j + 1] - 1], ascending, the diagonal among them.
  /// Analyses the pattern (fill-reducing order); values() are zero afterwards.
  void setPattern(int size, std::vector<int> starts, std::vector<int> rows);

  int size() const;
  /// One per entry of the pattern.
  double* values();
  const std::vector<int>& starts() const;
  const std::vector<int>& rows() const;
  /// Index of an entry of the lower triangle (row >= column) in values(). It must be in the pattern.
  int index(int row, int column) const;

  /// False when the matrix is not positive definite (or not finite).
  bool factor();
  /// x := A^-1 x after a factor() that returned true.
  void solve(double* x) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slender
