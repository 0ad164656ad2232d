#pragma once

#include <Eigen/Core>

#include "slender_sim/rod/rod_model.h"

namespace slender {

/// What a rod's cross-sections carry at one instant, for tables. Everything follows from the state alone.
///
/// The internal force F of an edge and the internal moment M of a joint act from the part of the rod with the higher
/// indices on the part with the lower ones. The gradient of the elastic energy by the edge vector e_j is F_j, and M_i
/// is the derivative of the joint's energy by a rigid rotation of what follows it. So both balance exactly: the sum of
/// the forces on node i is F_i - F_(i-1), and M_(i+1) - M_i + e_i x F_i = 0 wherever the frames are in equilibrium.
/// Rayleigh stiffness damping is contained in both.
///
/// Columns that the state does not determine are NaN: forces and moments inside a part that one grasp or weld holds as
/// a rigid whole.
struct RodSections
{
  /// per node (kappa1, kappa2) over the joint's length [1/m]: components of the curvature vector along d1 and d2
  Eigen::Matrix2Xd curvature;
  Eigen::VectorXd twist;              ///< per node, twist over the joint's length [rad/m]
  Eigen::VectorXd strain;             ///< per edge: (length - rest length) / rest length [-]
  Eigen::Matrix3Xd force;             ///< per edge, world axes [N]
  Eigen::VectorXd tension;            ///< per edge: the force's component along the edge [N]
  Eigen::Matrix3Xd moment;            ///< per node, world axes [N m]
  Eigen::Matrix3Xd material_moment;   ///< per node, about the tangent, d1 and d2 of the section [N m]
};

/// At a clamped section the values are those of the half joint between the section and the free edge after it (before
/// it at the end of a rod). A free or pinned end carries no moment and has its natural curvature.
RodSections sectionsOf(const RodModel& model, const RodState& state);

}   // namespace slender
