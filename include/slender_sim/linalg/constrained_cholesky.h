#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "slender_sim/linalg/point_matrix.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// Constraints C z = g on the three coordinates of points alike, beside a matrix P = L L^T that its caller has
/// factored: V = L^-1 C^T and the Schur complement S = V^T V. One solve costs one forward and one backward
/// substitution, two products with V, which is sparse because constraints are local, and products with S, which is
/// dense. It suits few constraints whose forces have bounds, or which are soft.
class ConstrainedCholesky
{
public:
  using Constraints = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// Constraints x points. Takes the memory of all solves.
  void setConstraints(const Constraints& c);
  /// After P was factored with these fixed points (null: none), whose columns of C count as zero. False: constraints
  /// depend on each other.
  bool factor(const SparseCholesky& p, const char* fixed);

  int count() const { return static_cast<int>(c_.rows()); }
  struct Norms   ///< of solveBounded(), in the norm of P
  {
    double load = 0.0, step = 0.0;   ///< of the load and of the motion
    bool converged = true;
    int sweeps = 0;   ///< over all constraints
  };
  /// z that minimises 1/2 l z . P z - r . z + sum_i bounds_i |gap_i - C_i z| (gap: 4 doubles per constraint): l P z = r
  /// + C^T f, where f_i is within its bound and C_i z = gap_i, or f_i is at it and points along gap_i - C_i z. By block
  /// Gauss-Seidel from the f given (4 doubles per constraint) until no f_i changes by more than `tolerance` of itself,
  /// or of its bound. load: sqrt(r . P^-1 r + f . S f), step: that of r + C^T f.
  Norms solveBounded(const double* r, const double* gap, const double* bounds, double l, double tolerance, double* z,
                     double* f);
  /// Makes solveSoftened() that of P + C^T diag(weights) C, weights positive.
  void soften(const Eigen::VectorXd& weights);
  void solveSoftened(const double* r, double* z) const;
  /// Returns the stiffness of one constraint while all others are met: an entry of the diagonal of S^-1.
  double stiffness(int i) const { return stiffness_[i]; }
  /// r += C^T f, but for fixed points.
  void addForces(const double* f, double* r) const;

private:
  struct Rows   ///< of a matrix for PointKernels::multiply
  {
    std::vector<int> starts{0};
    AlignedVector<unsigned> offsets;
    AlignedVector<double> values;
    double multiply(double factor, const double* x, double* y) const;
  };
  static void fill(const Constraints& from, Rows& to);

  Constraints c_;
  const SparseCholesky* p_ = nullptr;
  Rows v_, v_transposed_, c_transposed_;
  Eigen::MatrixXd s_, soft_;   ///< S; factor of S + diag(1 / weights)
  Eigen::VectorXd stiffness_;
  mutable Eigen::Matrix<double, Eigen::Dynamic, 3> give_;
  PointVector pull_;
  mutable PointVector y_, t_, mu_;   ///< of points each: the kernels read as many points of x as there are rows
};

}   // namespace slender
