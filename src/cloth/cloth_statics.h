#pragma once

#include "cloth_part.h"
#include "island/equations.h"
#include "slender_sim/dynamics/equilibrium_search.h"

namespace slender {

/// Static equilibria of one cloth, in the terms of EquilibriumSearch. The proximal term is 1/2 w m |x - x_k|^2. Each
/// round minimises the equations of an island of the cloth alone. The pins are what is prescribed.
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

  // ---- what EquilibriumSearch needs; the present configuration is x_, and a proximal weight of 1 is unit_rate_
  NewtonResult round(double fraction, double weight);
  double shift() const;
  void takeBase();
  double weightOf(double rate) const { return rate / unit_rate_; }
  EquilibriumStability assess(bool spectrum);
  const PointVector& configuration() const { return x_; }
  void restore(const PointVector& x) { x_ = x; }
  bool displace(double turn);

private:
  void begin(const ClothState& state, const ClothInputs& inputs);
  void setRound(double weight);
  double pinMoves() const;
  bool definite(double rate);
  void findMode();
  double neutralBand() const;
  double turnOf(const PointVector& d) const;
  double residual() const;
  double forceScale() const;
  void finish(StepReport& report);

  ClothWork work_;   ///< whose x is the trial of a round
  ClothPart part_;
  Equations equations_;
  const ClothModel& model_;
  ClothSystem& system_;
  ClothLinearSolver& linear_;
  NewtonConfig newton_;
  double size_ = 0;        ///< [m]
  double unit_rate_ = 0;   ///< scale of the proximal term [1/s^2]
  int factorizations_ = 0;
  ClothInputs inputs_;
  ClothState state_;   ///< for pins and hinges
  Eigen::Matrix3Xd pins_from_;
  PointVector x_, d_, force_;
  Eigen::Matrix3Xd pin_forces_, mode_;
};

}   // namespace slender
