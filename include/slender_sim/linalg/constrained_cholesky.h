#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "slender_sim/linalg/point_matrix.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender {

/// Solves [P C^T; C 0] [z; mu] = [r; g] for the three coordinates of points alike, given P = L L^T: with V = L^-1 C^T
/// and S = V^T V, one solve costs one forward and one backward substitution, two products with V (sparse: constraints
/// are local) and one with S^-1, which is dense.
///
/// Many constraints that reach few points each are met by rounds of the method of multipliers instead: P + C^T W C is
/// factored, with W so stiff that a round leaves about a hundred-thousandth of the gap and of the error of mu. S, whose
/// factor takes the cube of their number, is then never formed.
class ConstrainedCholesky
{
public:
  using Constraints = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// Constraints x points. Takes the memory of solve(), with `bounded` that of solveBounded(), leaveOut(), soften() and
  /// stiffness().
  void setConstraints(const Constraints& c, bool bounded = false);
  /// After P (`values` in the pattern of a matrix) was factored with these fixed points (null: none), whose columns of
  /// C count as zero. False: constraints depend on each other.
  bool factor(const PointMatrix& pattern, const double* values, const SparseCholesky& p, const char* fixed);
  /// In rounds, after factor().
  bool inRounds() const { return in_rounds_; }

  /// Leaves constraints `rows` (ascending) out of all solves: their mu are rounding errors. None, and factor(): all
  /// count. With `bounded` only.
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
  /// doubles per constraint. Fixed points: r must be zero there, and z is. In rounds without g there are fewer of them,
  /// for preconditioners: a 1e-8 of z, and of mu, may be missing.
  void solve(const double* r, const double* g, double* z, double* mu, Norms* norms = nullptr) const;
  /// z that minimises 1/2 l z . P z - r . z + sum_i bounds_i |gap_i - C_i z| (gap: 4 doubles per constraint): l P z = r
  /// + C^T f, where f_i is within its bound and C_i z = gap_i, or f_i is at it and points along gap_i - C_i z. By block
  /// Gauss-Seidel from the f given (4 doubles per constraint) until no f_i changes by more than `tolerance` of itself,
  /// or of its bound. load: sqrt(r . P^-1 r + f . S f), step: that of r + C^T f.
  Norms solveBounded(const double* r, const double* gap, const double* bounds, double l, double tolerance, double* z,
                     double* f);
  /// Makes solveSoftened() that of P + C^T diag(weights) C, weights positive. With `bounded` only.
  void soften(const Eigen::VectorXd& weights);
  void solveSoftened(const double* r, double* z) const;
  /// Of one constraint when all others are met: entry of the diagonal of S^-1. With `bounded` only.
  double stiffness(int i) const { return s_inverse_.values[static_cast<std::size_t>(i) * (count() + 1)]; }
  /// r += C^T f, but for fixed points.
  void addForces(const double* f, double* r) const;
  /// sqrt(g . S^-1 g), in the norm of P: of the smallest z that has C z = g.
  double norm(const double* g) const;
  /// y += factor C^T S^-1 C x, but for fixed points, where x must be zero: `factor` times as stiff along the
  /// constraints as P is. Not in rounds, which take hundreds of constraints.
  void addStiffness(double factor, const double* x, double* y) const;
  /// mu alone, g zero: half the work.
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
  bool factorRounds(const PointMatrix& pattern, const double* values, const char* fixed);
  void inverse(const double* t, double* mu) const;
  void solveInRounds(const double* r, const double* g, int rounds, double* z, double* mu) const;

  Constraints c_;
  const SparseCholesky* p_ = nullptr;
  Rows v_, v_transposed_, s_inverse_, c_rows_, c_transposed_;
  std::vector<int> left_out_;
  Eigen::MatrixXd s_, inner_,
      soft_;   ///< S, with bounds; factor of the part of S^-1 that is left out; of S + diag(1 / weights)
  mutable Eigen::Matrix<double, Eigen::Dynamic, 3> give_;
  PointVector pull_;
  mutable PointVector y_, t_, mu_;   ///< of points each: the kernels read as many points of x as there are rows

  bool many_ = false, in_rounds_ = false;
  SparseCholesky stiff_;              ///< of P + C^T W C
  std::vector<char> pattern_fixed_;   ///< points for which its pattern was analysed, and a 1; empty: not yet
  std::vector<double> weights_;       ///< W
  Rows p_rows_;
  mutable PointVector load_, right_;
};

}   // namespace slender
