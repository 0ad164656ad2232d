#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/energy/surface_tension.h"
#include "slender_sim/linalg/banded_ldlt.h"

namespace slender {

/// Equations of one step of a thread, for minimize(): the rod's kernel with viscous stiffnesses, surface tension,
/// inertia of positions and of the edges' spin. Nodes, edges and joints are numbered as in RodArrays.
///
/// Set-up of a step: resize, setNode and setFrame at its start, takeRestStrains, then the stiffnesses, inertia and what
/// is held; last the trial configuration by setNode.
class ThreadSystem
{
public:
  /// Clears stiffnesses, inertia, loads and holds. Takes memory only when it has never been so large.
  void resize(int nodes);
  int nodes() const { return a_.nodes; }
  const RodArrays& arrays() const { return a_; }

  void setNode(int i, const Eigen::Vector3d& x) { put(a_.x, i, x); }
  Eigen::Vector3d node(int i) const { return get(a_.x, i); }
  /// Frame of edge j to transport from: tangent and first director.
  void setFrame(int j, const Eigen::Vector3d& t, const Eigen::Vector3d& d1)
  {
    put(a_.base_t, j, t);
    put(a_.base_d1, j, d1);
  }
  void setTwist(int joint, double twist) { a_.base_twist[joint] = twist; }
  /// Lengths and strains at the nodes set become those of rest. Returns the evaluation, for its min_chi.
  RodEvaluation takeRestStrains();
  double restLength(int j) const { return 1.0 / a_.inverse_rest_length[j]; }
  double leastRestLength() const { return min_rest_length_; }

  /// Stretching modulus k_s [N] and fluid volume [m^3] of edge j.
  void setEdge(int j, double modulus, double volume);
  /// Bending and twisting of a joint, divided by its length [N m].
  void setJoint(int i, double bend, double twist) { a_.b11[i] = a_.b22[i] = bend, a_.beta[i] = twist; }
  void setSurfaceTension(double gamma, SurfaceShape shape)
  {
    gamma_ = gamma;
    shape_ = shape;
  }
  /// Inertia and loads of node i: 1/2 weight |x - target|^2 - force . x.
  void setInertia(int i, double weight, const Eigen::Vector3d& target, const Eigen::Vector3d& force);
  /// Inertia of edge j's turn since the start of the step: 1/2 weight (turn - target)^2.
  void setSpin(int j, double weight, double target) { spin_weight_[j] = weight, spin_target_[j] = target; }
  double spinWeight(int j) const { return spin_weight_[j]; }
  /// Turn of the trial from the base.
  void setTurn(int j, double turn) { a_.turn[j] = turn; }
  void holdNode(int i) { held_[4 * i] = held_[4 * i + 1] = held_[4 * i + 2] = 1; }
  void holdAngle(int j) { held_[4 * j + 3] = 1; }
  bool nodeHeld(int i) const { return held_[4 * i]; }
  bool held(int unknown) const { return held_[unknown]; }

  /// Turn of edge j about its tangent since the start of the step [rad].
  double turn(int j) const { return turn_base_[j] + a_.turn[j]; }
  /// dE/d(x, angle) of the last evaluation, what is held included.
  Eigen::Vector4d reaction(int i) const { return Eigen::Map<const Eigen::Vector4d>(reactions_.data() + 4 * i); }

  /// Joint of the last trial with the sharpest turn beyond a right angle, -1: none.
  int sharpestJoint() const;

  /// For systems of several threads that touch: energy, gradient() and panels() of all unknowns, held ones included,
  /// without factoring. closeGradient() then keeps the held ones' entries as reactions and clears them.
  RodEvaluation evaluateWhole(bool with_hessian);
  void closeGradient();
  const RodPanel* panels() { return matrix_.panels(); }
  double* gradient() { return gradient_.data(); }     ///< 4 per node
  double* direction() { return direction_.data(); }   ///< 4 per node
  /// What a shift adds to the diagonal of panels() of node i: {position, angle}; after evaluateWhole(true).
  std::array<double, 2> diagonalShift(int i, const HessianShift& shift) const
  {
    return {shift.position * (a_.weight[i] + shift_x_), shift.angle * shift_theta_};
  }

  // for minimize()
  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {});
  void solve();
  void moveAlong(double alpha);
  void accept();
  void saveBase();
  void restoreBase();
  double stepLimit() const;
  double incrementSize() const;
  static constexpr bool anglesMayKeepShift() { return false; }
  double slope() const;
  /// Residual over force scale beyond which a step is not solved, however small the increment: inertia of very short
  /// steps leaves nothing else to see.
  static constexpr double mostUnbalanced() { return 0.1; }
  double residual() const;
  double forceScale() const;
  double noiseLevel() const;

private:
  static constexpr int kHalo = RodArrays::kHalo;
  static void put(double* const (&p)[3], int i, const Eigen::Vector3d& v)
  {
    for (int k = 0; k < 3; ++k)
      p[k][i] = v[k];
  }
  static Eigen::Vector3d get(double* const (&p)[3], int i) { return {p[0][i], p[1][i], p[2][i]}; }
  void allocate(int capacity);
  double addSurface(bool with_hessian);
  double addSpin(bool with_hessian);
  void fixHeld(int i);
  void addEdgePair(int joint, const LengthFunction& area, bool with_hessian);

  RodArrays a_;
  int capacity_ = 0;
  std::vector<AlignedVector<double>> storage_;
  BandedLdlt<10, 4> matrix_;
  AlignedVector<double> gradient_, reactions_, direction_, reduced_, x_base_[3], saved_[11];
  std::vector<double> volume_, spin_weight_, spin_target_, turn_base_;
  std::vector<char> held_;
  double gamma_ = 0;
  SurfaceShape shape_ = SurfaceShape::cone;
  double max_modulus_ = 0, min_rest_length_ = 0, shift_x_ = 0, shift_theta_ = 0;
};

}   // namespace slender
