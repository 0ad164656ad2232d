#pragma once

#include <memory>

#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/constrained_cholesky.h"

namespace slender {

/// Conjugate gradients for (A + factor B) x = b with blocks A and a matrix B that acts on each coordinate alike,
/// preconditioned by symmetric Gauss-Seidel sweeps, (D + L) D^-1 (D + L^T). An iteration is one sweep down and one up,
/// without a product [Eisenstat, SIAM J. Sci. Stat. Comput. 2 (1981), 1].
///
/// Sweeps find local motions fast. The motions of groups of about fifty points as a whole are left to a direct
/// solution (Deflation), so that iterations grow little with the number of points. Iterations are in single precision;
/// residuals and the sum of the corrections are in double precision (iterative refinement). Where that does not
/// converge, iterations are in double precision, too.
class SymmetricSweeps
{
public:
  SymmetricSweeps();
  /// `b`: null for none. Both must outlive this, and keep their patterns.
  SymmetricSweeps(const BlockMatrix& a, const PointMatrix* b);
  ~SymmetricSweeps();
  SymmetricSweeps(SymmetricSweeps&&) noexcept;
  SymmetricSweeps& operator=(SymmetricSweeps&&) noexcept;

  /// Another pattern, with what can be kept of the analysis of the last one.
  void setPattern(const BlockMatrix& a, const PointMatrix* b);
  /// The values of A as they are now; right-hand sides and solutions are zero at held points, which must stay where
  /// they are. `apart`: 1 for points that do not take part in common motions, because their unknowns are not
  /// coordinates; null: all points take part.
  void set(double factor, const std::vector<char>& held, const std::vector<char>* apart = nullptr);
  /// Of right-hand sides and residuals.
  double norm(const PointVector& r);
  /// As ConjugateGradients::solve. No force on a group as a whole is left, so that all points together fall as they
  /// should and keep their momentum.
  LinearResult solve(const PointVector& right_hand_side, PointVector& x, double tolerance, int max_iterations);
  /// The same for the matrix with constraints `stiffness` times as stiff as their own matrix added
  /// (ConstrainedCholesky::addStiffness), at the price of products with these, where they hold the free points together
  /// in their place. Stops when the residual is the tolerance times `reference`, and `least` times that of the
  /// right-hand side.
  LinearResult solve(const ConstrainedCholesky& constraints, double stiffness, const PointVector& right_hand_side,
                     PointVector& x, double tolerance, int max_iterations, double reference, double least);

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
