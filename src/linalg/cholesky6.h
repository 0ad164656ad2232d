#pragma once

#include <Eigen/Core>

namespace slender {

/// Cholesky factor of the 6 x 6 matrix of a rigid body. The loops are compiled only once. Each use of Eigen's own
/// factor of this size costs a second of compile time.
class Cholesky6
{
public:
  using Matrix = Eigen::Matrix<double, 6, 6>;
  using Vector = Eigen::Matrix<double, 6, 1>;

  /// Factors a symmetric matrix; only its lower triangle is read. Returns false if it is not positive definite.
  bool compute(const Matrix& a);
  /// Replaces v by A^-1 v. Not valid after a failed compute().
  void solveInPlace(Vector& v) const;

private:
  Matrix l_ = Matrix::Identity();
};

}   // namespace slender
