#pragma once

#include <Eigen/Cholesky>

#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/point_kernel.h"

namespace slender {

/// Conjugate gradients for (A + factor B) x = b with blocks A and a matrix B that acts on each coordinate alike, preconditioned by symmetric
/// Gauss-Seidel sweeps, (D + L) D^-1 (D + L^T). An iteration is one sweep down and one up, without a product [Eisenstat, SIAM J. Sci. Stat. Comput. 2 (1981), 1].
/// Nothing is factored: the best there is for few points; iterations grow as their number's square root. The motion of all free points together,
/// the slowest to converge, is solved before and after, so that they fall as they should and keep their momentum.
class SymmetricSweeps
{
public:
  SymmetricSweeps() = default;
  /// `b`: null for none. Both must outlive this, and keep their patterns.
  SymmetricSweeps(const BlockMatrix& a, const PointMatrix* b);

  /// As ConjugateGradients::solve, for the values of A as they are now; right-hand side and solution are zero at held points.
  LinearResult solve(double factor, const std::vector<char>& held, const PointVector& right_hand_side, PointVector& x, double tolerance, int max_iterations);

private:
  void setDiagonal(double factor, const std::vector<char>& held);
  void setWhole(double factor, const std::vector<char>& held);
  /// r_: the residual.
  void leave(double factor, const std::vector<char>& held, const PointVector& right_hand_side, const PointVector& x);
  /// Moves all free points alike, so that none of these forces on them together is left.
  void translate(const std::vector<char>& held, const PointVector& forces, PointVector& x) const;

  const BlockMatrix* a_ = nullptr;
  std::vector<int> b_diagonal_, b_right_, b_ends_;   ///< per row of B: its diagonal entry (-1: none), the first one right of it, the end
  const PointMatrix* b_ = nullptr;
  std::vector<int> order_;                            ///< SweptMatrix::order, so that points visited in turn seldom wait for each other
  SweptMatrix swept_;
  Eigen::LLT<Eigen::Matrix3d> whole_;                 ///< the matrix among common motions of what is free
  PointVector diagonal_, inverse_;                    ///< per point three columns of four
  PointVector r_, z_, p_, t_, q_;
};

}  // namespace slender
