#pragma once

#include <algorithm>
#include <vector>

#include "cloth_system.h"
#include "slender_sim/linalg/sparse_cholesky.h"
#include "linalg/symmetric_sweeps.h"

namespace slender {

/// What became of linear equations.
enum class LinearOutcome
{
  solved,
  not_definite,   ///< the matrix is not positive definite, or prescribed averages depend on each other
  not_converged   ///< the most iterations that are taken did not reach the tolerance
};

/// Solves the Newton equations H d = -gradient of a ClothSystem, with what is held moving as given. Without prescribed
/// averages; AveragedClothSolver is for those.
class ClothLinearSolver
{
public:
  /// The system must outlive this. For ClothSolver::cholesky its blocks contain its constant matrix.
  ClothLinearSolver(const ClothOptions& options, ClothSystem& system);
  virtual ~ClothLinearSolver() = default;

  ClothSolver kind() const { return kind_; }
  /// What solves spend; must outlive this.
  void useBudget(WorkBudget& budget) { budget_ = &budget; }
  /// Comes after beginStage() of the system.
  virtual void beginStage() {}

  /// Factors the matrix (Cholesky only). Returns false where it is not positive definite on what is not held.
  bool factor();
  /// v := matrix^-1 v after a factor() that returned true. Held points of v must be zero and stay so.
  void solveFactored(PointVector& v) const { factor_.solvePoints(v.data(), v.data()); }
  /// `d` holds what held points move by, and for sweeps the first guess of the others. `tolerance`: theirs, 0: that of
  /// the options. The numbers grow by what was needed.
  virtual LinearOutcome solve(PointVector& d, long& linear_iterations, long& factorizations, double tolerance = 0.0);

protected:
  /// For a class that solves by sweeps of its own.
  ClothLinearSolver(ClothSystem& system, double tolerance);

  static constexpr int kMostLinearIterations = 2000;   ///< of conjugate gradients

  int points() const { return system_.points(); }
  void clearHeld(PointVector& v) const;
  /// right_: what d leaves of the equations, held points zero.
  void setRight(const PointVector& d);
  /// Adds correction_, the solution of conjugate gradients, to d. `load`: what is strained so much that little is left
  /// beside this load is solved to a share of it.
  LinearOutcome correct(PointVector& d, const LinearResult& result, double tolerance, double load,
                        long& linear_iterations);
  /// Of conjugate gradients: `most`, or what the budget has room for.
  int iterationsWithin(int most) const
  {
    return static_cast<int>(std::min<long>(most, budget_->left() / points() + 1));
  }
  /// In counts per point.
  void spend(int counts) { budget_->spend(static_cast<long>(counts) * points()); }

  ClothSystem& system_;
  const double linear_tolerance_;
  WorkBudget unbounded_;
  WorkBudget* budget_ = &unbounded_;
  PointVector right_, product_, correction_;

private:
  ClothSolver kind_ = ClothSolver::gauss_seidel;
  SparseCholesky factor_;   ///< of the system's matrix
  SymmetricSweeps sweeps_;
};

}   // namespace slender
