#pragma once

#include <vector>

#include "cloth_terms.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// diag(w) + c A with a constant A that acts on each coordinate alike, held points fixed; factored.
class ShiftedMatrix
{
public:
  ShiftedMatrix() = default;
  explicit ShiftedMatrix(const PointMatrix& a);

  /// `diagonal`: w [n]. False: not positive definite.
  bool factor(const std::vector<double>& diagonal, double c, const std::vector<char>& held);
  /// y += (diag(w) + c A) x, held points as all others.
  void addProduct(const double* x, double* y) const;
  void solve(const PointVector& b, PointVector& x) const { factor_.solvePoints(b.data(), x.data()); }
  const SparseCholesky& factorization() const { return factor_; }

private:
  PointMatrix a_;   ///< with a whole diagonal
  std::vector<int> diagonal_;
  AlignedVector<double> values_;
  std::vector<double> weight_;
  double c_ = 0;
  SparseCholesky factor_;
};

/// What stands in for the Hessian of stretching, and of bending where that is not small beside it, as if they acted on
/// each coordinate alike.
PointMatrix constantStiffness(const ClothModel& model, const std::vector<ClothTerm>& terms);

}   // namespace slender
