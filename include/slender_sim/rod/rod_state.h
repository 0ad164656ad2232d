#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// The part of a grasp's state that grasps of rods and of cloths have in common.
struct GraspFrame
{
  bool active = true;
  /// That of a rod has its origin at the held part, or at its middle, x along the tangent there, and y along d1.
  Pose X_WG;
};

/// What a grasp of one rod holds at this instant. It belongs to the state because grasps come and go in a run.
struct GraspState : GraspFrame
{
  int first_node = 0, last_node = 0;          ///< held nodes, first <= last; equal: a single section
  bool holds_frame = true;                    ///< false: a point pin (first == last)
  int body = -1;                              ///< simulated body that carries it (see Weld), -1: its pose is an input
  Twist velocity;                             ///< of X_WG
  std::vector<Eigen::Vector3d> nodes_G;       ///< held nodes in the grasp frame
  std::vector<Eigen::Vector3d> directors_G;   ///< d1 of the held edges between them, in the grasp frame
  /// The two end sections of the held part, seen from the grasp frame, and the twist [rad] (unwrapped) between each
  /// and the free edge beyond it. Side 0 faces the edge before first_node, side 1 the edge after last_node.
  Eigen::Matrix3d section_G[2] = {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()};   ///< columns t, d1, d2
  double section_twist[2] = {0.0, 0.0};
};

/// Everything that changes while a rod moves; saving and restoring it restarts bit-equal.
struct RodState
{
  Eigen::Matrix3Xd x;    ///< node positions [m], 3 x n
  Eigen::Matrix3Xd v;    ///< node velocities [m/s], 3 x n
  Eigen::Matrix3Xd d1;   ///< first material director of each edge, 3 x edges
  /// integrated material twist m_i at each node [rad], unwrapped; zero at the ends of an open rod
  Eigen::VectorXd twist;
  /// An isotropic rod of which no frame is held (see makeRodState) has no twist, and d1 and twist are empty: this is d1
  /// of its first edge, and the others follow by parallel transport along it (see forEachFrame). Of other rods without
  /// meaning.
  Eigen::Vector3d director{0, 0, 0};
  /// Angular velocity of each edge about its tangent [rad/s]. Empty: frames have no inertia (thesis 4.3), which is so
  /// for rods that friction does not turn.
  Eigen::VectorXd spin;
  std::vector<GraspState> grasps;

  /// Integrator memory (empty when the integrator has none, or has not stepped yet).
  double last_step = 0.0;                    ///< [s]
  double next_step = 0.0;                    ///< [s] where the error control left off, 0 = nowhere
  Eigen::Matrix3Xd a;                        ///< accelerations
  Eigen::Matrix3Xd x_previous, v_previous;   ///< multistep methods
  /// Integrator memory of the spins: angular accelerations [rad/s^2]; for multistep methods the spins one step ago
  /// [rad/s], and by how much each edge has turned since then [rad].
  Eigen::VectorXd spin_rate, spin_previous, turn_previous;
  /// With Rayleigh stiffness damping only: per node, then two per grasp, (stretch of the edge after the node, kappa1,
  /// kappa2, twist).
  Eigen::Matrix4Xd strain_rate, strain_rate_previous;   ///< [1/s]
  /// multistep methods: one step ago; a stage inside the step: its strain less the step's chord
  Eigen::Matrix4Xd strain_previous;

  bool framed() const { return d1.cols() > 0; }
  double twistAt(int node) const { return framed() ? twist[node] : 0.0; }

  /// Forgets the integrator's memory: after a grasp was taken or released, or the state was edited.
  void forgetHistory()
  {
    last_step = next_step = 0.0;
    for (auto* m : {&a, &x_previous, &v_previous})
      m->resize(3, 0);
    for (auto* m : {&spin_rate, &spin_previous, &turn_previous})
      m->resize(0);
    for (auto* m : {&strain_rate, &strain_rate_previous, &strain_previous})
      m->resize(4, 0);
  }
};

}   // namespace slender
