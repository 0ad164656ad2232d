#pragma once

#include <string>

#include <Eigen/Core>

#include "slender_sim/energy/rod_kernel.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/rod/rod_state.h"

namespace slender {

/// Fixed properties of one discrete rod (thesis 3.2.2, 4.2). Open: n nodes, n-1 edges; closed: n edges.
/// Edge j runs from node j to node j+1 (mod n); joint i sits at node i between edges i-1 and i.
struct RodModel
{
  std::string name;
  bool closed = false;
  Curvature curvature = Curvature::tangent;   ///< what rest_curvature, and the strain to compare with it, are

  Eigen::VectorXd mass;                 ///< per node [kg], lumped Voronoi cells
  Eigen::VectorXd rest_length;          ///< per edge [m]
  Eigen::VectorXd spin_inertia;         ///< per edge, about the tangent [kg m^2]
  Eigen::VectorXd stretch_modulus;      ///< per edge k_s [N]
  Eigen::VectorXd radius_a, radius_b;   ///< per edge semi-axes [m]
  Eigen::Matrix3Xd bend_modulus;        ///< per node (B11, B12, B22) [N m^2]
  Eigen::VectorXd twist_modulus;        ///< per node beta [N m^2]
  Eigen::Matrix2Xd rest_curvature;      ///< per node, integrated (kappa1, kappa2) [-]
  Eigen::VectorXd rest_twist;           ///< per node, integrated [rad]

  bool isotropic = false;   ///< explicit steps use the isotropic formulation (see whyNotIsotropic)
  /// explicit steps keep the edges' lengths by projection instead of stretching energy
  bool inextensible = false;

  double mass_damping = 0.0;        ///< Rayleigh [1/s]
  double stiffness_damping = 0.0;   ///< Rayleigh [s]
  Eigen::VectorXd drag;             ///< per node [N s/m]: linear drag times Voronoi length; empty: none

  int nodes() const { return static_cast<int>(mass.size()); }
  int edges() const { return static_cast<int>(rest_length.size()); }
  double totalMass() const { return mass.sum(); }
  /// Returns the rest length that belongs to a node [m]: half of each edge that meets there.
  double voronoiLength(int node) const
  {
    const int before = node > 0 ? node - 1 : (closed ? edges() - 1 : -1);
    return 0.5 * ((before >= 0 ? rest_length[before] : 0.0) + (node < edges() ? rest_length[node] : 0.0));
  }
  bool damped() const { return mass_damping > 0 || drag.size() > 0; }
  /// Of a node's velocity against air at rest [N s/m].
  double damping(int node) const { return mass_damping * mass[node] + (drag.size() > 0 ? drag[node] : 0.0); }
};

/// Elliptic cross-section and material of one edge, for buildRod.
struct RodSection
{
  double a, b;                    ///< semi-axes along d1, d2 [m]
  double linear_density;          ///< [kg/m]
  double stretch_modulus;         ///< [N]
  Eigen::Matrix2d bend_modulus;   ///< [N m^2]
  double twist_modulus;           ///< [N m^2]
};

/// How buildRod makes joints of a rest shape.
struct JointOptions
{
  Curvature curvature = Curvature::tangent;
  /// Joints as stiff about their natural turn as the arcs they stand for, whose ends are the middles of the edges.
  /// About a turn a the curvature 2 tan(a/2) changes by 1/cos^2(a/2) times the change of the turn, and the curvature
  /// across and the twist by tan(a/2) / (a/2) times the components of the rotation's logarithm (compensated: only the
  /// twist); and a joint has the length of two half chords, not that of the arc. Left alone, all that makes coils of
  /// few edges stiffer by terms of second order.
  bool matched_to_arcs = false;
};

/// Builds the model from the rest shape. `nodes` 3 x n [m]; `director` d1 at the first edge (zero: any normal), the
/// others by parallel transport along the curve, so the rest twist is zero (in a closed rod the holonomy is left at
/// node 0 as rest twist). Throws std::invalid_argument naming the bad value: fewer than 3 nodes, repeated nodes, folded
/// edges, sections of wrong number or not positive, a naturally straight rod to be matched to arcs.
RodModel buildRod(const std::string& name, const Eigen::Matrix3Xd& nodes, bool closed,
                  const std::vector<RodSection>& sections, const Eigen::Vector3d& director, bool naturally_straight,
                  const JointOptions& joints = {});

/// Why the isotropic formulation (thesis 4.2, special case) does not apply; empty when it does: naturally straight, the
/// same bending modulus in all directions, no stiffness damping, the thesis's curvature.
std::string whyNotIsotropic(const RodModel& model);

/// A state at rest at the given nodes, twist-free frames plus `total_twist` [rad] spread evenly over the inner nodes
/// (of a closed rod: over all nodes, and whole turns only). `director`: d1 at the first edge (projected; zero: any
/// normal). One that does without material frames gets none unless it is twisted. Throws std::invalid_argument naming
/// the bad value.
RodState makeRodState(const RodModel& model, const Eigen::Matrix3Xd& nodes, const Eigen::Vector3d& director,
                      double total_twist = 0.0);

/// Whether explicit steps need material frames only once one is held: open, isotropic and naturally untwisted. Such a
/// rod has no twist until then.
bool doesWithoutFrames(const RodModel& model);

/// Whether there are as many material frames and twists as edges and nodes, or none of either but a director across the
/// first edge.
bool framesFit(const RodModel& model, const RodState& state);

/// Gives a state its material frames if it has none.
void addFrames(const RodModel& model, RodState& state);

/// Calls f(edge, axes) for each edge in order; `axes` 3 x 3: tangent, d1, d2 of its material frame, orthonormal to
/// round-off.
template <class F>
void forEachFrame(const RodModel& model, const RodState& state, F&& f)
{
  Eigen::Vector3d d1 = state.director;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  for (int j = 0; j < model.edges(); ++j)
  {
    const Eigen::Vector3d before = axes.col(0);
    axes.col(0) = (state.x.col((j + 1) % model.nodes()) - state.x.col(j)).normalized();
    if (state.framed())
      d1 = state.d1.col(j);
    else if (j > 0)
      d1 = parallelTransport(d1, before, axes.col(0));
    d1 = axes.col(1) = (d1 - axes.col(0) * axes.col(0).dot(d1)).normalized();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    f(j, axes);
  }
}

/// Takes hold of nodes first..last as they are now (thesis 4.3 clamps, second order in the edge length: see
/// ClampJoint).
GraspState makeGrasp(const RodModel& model, const RodState& state, int first_node, int last_node, bool holds_frame);

}   // namespace slender
