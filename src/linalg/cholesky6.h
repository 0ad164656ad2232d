#pragma once

#include <Eigen/Core>

namespace slender {

/// Cholesky factor of the 6 x 6 matrix of a rigid body. Its loops are compiled once: each use of Eigen's own factor for
/// this size costs a second of compiling.
class Cholesky6
{
public:
  using Matrix = Eigen::Matrix<double, 6, 6>;
  using Vector = Eigen::Matrix<double, 6, 1>;

  /// Factors a symmetric matrix, of which the lower triangle is read. False when it is not positive definite.
  bool compute(const Matrix& a);
  /// v becomes A^-1 v. After a failed compute() the result means nothing.
  void solveInPlace(Vector& v) const;

private:
  Matrix l_ = Matrix::Identity();
};

}   // namespace slender
