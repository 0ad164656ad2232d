#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/dynamics/chain_kernel.h"
#include "slender_sim/geometry/pose.h"
#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/linalg/sparse_lu.h"

namespace slender {

struct ProjectionReport
{
  bool ok = true;
  int iterations = 0;              ///< linear solves
  double constraint_error = 0.0;   ///< largest | |e|^2/L^2 - 1 | left
  /// not ok: held nodes that are further apart than the chain between them is long; -1: other reasons
  int chain = -1, first_node = 0, last_node = 0;
};

/// A rigid body in a projection. Its origin is the centre of mass.
struct ProjectedBody
{
  double mass = 1.0;                                       ///< [kg]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();   ///< about the centre of mass, body axes [kg m^2]
  Pose start;                                              ///< at the start of the step
  Pose pose;        ///< in: where an unconstrained step would take it; out: projected
  Twist velocity;   ///< likewise; world axes
};

/// Fast manifold projection (thesis 4.5.2; Goldenthal et al. 2007): after an unconstrained step, moves chains of nodes
/// and the bodies that carry some of them to where all edges have their rest lengths, by the least displacement in the
/// metric of the masses.
///
/// Constraint forces act along the edges as they lie at the start of the step (SHAKE [Ryckaert et al. 1977]) instead of
/// at the last iterate: that conserves linear and angular momentum exactly, and with symplectic Euler it is a
/// symplectic method. A body's turn is described by the rotation vector phi from its start, in the metric of its
/// inertia there, so that its angular momentum changes by just the impulses' moments. Each iteration is a Newton step:
/// tridiagonal solves along the chains, and a sparse system for the bodies.
class FastProjection
{
public:
  /// Returns the chain's number. Lengths [m] per edge, masses [kg] per node.
  int addChain(const Eigen::VectorXd& rest_length, const Eigen::VectorXd& mass, bool closed);
  int addBody()
  {
    bodies_.emplace_back();
    return static_cast<int>(bodies_.size()) - 1;
  }
  ProjectedBody& body(int b) { return bodies_[b]; }

  /// Held nodes stay where the trial has them.
  void hold(int chain, int node) { setOwner(chain, node, kHeld); }
  void releaseAll(int chain);   ///< No node of the chain is held or welded.
  /// The node goes rigidly with a body, at r_B in its axes [m]; its own mass is not counted: add it to the body's.
  void weld(int chain, int node, int body, const Eigen::Vector3d& r_B);

  /// Nodes at the start of the step (welded ones where their bodies have them), and after the unconstrained step (held
  /// ones where they shall be; welded ones do not matter).
  void setStart(int chain, const Eigen::Matrix3Xd& x);
  void setTrial(int chain, const Eigen::Matrix3Xd& x);

  /// Projects chains and bodies. `h` is the step [s], by which displacements become velocities.
  ProjectionReport project(double h);

  /// Projected nodes into x; velocities of free nodes grow by their displacement over the step.
  void correct(int chain, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v) const;
  /// Mean force of the edges' constraints on a node during the step [N].
  Eigen::Vector3d force(int chain, int node) const;
  /// Tension of an edge [N].
  double tension(int chain, int edge) const { return chains_[chain].a.total[edge] / (step_ * step_); }

  double tolerance = 1e-8;
  int max_iterations = 50;

private:
  static constexpr int kFree = -1, kHeld = -2;
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  struct Chain
  {
    ChainArrays a;
    std::vector<AlignedVector<double>> storage;
    std::vector<double> mass;
    std::vector<int> owner;                      ///< per node: kFree, kHeld or a body
    std::vector<Eigen::Vector3d> r_B;            ///< of welded nodes
    std::vector<Eigen::Vector3d> start, trial;   ///< nodes; trial ones of welded nodes are not used
    AlignedVector<double> corner;                ///< closed: column of the corners' rank-one part, solved
    double corner_factor = 0, corner_row = 0;
  };
  /// One end of an edge that is a welded node.
  struct Touch
  {
    int chain, edge, body;
    double sign;   ///< +1: the edge ends at the welded node, -1: it begins there
    int node;
    int special;           ///< index of the edge among the special ones, -1: another
    int run;               ///< of edges that free nodes connect: touches of one run feel each other
    Vector6 row, column;   ///< d(edge's length)/d(body), impulse on the body per multiplier
  };

  /// An edge whose multiplier is an unknown beside the bodies' displacements: one that only bodies can move, or the
  /// last of a run between two nodes that are not free. Without it such a run has a loose end; a straight one between
  /// two fixed nodes has a singular system.
  struct Special
  {
    int chain, edge, run;
    int before;   ///< the edge that a free node connects it to, -1: none
    /// right-hand side, and entries of the chain's system: (before, edge), (edge, before), (edge, edge)
    double c = 0;
    double to_before = 0, from_before = 0, own = 0;
  };

  void setOwner(int chain, int node, int owner);
  void prepare();
  void buildPattern();
  static Eigen::Vector3d at(double* const* p, int i) { return {p[0][i], p[1][i], p[2][i]}; }
  static void put(double* const* p, int i, const Eigen::Vector3d& v);
  double& entry(int row, int column) { return matrix_.values()[matrix_.index(row, column)]; }
  void factorChain(Chain& chain);
  void solveChain(const Chain& chain, double* b) const;
  double evaluate();
  void linearise();
  bool solveBodies();
  /// Touches and special edges of one chain, by their numbers.
  struct OnChain
  {
    std::size_t begin, end, first, last;
  };
  void addInertias();
  void addChain(const OnChain& on);
  void addSpecials(const OnChain& on);
  void moveBodies();
  bool findOverstretched(ProjectionReport& report) const;

  std::vector<Chain> chains_;
  std::vector<ProjectedBody> bodies_;
  bool prepared_ = false;
  double step_ = 1.0;

  std::vector<Touch> touches_;
  std::vector<Special> specials_;
  std::vector<Vector6> impulse_;        ///< per body, sum so far
  std::vector<Eigen::Vector3d> turn_;   ///< per body, rotation vector from its start
  /// of the bodies' displacements, six each, then of the special edges' multipliers
  SparseLu matrix_;
  Eigen::VectorXd solution_;
  AlignedVector<double> column_;   ///< work space
};

}   // namespace slender
