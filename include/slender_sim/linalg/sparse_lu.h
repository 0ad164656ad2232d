#pragma once

#include <memory>
#include <vector>

namespace slender {

/// LU factorisation of sparse matrices, symmetric or not, whose pattern stays while their values change (KLU of
/// SuiteSparse). Pivots lie on the diagonal in an order that follows from the pattern alone, so what was factored
/// before leaves no trace in a result. That suits matrices like [M, B; C, 0] with a nearly symmetric and positive M,
/// full-ranked C and B near -C^T.
class SparseLu
{
public:
  SparseLu();
  ~SparseLu();
  SparseLu(SparseLu&&) noexcept;

  /// By columns: rows of column j are rows[starts[j]] .. rows[starts[j + 1] - 1], ascending; the diagonal must be
  /// among them. The first `leading` unknowns (M above) are eliminated first. values() are zero afterwards.
  void setPattern(int size, std::vector<int> starts, std::vector<int> rows, int leading);

  int size() const;
  /// One per entry of the pattern.
  std::vector<double>& values();
  /// Index of an entry in values(). It must be in the pattern.
  int index(int row, int column) const;

  /// False when a pivot is zero or not finite.
  bool factor();
  /// x := A^-1 x after a factor() that returned true.
  void solve(double* x) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
