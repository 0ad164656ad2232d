#pragma once

#include <memory>
#include <vector>

namespace slender {

/// LU factorisation of sparse matrices, symmetric or not, whose pattern stays while their values change (KLU of SuiteSparse).
class SparseLu
{
public:
  SparseLu();
  ~SparseLu();
  SparseLu(SparseLu&&) noexcept;

  /// By columns: rows of column j are rows[starts[j]] .. rows[starts[j + 1] - 1], ascending. values() are zero afterwards.
  void setPattern(int size, std::vector<int> starts, std::vector<int> rows);

  int size() const;
  /// One per entry of the pattern.
  std::vector<double>& values();
  /// Index of an entry in values(). It must be in the pattern.
  int index(int row, int column) const;

  /// False when the matrix is singular or not finite. Pivots are chosen at the first call and kept while they serve.
  bool factor();
  /// x := A^-1 x after a factor() that returned true.
  void solve(double* x) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slender
