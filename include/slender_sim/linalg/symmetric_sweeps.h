#pragma once

#include <Eigen/Cholesky>

#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/constrained_cholesky.h"
#include "slender_sim/linalg/point_kernel.h"

namespace slender {

/// Conjugate gradients for (A + factor B) x = b with blocks A and a matrix B that acts on each coordinate alike,
/// preconditioned by symmetric Gauss-Seidel sweeps, (D + L) D^-1 (D + L^T). An iteration is one sweep down and one up,
/// without a product [Eisenstat, SIAM J. Sci. Stat. Comput. 2 (1981), 1]. Nothing is factored: the best there is for
/// few points; iterations grow as their number's square root.
class SymmetricSweeps
{
public:
  SymmetricSweeps() = default;
  /// `b`: null for none. Both must outlive this, and keep their patterns.
  SymmetricSweeps(const BlockMatrix& a, const PointMatrix* b);

  /// The values of A as they are now; right-hand sides and solutions are zero at held points, which must stay where
  /// they are. `apart`: 1 for points that do not take part in the common motion, because their unknowns are not
  /// coordinates; null: all points take part.
  void set(double factor, const std::vector<char>& held, const std::vector<char>* apart = nullptr);
  /// Of right-hand sides and residuals.
  double norm(const PointVector& r);
  /// As ConjugateGradients::solve. The motion of all free points together, the slowest to converge, is solved before
  /// and after, so that they fall as they should and keep their momentum.
  LinearResult solve(const PointVector& right_hand_side, PointVector& x, double tolerance, int max_iterations);
  /// The same for the matrix with constraints `stiffness` times as stiff as their own matrix added
  /// (ConstrainedCholesky::addStiffness), at the price of products with these, where they hold the free points together
  /// in their place. Stops when the residual is the tolerance times `reference`, and `least` times that of the
  /// right-hand side.
  LinearResult solve(const ConstrainedCholesky& constraints, double stiffness, const PointVector& right_hand_side,
                     PointVector& x, double tolerance, int max_iterations, double reference, double least);

private:
  void setWhole();
  bool moves(int point) const { return !(*held_)[point] && !(apart_ && (*apart_)[point]); }
  /// r_: the residual.
  void leave(const PointVector& right_hand_side, const PointVector& x);
  /// Moves all free points alike, so that none of these forces on them together is left.
  void translate(const PointVector& forces, PointVector& x) const;
  /// r_ := (D + L)^-1 r_, z_ := D r_; returns r_ . z_, the square of the norm.
  double sweepResidual();
  /// x = 0 and its residual, swept; returns the square of the norm, zero and below: there is nothing to solve, or not
  /// definite.
  double begin(const PointVector& right_hand_side, PointVector& x, LinearResult& result);
  /// Onwards from x with the residual that sweepResidual() swept, in units of `scale`.
  void iterate(const ConstrainedCholesky* constraints, double stiffness, double square, double scale, PointVector& x,
               double tolerance, int max_iterations, LinearResult& result);

  const BlockMatrix* a_ = nullptr;
  /// per row of B: its diagonal entry (-1: none), the first one right of it, the end
  std::vector<int> b_diagonal_, b_right_, b_ends_;
  const PointMatrix* b_ = nullptr;
  double factor_ = 0;
  const std::vector<char>* held_ = nullptr;
  const std::vector<char>* apart_ = nullptr;
  /// SweptMatrix::order, so that points visited in turn seldom wait for each other
  std::vector<int> order_;
  SweptMatrix swept_;
  /// the matrix among common motions of what is free
  Eigen::LLT<Eigen::Matrix3d> whole_{Eigen::Matrix3d::Identity()};
  PointVector diagonal_, inverse_;   ///< per point three columns of four
  PointVector r_, z_, p_, t_, q_;
};

}   // namespace slender
