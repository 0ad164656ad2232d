#pragma once

#include <array>
#include <limits>
#include <vector>

#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/linalg/cyclic_banded_ldlt.h"
#include "slender_sim/rod/rod_model.h"

namespace slender {

/// The bending and twisting between a clamped section and the free edge beyond it: half a joint, with half the edge's
/// rest length. The section itself has a prescribed frame; the edge is free to turn. That makes a clamp second order
/// accurate.
struct ClampJoint
{
  int grasp = 0, side = 0;   ///< side 1: the free edge follows the section, side 0: it precedes it
  int node = 0, edge = 0;
  double b11 = 0, b12 = 0, b22 = 0, beta = 0;   ///< divided by the half joint's length [N m]
  double rest_kappa1 = 0, rest_kappa2 = 0, rest_twist = 0;
  double coupling = 0;   ///< see JointCompensation
  // present response (with viscous part), see RodSystem::setResponse
  double scale = 1.0, rest1 = 0, rest2 = 0, rest3 = 0;

  /// section frame
  Eigen::Vector3d t = Eigen::Vector3d::UnitX(), d1 = Eigen::Vector3d::UnitY(), base_t = t, base_d1 = d1;
  double turn = 0, base_twist = 0;
  double kappa1 = 0, kappa2 = 0, twist = 0;
  double energy = 0;
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();   ///< on the gripper [N m]
  // by the edge vector and its angle (with_hessian only the second derivatives)
  Eigen::Vector3d gradient_e = Eigen::Vector3d::Zero(), hessian_et = Eigen::Vector3d::Zero();
  Eigen::Matrix3d hessian_ee = Eigen::Matrix3d::Zero();
  double gradient_t = 0, hessian_tt = 0;
};

/// Equations of one rod in the layout of the hot loops: configuration, energy, gradient, banded Hessian, constraints.
///
/// A trial configuration is reached from the base one by moveAlong(); evaluate() computes everything there; accept()
/// makes it the new base. Frames are transported from the base (thesis 4.6.2, Newton update).
class RodSystem
{
public:
  /// Takes memory for what compose() finds only; load() takes the rest when it is first called, and comes before
  /// anything else.
  explicit RodSystem(const RodModel& model);

  const RodModel& model() const { return model_; }
  const RodArrays& arrays() const { return a_; }

  /// Base and trial := state. Rebuilds the clamps when the state's grasps changed.
  void load(const RodState& state);
  /// Held parts, clamps and stiffnesses for the state's grasps, without its configuration; load() does it, too.
  void compose(const RodState& state);
  /// Counts the times that compose() found other grasps than before.
  unsigned long composition() const { return composition_; }
  /// Without stretching energy, for edges whose lengths are constraints; from the next setResponse() on.
  void leaveOutStretching(bool leave_out) { no_stretching_ = leave_out; }
  /// Positions, frames, twists, grasp sections.
  void store(RodState& state) const;

  /// Trial position of a node; held nodes are overwritten by placeGrasps().
  void setPosition(int node, const Eigen::Vector3d& x)
  {
    for (int k = 0; k < 3; ++k)
      a_.x[k][node] = x[k];
  }
  Eigen::Vector3d position(int node) const { return {a_.x[0][node], a_.x[1][node], a_.x[2][node]}; }
  Eigen::Vector3d basePosition(int node) const { return {x_base_[0][node], x_base_[1][node], x_base_[2][node]}; }
  /// Trial positions and frames of everything held, for the given grasp frames (one per grasp of the state).
  void placeGrasps(const std::vector<Pose>& X_WG);

  /// Inertia and loads of node i: 1/2 weight |x - target|^2 - force . x.
  void setInertia(int node, double weight, const Eigen::Vector3d& target, const Eigen::Vector3d& force);
  /// Torques about the tangents of the edges [N m], one per edge, or empty: none. They stay until they are set again,
  /// beyond load(). The potential is -sum M_j theta_j, where theta_j is the turn of edge j since load(). At fixed
  /// tangents that is exact. Where a tangent turns as well, such a torque has no potential: its force field is M_j on
  /// theta_j and nothing on positions, and the matrix leaves out its skew part.
  void setTwistLoads(const Eigen::VectorXd& torques);
  /// Work of these torques on the way from the state of load() to the trial [J].
  double twistWork() const;

  /// Elastic response; with viscous_ratio > 0 every stiffness acts as k (1 + ratio) about the mean of its rest strain
  /// and `viscous_strain` with weights 1 : ratio, which is the elastic force plus k ratio (strain - viscous_strain).
  void setResponse(double viscous_ratio, const Eigen::Matrix4Xd* viscous_strain);

  /// Everything at the trial configuration; with_hessian also assembles and factors the matrix plus the shift of a
  /// positive diagonal (result.inertia), and begins the solution of solve().
  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {});
  /// direction() := -K^-1 gradient of the last evaluate(true).
  void solve();
  /// x := K^-1 x with that matrix, four doubles per node; zero at held nodes if x is.
  void solveFor(double* x) const { matrix_.solve(x); }

  /// For systems of several rods, bodies and contact: energy, gradient() and panels() of all unknowns, prescribed ones
  /// included, without factoring. closeGradient() then keeps the prescribed ones' entries as reactions and clears them.
  RodEvaluation evaluateWhole(bool with_hessian);
  void closeGradient() { takeReactions(0, a_.nodes); }
  /// After evaluateWhole(true), for a rod on which only forces act that couple neighbouring nodes, and which were added
  /// to gradient() and panels(): closes the gradient, factors the matrix plus the shift, and begins the solution of
  /// solve(). Returns the matrix's inertia.
  Inertia factorWhole(const HessianShift& shift);
  RodPanel* panels() { return matrix_.panels(); }
  double* gradient() { return gradient_.data(); }     ///< 4 per node
  double* direction() { return direction_.data(); }   ///< 4 per node
  /// What a shift adds to the diagonal of panels() of node i: {position, angle}.
  std::array<double, 2> diagonalShift(int node, const HessianShift& shift) const
  {
    return {shift.position * (a_.weight[node] + shift_x_), shift.angle * shift_theta_ + spin_};
  }
  /// Trial := base + alpha direction.
  void moveAlong(double alpha);
  /// Base := trial.
  void accept();
  /// Copies of the base for a later return to it.
  void saveBase();
  void restoreBase();

  /// Largest step along the direction that turns no edge by more than about 0.7 rad, at most 1.
  double stepLimit() const;
  /// Largest nodal displacement of the direction over the shortest rest length [-].
  double incrementSize() const;
  /// No: where nodes are held only frames move, and then no increment of positions tells whether they have arrived.
  static constexpr bool anglesMayKeepShift() { return false; }
  /// without forces there is no scale
  static constexpr double mostUnbalanced() { return std::numeric_limits<double>::infinity(); }
  double slope() const;        ///< gradient . direction [J]
  double residual() const;     ///< largest unbalanced nodal force or moment / edge [N]
  double forceScale() const;   ///< largest internal or external force [N]
  double noiseLevel() const;   ///< unbalanced force that round-off alone can cause [N]
  bool isFree(int node) const { return !held_[node]; }
  bool mayTurn(int edge) const;   ///< its angle is not prescribed
  /// Has inertia here: free, or carried by a simulated body.
  bool isMoving(int node) const { return !held_[node] || carried_[node]; }

  /// Strains at the trial configuration, columns as in RodState::strain_rate.
  void strains(Eigen::Matrix4Xd& out) const;

  /// One Newton step of the material frames towards equilibrium at fixed positions (thesis 4.3), from the last
  /// evaluate(false). Returns the largest turn [rad]; turnFrames(), after accept(), makes these turns the next trial's.
  double solveFrames();
  void turnFrames();
  /// store() with those turns applied, which are exact for twists, without evaluating there.
  void storeTurned(RodState& state) const;
  /// Evaluates the trial and repeats this until its frames are in equilibrium. Returns the last evaluation.
  RodEvaluation relaxFrames();

  /// dE/dx of an evaluated trial at a node, held or not: minus the force of the rod on it [N].
  Eigen::Vector3d nodeGradient(int node) const;
  /// Torque [N m] of the clamps of a grasp and of its held edges on the gripper (without the forces' levers).
  Eigen::Vector3d clampTorque(int grasp) const;
  const std::vector<ClampJoint>& clamps() const { return clamps_; }

  /// Elastic stiffness of the joints as composed, over their lengths, and their twist at rest; per node.
  const double* bendStiffness() const { return b11_.data(); }
  const double* twistStiffness() const { return beta_.data(); }
  const double* restTwist() const { return rest_m_.data(); }

private:
  void allocate();
  void respond(ClampJoint& clamp) const;
  void evaluateClamp(ClampJoint& clamp, bool with_hessian, RodEvaluation& sum);
  void takeReactions(int from, int to);
  void addTwistLoads(int from, int to);
  RodPanel& panel(int node) { return panels_[node - first_panel_]; }
  void fixPanels(int from, int to);
  void fixUnknown(int node, int component, int from, int to);
  void addShift(int from, int to, const HessianShift& shift);
  void wrapHalo(double* p, int count) const;
  int before(int node) const { return node > 0 ? node - 1 : model_.edges() - 1; }

  const RodModel& model_;
  RodArrays a_;
  unsigned long composition_ = 0;
  bool no_stretching_ = false;
  std::vector<AlignedVector<double>> storage_;
  CyclicBandedLdlt matrix_;
  /// Where panels are assembled: the matrix itself, or for long open rods a piece that stays in the cache.
  RodPanel* panels_ = nullptr;
  int first_panel_ = 0;
  AlignedVector<RodPanel> piece_;
  AlignedVector<double> gradient_, direction_, reduced_, x_base_[3], saved_[10];
  std::vector<ClampJoint> saved_clamps_;
  /// elastic response as composed
  AlignedVector<double> stretch_, b11_, b12_, b22_, beta_, rest_k1_, rest_k2_, rest_m_, coupling_;

  /// per edge, see setTwistLoads; turned_: from load() to the base [rad]; empty: no torques
  std::vector<double> twist_load_, turned_, saved_turned_;
  std::vector<GraspState> grasps_;
  std::vector<ClampJoint> clamps_;
  std::vector<char> carried_;                   ///< per node: held by a simulated body
  std::vector<int> held_;                       ///< per node: slot in held_nodes_ plus one, 0 = free
  std::vector<int> held_nodes_, held_angles_;   ///< nodes, edges whose unknowns are prescribed
  std::vector<Eigen::Vector4d> reactions_;      ///< gradient at held_nodes_ (x, y, z) before it is cleared
  std::vector<double> angle_reactions_;         ///< likewise at held_angles_
  double max_stretch_modulus_ = 0, min_rest_length_ = 0, shift_x_ = 0, shift_theta_ = 0, spin_ = 0;
};

/// Share of a joint's turn and twist that falls on the half joint between its node and the edge before (side 0) or
/// after it (side 1).
double shareOfEdge(const RodModel& model, int node, int side);

/// Frame (t, d1, d2) of the section at a node: between the two edges' frames, or at the end of an open rod the end
/// edge's frame bent back by the rest curvature of half an edge.
Eigen::Matrix3d sectionFrame(const RodModel& model, const RodState& state, int node);

}   // namespace slender
