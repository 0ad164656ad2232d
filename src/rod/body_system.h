#pragma once

#include <array>

#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/rod/rigid_body.h"

namespace slender {

/// Equations of one rigid body in a stage of an implicit step. The integrator acts on the centre and on the rotation
/// vector from the orientation at the start of the step, so every method keeps its order. A stage minimises, over
/// rotations R,
///   1/2 m |p - p^|^2 + 1/2 tr((R - R^) J (R - R^)^T), J the second moment of the mass,
/// as if the body were a set of points x = p + R r that follow targets x^ = p^ + R^ r; R^ includes the centripetal
/// acceleration. Unknowns: displacement and turn (world axes) from the base pose.
///
/// Implicit Euler differs. Its p^ and R^ are where the body, together with the points that it carries, would be at the
/// end of the step without forces. The torque of everything else changes the angular momentum, and the velocity follows
/// from the momentum, which a finite difference of the rotation would not keep.
class BodySystem
{
public:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  explicit BodySystem(const RigidBodyModel& model);
  const RigidBodyModel& model() const { return model_; }

  void load(const RigidBodyState& state);
  /// Accelerations at the start of a run, from the force and torque (about the centre) of everything attached and its
  /// extra mass.
  Vector6 startAcceleration(const Vector6& wrench, const Matrix6& extra_inertia);

  /// Centre of mass (body axes), and inertia about it, of the body with the points that it carries.
  void setWhole(const Eigen::Vector3d& centre, const Eigen::Matrix3d& inertia);
  void beginStage(const StepPlan& plan, std::size_t stage, double h, const Eigen::Vector3d& gravity);
  /// Targets x^ (of inertia) and x~ (of damping) of a point that goes with the body; r in body axes.
  Eigen::Vector3d inertiaTarget(const Eigen::Vector3d& r) const { return inertia_target_ + inertia_rotation_ * r; }
  Eigen::Vector3d dampingTarget(const Eigen::Vector3d& r) const { return damping_target_ + damping_rotation_ * r; }
  /// In place of a stage, for statics: inertia of `weight` [1/s^2] times the mass holds the body where it is now.
  void hold(double weight, const Eigen::Vector3d& gravity);
  /// Takes over the stage's solution.
  void endStage(const Stage& stage, bool last);
  void finishStep(const StepPlan& plan, RigidBodyState& next);
  /// Estimated error [m] of the step of h seconds that ended in `next`, as far as `reach` [m] from the centre.
  double localError(const StepPlan& plan, double h, double reach, const RigidBodyState& next) const;
  /// Of the last stage begun and ended.
  const Twist& velocity() const { return velocity_; }

  double energy() const { return energy_; }
  void evaluate(bool with_hessian);
  void moveAlong(const Vector6& direction, double alpha);
  void accept() { base_ = pose; }
  void saveBase() { saved_ = base_; }
  void restoreBase() { base_ = saved_; }
  const Pose& base() const { return base_; }
  void addShift(const HessianShift& shift);

  Pose pose;   ///< trial
  Vector6 gradient = Vector6::Zero();
  Matrix6 hessian = Matrix6::Zero();

private:
  /// centre, and rotation vector from the orientation at the start of the step
  struct Motion
  {
    Eigen::Vector3d x, r;
  };
  Motion combine(const Combination& c) const;
  Eigen::Vector3d turnFromStart() const;
  Eigen::Vector3d momentum(const Eigen::Quaterniond& q, const Eigen::Vector3d& w) const;
  void moveFreely(double h);
  void aimAhead(const Stage& stage, const Eigen::Vector3d& w);
  void advanceMomentum(double h);
  void carryOn(const StepPlan& plan);

  const RigidBodyModel& model_;
  Eigen::Matrix3d moment_;   ///< J, body axes
  std::array<Motion, kHistoryCount> history_;
  Eigen::Quaterniond start_;
  double last_step_ = 0;   ///< 0: there is no state before
  Eigen::Quaterniond previous_orientation_;
  Eigen::Vector3d previous_w_;
  Pose base_, saved_;
  Twist velocity_, acceleration_;   ///< where the last stage ended
  double energy_ = 0, weight_ = 0, rotation_weight_ = 0;
  bool by_momentum_ = false;        ///< in this stage
  Eigen::Vector3d whole_centre_;    ///< of the body with what it carries, body axes
  Eigen::Matrix3d whole_inertia_;   ///< about this centre
  Eigen::Vector3d target_, force_;
  Eigen::Matrix3d rotation_target_;
  Eigen::Vector3d inertia_target_, damping_target_;       ///< p^, p~
  Eigen::Matrix3d inertia_rotation_, damping_rotation_;   ///< R^, R~
};

}   // namespace slender
