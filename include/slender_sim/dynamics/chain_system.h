#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/energy/chain_term.h"
#include "slender_sim/linalg/cyclic_banded_ldlt.h"

namespace slender {

/// Equations of one chain of nodes and edges, in the layout of the hot loops: configuration, energy, gradient, banded
/// Hessian, and what is held. Rods (RodSystem) and threads (ThreadSystem) are chains. The unknowns are four per node:
/// its position, and the turn of the edge after it.
///
/// A trial configuration is reached from the base one by moveAlong(); evaluate() computes everything there; accept()
/// makes it the new base. Frames are transported from the base (thesis 4.6.2, Newton update). The energy is that of the
/// kernel (rod_kernel.h) and of a list of terms.
class ChainSystem
{
public:
  ChainSystem(const ChainSystem&) = delete;
  ChainSystem& operator=(const ChainSystem&) = delete;

  int nodes() const { return a_.nodes; }
  const RodArrays& arrays() const { return a_; }

  /// Trial position of a node.
  void setPosition(int node, const Eigen::Vector3d& x) { put(a_.x, node, x); }
  Eigen::Vector3d position(int node) const { return get(a_.x, node); }
  Eigen::Vector3d basePosition(int node) const { return {x_base_[0][node], x_base_[1][node], x_base_[2][node]}; }
  /// Inertia and loads of a node: 1/2 weight |x - target|^2 - force . x.
  void setInertia(int node, double weight, const Eigen::Vector3d& target, const Eigen::Vector3d& force)
  {
    a_.weight[node] = weight;
    put(a_.target, node, target);
    put(a_.force, node, force);
  }
  double leastRestLength() const { return min_rest_length_; }

  bool isFree(int node) const { return !node_slot_[node]; }
  bool mayTurn(int edge) const { return !angle_slot_[edge]; }   ///< its angle is not prescribed
  /// Whether an unknown is prescribed, or does not exist: the last node of an open chain has no edge.
  bool held(int unknown) const
  {
    const int node = unknown / 4;
    return unknown % 4 < 3 ? !isFree(node) : node >= a_.edges || !mayTurn(node);
  }

  // ---- one chain alone, for minimize()
  /// Everything at the trial configuration; with_hessian also assembles and factors the matrix plus the shift of a
  /// positive diagonal (result.inertia), and begins the solution of solve().
  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {});
  /// direction() := -K^-1 gradient of the last evaluate(true).
  void solve();
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
  double slope() const;        ///< gradient . direction [J]
  double residual() const;     ///< largest unbalanced nodal force or moment / edge [N]
  double forceScale() const;   ///< largest internal or external force [N]
  double noiseLevel() const;   ///< unbalanced force that round-off alone can cause [N]
  /// x := K^-1 x with the matrix of the last evaluate(true), four doubles per node; zero at held nodes if x is.
  void solveFor(double* x) const { matrix_.solve(x); }

  // ---- systems of several chains, bodies and contact
  /// Energy, gradient() and panels() of all unknowns, prescribed ones included, without factoring. closeGradient() then
  /// keeps the prescribed ones' entries as reactions and clears them.
  RodEvaluation evaluateWhole(bool with_hessian);
  void closeGradient() { takeReactions(0, a_.nodes); }
  /// After evaluateWhole(true), for a chain on which only forces act that couple neighbouring nodes, and which were
  /// added to gradient() and panels(): closes the gradient, factors the matrix plus the shift, and begins the solution
  /// of solve(). Returns the matrix's inertia.
  Inertia factorWhole(const HessianShift& shift);
  RodPanel* panels() { return matrix_.panels(); }
  double* gradient() { return gradient_.data(); }     ///< 4 per node
  double* direction() { return direction_.data(); }   ///< 4 per node
  /// What a shift adds to the diagonal of panels() of a node: {position, angle}.
  std::array<double, 2> diagonalShift(int node, const HessianShift& shift) const
  {
    return {shift.position * (a_.weight[node] + shift_x_), shift.angle * shift_theta_ + spin_};
  }
  /// Rows of a panel in use: those of its own block, of the next block, and the positions of the block after that.
  static constexpr int kPanelRows = 11;
  static double panelEntry(const RodPanel& p, int column, int row)
  {
    return row < 4 ? p.diag[column][row] : p.below[column][row - 4];
  }
  /// The unknown that a row of a node's panel belongs to; -1 beyond the end of an open chain.
  int panelUnknown(int node, int row) const
  {
    const int at = node + row / 4;
    return at < a_.nodes ? 4 * at + row % 4 : a_.closed ? 4 * (at - a_.nodes) + row % 4 : -1;
  }

  /// dE/dx of an evaluated trial at a node, held or not: minus the force of the chain on it [N].
  Eigen::Vector3d nodeGradient(int node) const
  {
    return isFree(node) ? Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(gradient_.data() + 4 * node))
                        : reactions_[node_slot_[node] - 1];
  }
  /// Likewise by the turn of an edge [N m].
  double angleGradient(int edge) const
  {
    return mayTurn(edge) ? gradient_[4 * edge + 3] : angle_reactions_[angle_slot_[edge] - 1];
  }

protected:
  static constexpr int kHalo = RodArrays::kHalo;

  ChainSystem() = default;
  ~ChainSystem() = default;

  static void put(double* const (&p)[3], int i, const Eigen::Vector3d& v)
  {
    for (int k = 0; k < 3; ++k)
      p[k][i] = v[k];
  }
  static Eigen::Vector3d get(const double* const (&p)[3], int i) { return {p[0][i], p[1][i], p[2][i]}; }

  /// Says what the chain is, and takes no memory. It comes first; a chain may change its number of nodes afterwards.
  void setSize(int nodes, bool closed, Curvature curvature);
  /// Takes memory for the arrays and the matrix of `capacity` nodes, with zeros in it.
  void allocate(int capacity);
  bool allocated() const { return capacity_ > 0; }
  int capacity() const { return capacity_; }
  /// The matrix gets the size of the chain.
  void resizeMatrix() { matrix_.resize(a_.nodes, a_.closed); }
  /// Of a closed chain: the halo of an array of nodes or edges repeats them.
  void wrapHalo(double* p, int count) const;

  /// Frees all that is held.
  void releaseAll()
  {
    for (auto* slots : {&node_slot_, &angle_slot_})
    {
      slots->resize(a_.nodes);
      std::fill(slots->begin(), slots->end(), 0);
    }
    held_nodes_.clear();
    held_angles_.clear();
    reactions_.clear();
    angle_reactions_.clear();
  }
  void hold(int node)
  {
    if (!isFree(node))
      return;
    held_nodes_.push_back(node);
    reactions_.emplace_back(Eigen::Vector3d::Zero());
    node_slot_[node] = static_cast<int>(held_nodes_.size());
  }
  void holdTurn(int edge)
  {
    if (!mayTurn(edge))
      return;
    held_angles_.push_back(edge);
    angle_reactions_.push_back(0.0);
    angle_slot_[edge] = static_cast<int>(held_angles_.size());
  }
  const std::vector<int>& heldTurns() const { return held_angles_; }

  /// The list of terms. They belong to the derived class.
  void clearTerms() { terms_.clear(); }
  void addTerm(ChainTerm& term) { terms_.push_back(&term); }
  /// Whether the turns of the edges are added up from the last forgetTurns() on; that is for terms that act on them.
  void keepTurns(bool keep)
  {
    for (auto* turns : {&turned_, &saved_turned_})
      turns->resize(keep ? a_.edges : 0);
  }
  void forgetTurns() { std::fill(turned_.begin(), turned_.end(), 0.0); }
  const double* turned() const { return turned_.data(); }

  RodArrays a_;
  AlignedVector<double> x_base_[3], gradient_, direction_, reduced_;
  double stretch_modulus_ = 0;   ///< largest one of the edges [N]
  double min_rest_length_ = 0;
  /// Of a node against what moves it alone [N/m]: an edge's stretching, a joint's bending. See noiseLevel().
  double node_stiffness_ = 0;
  double shift_x_ = 0, shift_theta_ = 0;   ///< units of a shift: [N/m] and [N m]
  double spin_ = 0;                        ///< always added to the angles' diagonal [N m]

private:
  int advance(RodSweep& sweep, bool with_hessian, int from, int to, RodEvaluation& added);
  RodPanel& panel(int node) { return panels_[node - first_panel_]; }
  int nodeBefore(int node, int count) const { return a_.closed ? (node + a_.nodes - count) % a_.nodes : node - count; }
  void takeReactions(int from, int to);
  void fixPanels(int from, int to);
  void fixPosition(int node, int from, int to);
  void fixTurn(int edge, int from, int to);
  void addShift(int from, int to, const HessianShift& shift);

  const RodKernels& kernels_ = rodKernels();
  Curvature curvature_ = Curvature::tangent;
  int capacity_ = 0;
  std::vector<AlignedVector<double>> storage_;
  CyclicBandedLdlt matrix_;
  /// Where panels are assembled: the matrix itself, or for long open chains a piece that stays in the cache.
  RodPanel* panels_ = nullptr;
  int first_panel_ = 0;
  AlignedVector<RodPanel> piece_;
  AlignedVector<double> saved_[10];
  std::vector<double> turned_, saved_turned_;   ///< per edge; empty: nobody wants them
  std::vector<ChainTerm*> terms_;

  std::vector<int> node_slot_, angle_slot_;     ///< slot in the lists below plus one, 0 = free
  std::vector<int> held_nodes_, held_angles_;   ///< nodes, edges whose unknowns are prescribed
  std::vector<Eigen::Vector3d> reactions_;      ///< gradient at held_nodes_ before it is cleared
  std::vector<double> angle_reactions_;         ///< likewise at held_angles_
};

}   // namespace slender
