#pragma once

#include <memory>
#include <vector>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/energy/hinge.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/constrained_cholesky.h"
#include "slender_sim/linalg/sparse_cholesky.h"
#include "wind_load.h"

namespace slender {

/// What the energy of a step is made of at a configuration.
struct ClothEvaluation
{
  double membrane = 0, bending = 0, potential = 0;   ///< [J]; viscous response is part of the first two, inertia and loads of the last
  double max_strain = 0;                             ///< largest |principal stretch - 1|
  double energy() const { return membrane + bending + potential; }
  double magnitude() const;
};

/// Energy of one implicit step of a cloth, with gradient and Hessian, and the solution of its Newton equations:
///   E(x) + sum 1/2 w |x - target|^2 + 1/2 (x - y)^T D (x - y) - f . x,
/// w from mass and mass damping, D and y from the wind; stiffness damping makes E viscous (see HingeBending::setResponse).
class ClothSystem
{
public:
  ClothSystem(const ClothModel& model, const ClothOptions& options);

  int points() const { return model_.vertices(); }
  ClothSolver solver() const { return solver_; }

  /// A step of length h from (x, v), and what is held.
  void beginStep(const ClothState& state, const ClothInputs& inputs, double h);
  /// Elastic response and loads only, for explicit steps and energies.
  void setHinges(const ClothState& state);
  /// Strains at x as those that viscous response of the given ratio starts from; 0: none.
  void setViscosity(double ratio, const PointVector& x);

  ClothEvaluation energy(const PointVector& x);
  /// Overwrites gradient().
  ClothEvaluation evaluate(const PointVector& x);
  /// The same with the matrix of solve().
  ClothEvaluation evaluateHessian(const PointVector& x, HessianKind kind);
  /// Adds a multiple of the weights of inertia to the matrix.
  void shiftMatrix(double factor);
  /// Elastic and viscous parts only, added.
  ClothEvaluation addInternal(const PointVector& x, PointVector& gradient);
  PointVector& gradient() { return gradient_; }
  /// Solves H d = -gradient; `d` holds what held points move by, and for conjugate gradients the first guess of the others. False: not positive definite. `linear` grows by iterations.
  /// `least` : conjugate gradients do not go below this tolerance, whatever the options.
  bool solve(PointVector& d, int& linear_iterations, int& factorizations, double least = 0.0);

  /// The matrix of solve() times p.
  void applyMatrix(const PointVector& p, PointVector& ap);

  /// Moves what is free, by as little as the preconditioner's norm allows, so that the averages are the given ones (3 x count).
  void meetAverages(const Eigen::Matrix3Xd& averages, PointVector& x);
  /// Takes the part out of the gradient that the averages balance: their forces (3 x count).
  void balanceAverages(Eigen::Matrix3Xd& forces);
  /// What they are at x.
  void averagesOf(const PointVector& x, Eigen::Matrix3Xd& averages) const;

  const PointVector& start() const { return start_; }
  const PointVector& target() const { return target_; }
  const std::vector<char>& held() const { return held_; }
  const WindLoad& wind() const { return wind_; }

private:
  void setWeights(double h, double ratio);
  double addIsometric(const PointVector& x, PointVector& gradient);
  void clearHeld(PointVector& v) const;
  void precondition(PointVector& r, PointVector& z);
  /// r -= C^T multipliers
  void takeOutMultipliers(PointVector& r);
  ClothEvaluation addLoads(const PointVector& x, bool with_gradient);

  const ClothModel& model_;
  ClothSolver solver_;
  const double linear_tolerance_;
  MembraneEnergy membrane_;
  WindLoad wind_;
  std::unique_ptr<HingeBending> hinges_;      ///< hinge bending only
  Eigen::VectorXd hinge_stiffness_;           ///< without stiffening; with plasticity only
  PointMatrix bending_, stand_in_;            ///< isometric model, or for hinges what preconditions; rest membrane
  bool constant_bending_ = false;             ///< bending_ is the model, not a stand-in
  bool bending_in_blocks_ = false;

  BlockMatrix matrix_;
  std::vector<int> membrane_slots_, hinge_slots_, bending_map_;
  std::vector<double> base_;                  ///< constant part of matrix_
  double base_h_ = 0, base_ratio_ = -1;
  std::vector<char> base_held_;
  SparseCholesky factor_;                     ///< of matrix_, or of the preconditioner
  ConjugateGradients cg_;
  std::unique_ptr<ConstrainedCholesky> averages_;   ///< of the preconditioner, where averages are prescribed
  bool independent_ = true;                         ///< these, with what is held
  PointVector gap_, multipliers_;                   ///< one point per average
  Eigen::Matrix3Xd averages_now_;

  double h_ = 0, ratio_ = 0;
  PointVector start_, viscous_start_, target_, force_, gradient_, product_, right_, correction_, weight_;
  std::vector<char> held_;
  AlignedVector<double> strains_[3], angles_;
};

}  // namespace slender
