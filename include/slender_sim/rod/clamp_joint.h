#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/energy/chain_term.h"

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

/// The clamps of a rod. Frames of their sections are transported from a base like those of the edges.
class ClampJoints final : public ChainTerm
{
public:
  explicit ClampJoints(Curvature curvature) : curvature_(curvature) {}

  std::vector<ClampJoint> joints;

  void add(const ChainRange& range, RodEvaluation& sum) override;
  void accept() override;
  void saveBase() override { saved_ = joints; }
  void restoreBase() override { joints = saved_; }

private:
  void evaluate(ClampJoint& clamp, const ChainRange& range, RodEvaluation& sum) const;

  Curvature curvature_;
  std::vector<ClampJoint> saved_;
};

}   // namespace slender
