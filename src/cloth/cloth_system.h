#pragma once

#include <memory>
#include <vector>

#include "cloth_terms.h"
#include "slender_sim/cloth/cloth_stepper.h"

namespace slender {

/// What the energy of a step is made of at a configuration.
struct ClothEvaluation
{
  /// [J]; viscous response is part of the first two, inertia and loads of the last
  double membrane = 0, bending = 0, potential = 0;
  double max_strain = 0;   ///< largest |principal stretch - 1|
  double energy() const { return membrane + bending + potential; }
  void count(TermAccount account, const TermSums& sums);
};

/// One implicit stage M (x - q_hat) / tau^2 = F(x, (x - q_tilde) / tau) of a step (see Stage).
struct ClothStage
{
  double tau = 0;   ///< [s]
  const PointVector *q_hat = nullptr, *q_tilde = nullptr;
  const PointVector* start = nullptr;           ///< where the stage starts: potentials count from there
  const PointVector* wind_at = nullptr;         ///< where the wind sees the cloth
  const Eigen::Matrix3Xd* velocity = nullptr;   ///< at which it does, as far as its force is not linear in the end's
};

/// Energy of one implicit stage of a cloth, with gradient and Hessian:
///   E(x) + sum 1/2 w |x - target|^2 + 1/2 (x - y)^T D (x - y) - f . x,
/// E from the terms (see clothTerms()), w from mass and mass damping, D and y from the loads (see clothLoads());
/// stiffness damping makes E viscous (see PointTerm). ClothLinearSolver solves the Newton equations.
class ClothSystem
{
public:
  /// `constant_in_blocks`: the blocks of matrix() have room for the term with a constant matrix, and contain it. That
  /// is for solvers that factor the blocks.
  ClothSystem(const ClothModel& model, bool constant_in_blocks);

  int points() const { return model_.vertices(); }
  /// What evaluations spend; must outlive this.
  void useBudget(WorkBudget& budget) { budget_ = &budget; }

  /// What is held, and the plastic variables.
  void hold(const ClothState& state);
  void usePlasticState(const ClothState& state);
  /// Strains as those that viscous response of the given ratio starts from: those at x or, where `move` and `other` are
  /// given, strains that are combined like the points x + move + share (other - x), to second order in `move`; either
  /// may be null. Ratio 0: no viscous response.
  void setViscosity(double ratio, const PointVector& x, const PointVector* move = nullptr, double share = 0.0,
                    const PointVector* other = nullptr);
  double viscosity() const { return ratio_; }
  /// After setViscosity(stiffness damping / tau, ...).
  void beginStage(const ClothStage& stage, const ClothInputs& inputs);
  const PointVector& start() const { return start_; }
  /// Until the next beginStage() potentials count from the origin.
  void countFromOrigin() { std::fill(start_.begin(), start_.end(), 0.0); }
  const std::vector<char>& held() const { return held_; }
  /// Of inertia and mass damping, per point [N/m].
  const std::vector<double>& weights() const { return weight_; }

  /// Without what viscosity adds [J].
  double elasticEnergy(const PointVector& x);
  /// Overwrites gradient().
  ClothEvaluation evaluate(const PointVector& x);
  /// The same with matrix(). `from`: see PointTerm::addHessian().
  ClothEvaluation evaluateHessian(const PointVector& x, HessianKind kind, const PointVector* from = nullptr);
  /// Adds the elastic and viscous parts only. `with_constant`: also that of the term with a constant matrix.
  ClothEvaluation addInternal(const PointVector& x, PointVector& gradient, bool with_constant = true);
  PointVector& gradient() { return gradient_; }
  const PointVector& gradient() const { return gradient_; }
  /// The elastic and viscous part of the gradient as last evaluated [N].
  Eigen::Vector3d internalGradient(int i) const { return point(gradient_, i) - point(load_gradient_, i); }
  /// Work of gravity, extra forces and loads on the points that are not held, on the way between two configurations,
  /// the loads as at the end of the stage [J].
  double loadWork(const PointVector& from, const PointVector& to) const;

  /// The blocks of the Hessian as last evaluated; those of constantMatrix() are among them if constantInBlocks().
  BlockMatrix& matrix() { return matrix_; }
  const BlockMatrix& matrix() const { return matrix_; }
  /// Of the term that has one; nullptr without. The Hessian has 1 + viscosity() times this.
  const PointMatrix* constantMatrix() const { return constant_; }
  bool constantInBlocks() const { return constant_in_blocks_; }
  /// The Hessian times p.
  void applyMatrix(const PointVector& p, PointVector& ap) const;
  /// Adds a multiple of weights() to the matrix.
  void shiftMatrix(double factor);
  /// Adds the masses times `rate` [1/s^2] to the matrix; the rate may be negative.
  void addInertia(double rate);
  /// Makes the inertia in the matrix, and mass damping, that of a stage with this tau [s].
  void setInertia(double tau);

  const std::vector<ClothTerm>& terms() const { return terms_; }
  const std::vector<std::unique_ptr<PointLoad>>& loads() const { return loads_; }

private:
  /// Weight of inertia per mass [1/s^2].
  double rate(double tau) const { return 1.0 / (tau * tau) + model_.mass_damping / tau; }
  void usePattern();
  void setWeights(double tau, double ratio);
  void respond(double ratio);
  /// Inertia and loads: adds their gradient to gradient_; returns their potential.
  double addLoads(const PointVector& x);
  /// In counts per point.
  void spend(int counts) { budget_->spend(static_cast<long>(counts) * points()); }

  const ClothModel& model_;
  WorkBudget unbounded_;
  WorkBudget* budget_ = &unbounded_;
  std::vector<ClothTerm> terms_;
  std::vector<std::unique_ptr<PointLoad>> loads_;
  const PointMatrix* constant_ = nullptr;   ///< of the term that has one
  bool constant_in_blocks_;

  BlockMatrix matrix_;
  std::vector<int> constant_map_;
  std::vector<double> base_;   ///< constant part of matrix_
  double base_tau_ = 0, base_ratio_ = -1;
  double matrix_tau_ = 0;
  std::vector<char> base_held_;

  double ratio_ = 0;
  PointVector start_, target_, force_, gradient_, load_gradient_;
  PointVector ahead_, behind_;   ///< with stiffness damping only
  std::vector<double> weight_;   ///< of inertia, per point
  std::vector<char> held_;
};

}   // namespace slender
