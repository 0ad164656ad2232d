#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "slender_sim/linalg/point_matrix.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// Solves [P C^T; C 0] [z; mu] = [r; g] for the three coordinates of points alike, in one of two ways.
///
/// Schur::none: the whole matrix is factored, see SparseCholesky. Time and memory then grow with the number of points
/// and constraints hardly faster than those of a factor of P.
///
/// Otherwise the class takes the factor L of P = L L^T, which its caller has, and computes V = L^-1 C^T and the Schur
/// complement S = V^T V. One solve costs one forward and one backward substitution, two products with V, which is
/// sparse because constraints are local, and one product with S^-1, which is dense. This way suits few constraints.
/// Bounds of the constraints' forces, and stiffness along the constraints, need S or its inverse.
class ConstrainedCholesky
{
public:
  using Constraints = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// What to compute besides what solve() needs.
  enum class Schur
  {
    none,
    inverse,   ///< the dense S^-1, for addStiffness()
    bounded    ///< S as well, for solveBounded(), leaveOut(), soften() and stiffness()
  };
  /// Constraints x points. Takes the memory of solve() and of what `schur` says.
  void setConstraints(const Constraints& c, Schur schur = Schur::none);
  /// After P (`values` in the pattern of a matrix) was factored with these fixed points (null: none), whose columns of
  /// C count as zero. False: constraints depend on each other.
  bool factor(const PointMatrix& pattern, const double* values, const SparseCholesky& p, const char* fixed);

  /// Leaves the constraints `rows` (ascending) out of all solves, in which their mu are then rounding errors. After
  /// factor(), and with an empty list, no constraint is left out. For Schur::bounded only.
  void leaveOut(const std::vector<int>& rows);

  int count() const { return static_cast<int>(c_.rows()); }
  struct Norms   ///< of a solve with g, in the norm of P
  {
    /// sqrt(r . P^-1 r + g . S^-1 g): of r without constraints, and of the smallest z that has C z = g
    double load = 0.0;
    double step = 0.0;       ///< sqrt(z . P z)
    bool converged = true;   ///< solveBounded(), and
    int sweeps = 0;          ///< over all constraints
  };
  /// z = P^-1 (r - C^T mu) with C z = g; g (4 doubles per constraint) null: zero, and no `norms`. r may be z. mu: 4
  /// doubles per constraint. Fixed points: r must be zero there, and z is.
  void solve(const double* r, const double* g, double* z, double* mu, Norms* norms = nullptr) const;
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
  double stiffness(int i) const { return s_inverse_.values[static_cast<std::size_t>(i) * (count() + 1)]; }
  /// r += C^T f, but for fixed points.
  void addForces(const double* f, double* r) const;
  /// sqrt(g . S^-1 g), in the norm of P: of the smallest z that has C z = g.
  double norm(const double* g) const;
  /// y += factor C^T S^-1 C x, but for fixed points, where x must be zero: `factor` times as stiff along the
  /// constraints as P is.
  void addStiffness(double factor, const double* x, double* y) const;
  /// Computes the mu of solve() with g = 0.
  void multipliers(const double* r, double* mu) const;
  /// r -= C^T mu, but for fixed points.
  void takeOut(const double* mu, double* r) const;

private:
  struct Rows   ///< of a matrix for PointKernels::multiply
  {
    std::vector<int> starts{0};
    AlignedVector<unsigned> offsets;
    AlignedVector<double> values;
    double multiply(double factor, const double* x, double* y) const;
  };
  static void fill(const Constraints& from, Rows& to);

  bool factorSchur(const SparseCholesky& p, const char* fixed);
  bool factorWhole(const PointMatrix& pattern, const double* values, const char* fixed);
  void inverse(const double* t, double* mu) const;
  void solveWhole(const double* r, const double* g) const;

  Schur schur_ = Schur::none;
  Constraints c_;
  const SparseCholesky* p_ = nullptr;
  Rows v_, v_transposed_, s_inverse_, c_rows_, c_transposed_;
  std::vector<int> left_out_;
  Eigen::MatrixXd s_, inner_,
      soft_;   ///< S, with bounds; factor of the part of S^-1 that is left out; of S + diag(1 / weights)
  mutable Eigen::Matrix<double, Eigen::Dynamic, 3> give_;
  PointVector pull_;
  mutable PointVector y_, t_, mu_;   ///< of points each: the kernels read as many points of x as there are rows

  PointMatrix matrix_;   ///< [P C^T; C 0]
  SparseCholesky whole_;
  mutable PointVector whole_right_, image_;
};

}   // namespace slender
