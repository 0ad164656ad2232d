#pragma once

#include <string>

#include "cloth_linear_solver.h"
#include "slender_sim/dynamics/equilibrium_search.h"
#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/dynamics/newton.h"

namespace slender {

/// Elastic energy and that of the loads at a trial configuration, in the terms of minimize() (see newton.h).
struct ClothTrial
{
  /// Factors the Hessian when it is asked for, once.
  struct Definiteness
  {
    class ClothStatics* statics = nullptr;
    bool positiveDefinite();
  };
  double stretch = 0, bend_twist = 0, potential = 0;   ///< [J]; bend_twist: bending
  double max_strain = 0;
  double min_chi = 2;   ///< cloth has no parallel transport that could fail
  Definiteness inertia;
  double energy() const { return stretch + bend_twist + potential; }
};

/// Static equilibria of one cloth, in the terms of EquilibriumSearch. The proximal term is 1/2 w m |x - x_k|^2, and
/// each round minimises with the exact Hessian. The pins are what is prescribed.
class ClothStatics
{
public:
  /// Keeps its own copy of the model, without damping and air.
  ClothStatics(const ClothModel& model, const NewtonConfig& newton);

  /// Writes the equilibrium into `state` on success. Inputs and state must have been checked.
  StepFailure solve(ClothState& state, const ClothInputs& inputs, bool leave_saddles, StepReport& report);
  /// Judges `state`, which must be stationary.
  void assess(const ClothState& state, const ClothInputs& inputs, StepReport& report);
  const Eigen::Matrix3Xd& pinForces() const { return pin_forces_; }
  const Eigen::Matrix3Xd& mode() const { return mode_; }
  /// Says why there is no equilibrium, and what to change.
  std::string explain(StepFailure failure) const;

  // ---- what EquilibriumSearch needs; the present configuration is x_, and a proximal weight of 1 is unit_rate_
  NewtonResult round(double fraction, double weight);
  double shift() const;
  void takeBase() { x_ = base_; }
  double weightOf(double rate) const { return rate / unit_rate_; }
  EquilibriumStability assess(bool spectrum);
  const PointVector& configuration() const { return x_; }
  void restore(const PointVector& x) { x_ = x; }
  bool displace(double turn);

  // ---- what minimize() needs
  ClothTrial evaluate(bool with_hessian, const HessianShift& shift = {});
  void solve();
  void moveAlong(double alpha);
  void accept() { base_ = trial_; }
  void saveBase() { saved_ = base_; }
  void restoreBase() { base_ = saved_; }
  double incrementSize() const;
  double slope() const;
  double stepLimit() const;
  double residual() const;
  double noiseLevel() const;
  double forceScale() const;
  static constexpr bool anglesMayKeepShift() { return false; }
  static constexpr StepFailure givesUp() { return StepFailure::none; }
  /// without forces there is no scale
  static constexpr double mostUnbalanced() { return std::numeric_limits<double>::infinity(); }

private:
  friend struct ClothTrial::Definiteness;

  void begin(const ClothState& state, const ClothInputs& inputs);
  void setRound(double weight);
  double pinMoves() const;
  bool definite(double rate);
  void findMode();
  double neutralBand() const;
  double turnOf(const PointVector& d) const;
  void finish(StepReport& report);

  ClothModel model_;
  ClothSystem system_;
  ClothLinearSolver linear_;
  NewtonConfig newton_;
  double shortest_edge_ = 0, size_ = 0;   ///< [m]
  double unit_rate_ = 0;                  ///< scale of the proximal term [1/s^2]
  bool factored_ = false, definite_ = false;
  int factorizations_ = 0;
  ClothInputs inputs_;
  ClothState state_;   ///< for pins and hinges
  Eigen::Matrix3Xd pins_from_;
  PointVector x_, trial_, base_, saved_, d_, force_;
  Eigen::Matrix3Xd pin_forces_, mode_;
};

}   // namespace slender
