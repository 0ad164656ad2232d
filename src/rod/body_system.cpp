#include "body_system.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "linalg/cholesky6.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

void checkBody(const BodyProperties& b)
{
  const auto refuse = [&](const std::string& why) { throw std::invalid_argument("body " + b.name + ": " + why); };
  if (!(b.mass > 0) || !std::isfinite(b.mass))
    refuse("mass = " + std::to_string(b.mass) + " kg; must be greater than 0");
  if (!b.inertia.allFinite() || (b.inertia - b.inertia.transpose()).norm() > 1e-9 * b.inertia.norm())
    refuse("inertia must be finite and symmetric");
  const Eigen::Vector3d m = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(b.inertia).eigenvalues();
  if (!(m[0] > 0))
    refuse("its smallest principal moment of inertia is " + std::to_string(m[0]) + " kg m^2; must be greater than 0");
  if (m[0] + m[1] < m[2] * (1 - 1e-6))
    refuse("principal moments of inertia " + std::to_string(m[0]) + ", " + std::to_string(m[1]) + " and " +
           std::to_string(m[2]) + " kg m^2: no body has a moment greater than the sum of the other two");
  if (!b.force.allFinite() || !b.torque.allFinite())
    refuse("force and torque must be finite");
  if (!(b.linear_damping >= 0) || !(b.angular_damping >= 0))
    refuse("damping must not be negative");
}

BodySystem::BodySystem(const RigidBodyModel& model)
  : model_(model),
    moment_(0.5 * model.inertia.trace() * Eigen::Matrix3d::Identity() - model.inertia)
{
}

void BodySystem::load(const RigidBodyState& s)
{
  base_ = pose = s.X_WB;
  start_ = s.X_WB.orientation;
  velocity_ = s.velocity;
  acceleration_ = s.last_step > 0.0 ? Twist{s.linear_acceleration, s.angular_acceleration} : Twist{};
  const Eigen::Vector3d previous = rotationVector(s.X_previous.orientation * start_.conjugate());
  history_[kQ] = {s.X_WB.position, Eigen::Vector3d::Zero()};
  history_[kV] = {s.velocity.linear, s.velocity.angular};
  history_[kA] = {s.linear_acceleration, s.angular_acceleration};
  history_[kQPrevious] = {s.X_previous.position, previous};
  history_[kVPrevious] = {s.velocity_previous.linear, rotationRate(previous).inverse() * s.velocity_previous.angular};
}

BodySystem::Vector6 BodySystem::startAcceleration(const Vector6& wrench, const Matrix6& extra)
{
  const Eigen::Matrix3d r = start_.toRotationMatrix(), i_world = r * model_.inertia * r.transpose();
  const Eigen::Vector3d w = velocity_.angular;
  Matrix6 inertia = extra;
  inertia.topLeftCorner<3, 3>() += model_.mass * Eigen::Matrix3d::Identity();
  inertia.bottomRightCorner<3, 3>() += i_world;
  Vector6 load = wrench;
  load.tail<3>() += model_.torque - w.cross(i_world * w);
  Cholesky6 factor;
  factor.compute(inertia);   // a body has mass, so the matrix is positive definite
  Vector6 a = load;
  factor.solveInPlace(a);
  acceleration_ = {a.head<3>(), a.tail<3>()};
  history_[kA] = {a.head<3>(), a.tail<3>()};
  return a;
}

BodySystem::Motion BodySystem::combine(const Combination& c) const
{
  Motion sum{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int k = 0; k < kHistoryCount; ++k)
    if (c[k] != 0)
    {
      sum.x += c[k] * history_[k].x;
      sum.r += c[k] * history_[k].r;
    }
  return sum;
}

Eigen::Vector3d BodySystem::turnFromStart() const { return rotationVector(pose.orientation * start_.conjugate()); }

void BodySystem::beginStage(const StepPlan& plan, std::size_t index, double h, const Eigen::Vector3d& gravity)
{
  const Stage& stage = plan.stages[index];
  // predictor: the motion carried on
  const double ahead = index == 0 ? stage.time * h : (stage.time - plan.stages[0].time) * h;
  const Eigen::Vector3d w = velocity_.angular + ahead * acceleration_.angular;
  pose.position = base_.position + ahead * velocity_.linear + 0.5 * ahead * ahead * acceleration_.linear;
  pose.orientation = (fromRotationVector(0.5 * ahead * (velocity_.angular + w)) * base_.orientation).normalized();

  const Motion hat = combine(stage.q_hat), tilde = combine(stage.q_tilde);
  const double square = stage.tau_a * stage.tau_a;
  const auto rotation = [&](const Eigen::Vector3d& r) { return (fromRotationVector(r) * start_).toRotationMatrix(); };
  inertia_target_ = hat.x;
  inertia_rotation_ = rotation(hat.r) - square * skew(w) * skew(w) * pose.orientation.toRotationMatrix();
  damping_target_ = tilde.x;
  damping_rotation_ = rotation(tilde.r);
  const double inertia = 1.0 / square, linear = model_.linear_damping / stage.tau_v,
               angular = model_.angular_damping / stage.tau_v;
  weight_ = model_.mass * (inertia + linear);
  target_ = (inertia * inertia_target_ + linear * damping_target_) / (inertia + linear);
  rotation_weight_ = inertia + angular;
  rotation_target_ = (inertia * inertia_rotation_ + angular * damping_rotation_) / (inertia + angular);
  force_ = model_.force + (model_.gravity ? Eigen::Vector3d(model_.mass * gravity) : Eigen::Vector3d::Zero());
}

void BodySystem::hold(double weight, const Eigen::Vector3d& gravity)
{
  weight_ = weight * model_.mass;
  rotation_weight_ = weight;
  target_ = pose.position;
  rotation_target_ = pose.orientation.toRotationMatrix();
  force_ = model_.force + (model_.gravity ? Eigen::Vector3d(model_.mass * gravity) : Eigen::Vector3d::Zero());
}

void BodySystem::evaluate(bool with_hessian)
{
  const Eigen::Matrix3d r = pose.orientation.toRotationMatrix();
  const Eigen::Vector3d d = pose.position - target_;
  const Eigen::Matrix3d difference = r - rotation_target_;
  energy_ = 0.5 * weight_ * d.squaredNorm() +
            0.5 * rotation_weight_ * (difference * moment_ * difference.transpose()).trace() -
            force_.dot(pose.position);
  // -tr(R^ J R^T exp(-[turn])) to second order in the turn
  const Eigen::Matrix3d c = rotation_target_ * moment_ * r.transpose();
  gradient.head<3>() = weight_ * d - force_;
  gradient.tail<3>() =
      rotation_weight_ * Eigen::Vector3d(c(1, 2) - c(2, 1), c(2, 0) - c(0, 2), c(0, 1) - c(1, 0)) - model_.torque;
  if (!with_hessian)
    return;
  hessian.setZero();
  hessian.topLeftCorner<3, 3>().diagonal().setConstant(weight_);
  hessian.bottomRightCorner<3, 3>() =
      rotation_weight_ * (c.trace() * Eigen::Matrix3d::Identity() - 0.5 * (c + c.transpose()));
}

void BodySystem::addShift(const HessianShift& shift)
{
  if (shift.position == 0)
    return;
  hessian.topLeftCorner<3, 3>().diagonal().array() += shift.position * weight_;
  hessian.bottomRightCorner<3, 3>().diagonal().array() += shift.position * rotation_weight_ * model_.inertia.trace();
}

void BodySystem::moveAlong(const Vector6& direction, double alpha)
{
  if (alpha == 0.0)   // whatever the direction is, which may be that of an attempt that overflowed
  {
    pose = base_;
    return;
  }
  pose.position = base_.position + alpha * direction.head<3>();
  pose.orientation = (fromRotationVector(alpha * direction.tail<3>()) * base_.orientation).normalized();
}

void BodySystem::endStage(const Stage& stage, bool last)
{
  const Motion tilde = combine(stage.q_tilde), hat = combine(stage.q_hat);
  const Eigen::Vector3d turn = turnFromStart(), rate = (turn - tilde.r) / stage.tau_v;
  const double square = stage.tau_a * stage.tau_a;
  velocity_ = {(pose.position - tilde.x) / stage.tau_v, rotationRate(turn) * rate};
  acceleration_ = {(pose.position - hat.x) / square, rotationRate(turn) * (turn - hat.r) / square};
  if (last)
    return;
  history_[kQStage] = {pose.position, turn};
  history_[kVStage] = {velocity_.linear, rate};
}

void BodySystem::finishStep(const StepPlan& plan, RigidBodyState& next)
{
  const Stage& stage = plan.stages.back();
  const double c = plan.fraction;
  const Motion hat = combine(stage.q_hat), tilde = combine(stage.q_tilde);
  const double square = stage.tau_a * stage.tau_a;
  const auto carriedOn = [](const Eigen::Vector3d& from, const Eigen::Vector3d& to, double share) {
    return Eigen::Vector3d(from + (to - from) / share);
  };
  Eigen::Vector3d turn = turnFromStart(), rate = (turn - tilde.r) / stage.tau_v, turn_rate = (turn - hat.r) / square;
  if (c != 1.0)
  {
    // the stage lies inside the step
    rate = carriedOn(history_[kV].r, rate, c);
    turn /= c;
    pose.position = carriedOn(history_[kQ].x, pose.position, c);
    pose.orientation = (fromRotationVector(turn) * start_).normalized();
    velocity_.linear = carriedOn(history_[kV].x, velocity_.linear, c);
    velocity_.angular = rotationRate(turn) * rate;
  }
  next.linear_acceleration = carriedOn(history_[kA].x, acceleration_.linear, plan.a_fraction);
  next.angular_acceleration = rotationRate(turn) * carriedOn(history_[kA].r, turn_rate, plan.a_fraction);
  next.X_previous = {history_[kQ].x, start_};
  next.velocity_previous = {history_[kV].x, history_[kV].r};
  next.X_WB = pose;
  next.velocity = velocity_;
}

double BodySystem::localError(const StepPlan& plan, double h, double reach, const RigidBodyState& next) const
{
  const double before = order(plan.integrator) == 2 ? 1.0 : 0.0;
  return errorConstant(plan.integrator) * h * h *
         ((next.linear_acceleration - before * history_[kA].x).norm() +
          reach * (next.angular_acceleration - before * history_[kA].r).norm());
}

}   // namespace slender
