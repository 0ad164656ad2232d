#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/dynamics/chain_configuration.h"
#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/energy/chain_term.h"
#include "slender_sim/linalg/cyclic_banded_ldlt.h"

namespace slender {

/// Equations of one chain of nodes and edges: energy, gradient and banded Hessian at the trial configuration. Rods
/// (RodSystem) and threads (ThreadSystem) are chains.
///
/// A trial configuration is reached from the base one by moveAlong(); evaluate() computes everything there; accept()
/// makes it the new base. The energy is that of the kernel (rod_kernel.h) and of a list of terms.
class ChainSystem : public ChainConfiguration
{
public:
  /// Inertia and loads of a node: 1/2 weight |x - target|^2 - force . x.
  void setInertia(int node, double weight, const Eigen::Vector3d& target, const Eigen::Vector3d& force)
  {
    a_.weight[node] = weight;
    put(a_.target, node, target);
    put(a_.force, node, force);
  }

  // ---- one chain alone, for minimize()
  /// Everything at the trial configuration; with_hessian also assembles and factors the matrix plus the shift of a
  /// positive diagonal (result.inertia), and begins the solution of solve().
  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {});
  /// direction() := -K^-1 gradient of the last evaluate(true).
  void solve();
  /// The same with the gradient as it is now.
  void solveAgain();
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
  static constexpr StepFailure givesUp() { return StepFailure::none; }
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
                        : holds_.reaction(node);
  }
  /// Likewise by the turn of an edge [N m].
  double angleGradient(int edge) const { return mayTurn(edge) ? gradient_[4 * edge + 3] : holds_.turnReaction(edge); }

protected:
  ChainSystem() = default;
  ~ChainSystem() = default;

  /// Takes memory for the arrays and the matrix of `capacity` nodes, with zeros in it.
  void allocate(int capacity);
  /// The matrix gets the size of the chain.
  void resizeMatrix() { matrix_.resize(a_.nodes, a_.closed); }

  /// The list of terms. They belong to the derived class.
  void clearTerms() { terms_.clear(); }
  void addTerm(ChainTerm& term) { terms_.push_back(&term); }

  AlignedVector<double> gradient_, direction_, reduced_;
  double stretch_modulus_ = 0;   ///< largest one of the edges [N]
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
  CyclicBandedLdlt matrix_;
  /// Where panels are assembled: the matrix itself, or for long open chains a piece that stays in the cache.
  RodPanel* panels_ = nullptr;
  int first_panel_ = 0;
  AlignedVector<RodPanel> piece_;
  std::vector<ChainTerm*> terms_;
};

}   // namespace slender
