#include "body_system.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "free_rotation.h"
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

namespace {

/// The first step of bdf2 is one of implicit Euler, too.
bool isImplicitEuler(const StepPlan& plan, double h)
{
  return plan.stages.size() == 1 && plan.fraction == 1.0 && plan.stages[0].tau_a == h && plan.stages[0].tau_v == h;
}

/// Second moment of the mass of a body with this inertia.
Eigen::Matrix3d secondMoment(const Eigen::Matrix3d& inertia)
{
  return 0.5 * inertia.trace() * Eigen::Matrix3d::Identity() - inertia;
}

/// Twice the axial vector of the antisymmetric part of c.
Eigen::Vector3d axialVector(const Eigen::Matrix3d& c)
{
  return {c(1, 2) - c(2, 1), c(2, 0) - c(0, 2), c(0, 1) - c(1, 0)};
}

}   // namespace

BodySystem::BodySystem(const RigidBodyModel& model)
  : model_(model),
    moment_(secondMoment(model.inertia)),
    whole_centre_(Eigen::Vector3d::Zero()),
    whole_inertia_(model.inertia)
{
}

void BodySystem::load(const RigidBodyState& s)
{
  base_ = pose = s.X_WB;
  start_ = s.X_WB.orientation;
  velocity_ = s.velocity;
  acceleration_ = s.last_step > 0.0 ? Twist{s.linear_acceleration, s.angular_acceleration} : Twist{};
  last_step_ = s.last_step;
  previous_orientation_ = s.X_previous.orientation;
  previous_w_ = s.velocity_previous.angular;
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
  load.tail<3>() += model_.torque - model_.angular_damping * (i_world * w) - w.cross(i_world * w);
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

Eigen::Vector3d BodySystem::momentum(const Eigen::Quaterniond& q, const Eigen::Vector3d& w) const
{
  return q * (whole_inertia_ * (q.conjugate() * w));
}

Eigen::Vector3d BodySystem::turnFromStart() const { return rotationVector(pose.orientation * start_.conjugate()); }

void BodySystem::setWhole(const Eigen::Vector3d& centre, const Eigen::Matrix3d& inertia)
{
  whole_centre_ = centre;
  whole_inertia_ = inertia;
}

void BodySystem::beginStage(const StepPlan& plan, std::size_t index, double h, const Eigen::Vector3d& gravity)
{
  const Stage& stage = plan.stages[index];
  by_momentum_ = isImplicitEuler(plan, h);
  // first trial: the motion carried on
  const double ahead = index == 0 ? stage.time * h : (stage.time - plan.stages[0].time) * h;
  const double c = model_.angular_damping;
  // Damping is computed with the new velocity. With the present one, strong damping would reverse the motion.
  const Eigen::Vector3d w =
      (velocity_.angular + ahead * (acceleration_.angular + c * velocity_.angular)) / (1.0 + ahead * c);
  pose.position = base_.position + ahead * velocity_.linear + 0.5 * ahead * ahead * acceleration_.linear;
  pose.orientation = (fromRotationVector(0.5 * ahead * (velocity_.angular + w)) * base_.orientation).normalized();

  const Motion tilde = combine(stage.q_tilde);
  damping_target_ = tilde.x;
  damping_rotation_ = (fromRotationVector(tilde.r) * start_).toRotationMatrix();
  if (by_momentum_)
    moveFreely(h);
  else
    aimAhead(stage, w);
  const double inertia = 1.0 / (stage.tau_a * stage.tau_a), linear = model_.linear_damping / stage.tau_v,
               angular = model_.angular_damping / stage.tau_v;
  weight_ = model_.mass * (inertia + linear);
  target_ = (inertia * inertia_target_ + linear * damping_target_) / (inertia + linear);
  rotation_weight_ = inertia + angular;
  rotation_target_ = (inertia * inertia_rotation_ + angular * damping_rotation_) / (inertia + angular);
  force_ = model_.force + (model_.gravity ? Eigen::Vector3d(model_.mass * gravity) : Eigen::Vector3d::Zero());
}

/// The targets of implicit Euler: where the body, with what it carries, would be after h seconds without forces. Its
/// angular momentum is kept then. The first trial assumes the torque of the last step.
void BodySystem::moveFreely(double h)
{
  const Eigen::Vector3d arm = start_ * whole_centre_, start = momentum(start_, history_[kV].r);
  pose.orientation = rotateFreely(whole_inertia_, start_, start, h);
  inertia_rotation_ = pose.orientation.toRotationMatrix();
  inertia_target_ =
      history_[kQ].x + h * history_[kV].x + arm + h * history_[kV].r.cross(arm) - inertia_rotation_ * whole_centre_;
  if (last_step_ == 0.0)
    return;
  const Eigen::Vector3d torque = (start - momentum(previous_orientation_, previous_w_)) / last_step_;
  const Eigen::Vector3d turn = 0.5 * h * h * angularVelocity(whole_inertia_, pose.orientation, torque);
  pose.orientation = (fromRotationVector(turn) * pose.orientation).normalized();
}

/// The targets of the other methods, by the angular velocity w of the first trial. The target R^ of inertia contains
/// the centripetal acceleration w x (w x r) of points of the body. R~ contains half of it: then (R - R~) / tau_v is the
/// rate at the stage. Without that half it would be the rate tau_v / 2 earlier, and damping would be of first order.
void BodySystem::aimAhead(const Stage& stage, const Eigen::Vector3d& w)
{
  const Motion hat = combine(stage.q_hat);
  const Eigen::Matrix3d centripetal = skew(w) * skew(w) * pose.orientation.toRotationMatrix();
  inertia_target_ = hat.x;
  inertia_rotation_ = (fromRotationVector(hat.r) * start_).toRotationMatrix() - stage.tau_a * stage.tau_a * centripetal;
  damping_rotation_ -= 0.5 * stage.tau_v * stage.tau_v * centripetal;
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
  if (!model_.torque.isZero(0.0))
    energy_ -= model_.torque.dot(turnFromStart());
  // -tr(R^ J R^T exp(-[turn])) to second order in the turn
  const Eigen::Matrix3d c = rotation_target_ * moment_ * r.transpose();
  gradient.head<3>() = weight_ * d - force_;
  gradient.tail<3>() = rotation_weight_ * axialVector(c) - model_.torque;
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
  if (by_momentum_)
    advanceMomentum(stage.tau_a);
  if (last)
    return;
  history_[kQStage] = {pose.position, turn};
  history_[kVStage] = {velocity_.linear, rate};
}

/// The torque of all forces but inertia changes the angular momentum of the body and of what it carries. At the
/// solution it is the opposite of the torque of inertia.
void BodySystem::advanceMomentum(double h)
{
  const Eigen::Matrix3d r = pose.orientation.toRotationMatrix();
  const Eigen::Vector3d turned = axialVector(inertia_rotation_ * secondMoment(whole_inertia_) * r.transpose());
  const Eigen::Vector3d start = momentum(start_, history_[kV].r);
  const Eigen::Vector3d before = start_ * whole_centre_, after = r * whole_centre_;
  velocity_.angular = angularVelocity(whole_inertia_, pose.orientation, start + turned / h);
  velocity_.linear = (pose.position + after - history_[kQ].x - before) / h - velocity_.angular.cross(after);
  acceleration_ = {(velocity_.linear - history_[kV].x) / h, (velocity_.angular - history_[kV].r) / h};
}

/// Takes the motion on from the stage, which lies inside the step, to the end of the step.
void BodySystem::carryOn(const StepPlan& plan)
{
  const Stage& stage = plan.stages.back();
  const Motion hat = combine(stage.q_hat), tilde = combine(stage.q_tilde);
  const auto carriedOn = [](const Eigen::Vector3d& from, const Eigen::Vector3d& to, double share) {
    return Eigen::Vector3d(from + (to - from) / share);
  };
  Eigen::Vector3d turn = turnFromStart();
  const Eigen::Vector3d rate = carriedOn(history_[kV].r, (turn - tilde.r) / stage.tau_v, plan.fraction),
                        turn_rate = (turn - hat.r) / (stage.tau_a * stage.tau_a);
  turn /= plan.fraction;
  pose.position = carriedOn(history_[kQ].x, pose.position, plan.fraction);
  pose.orientation = (fromRotationVector(turn) * start_).normalized();
  velocity_ = {carriedOn(history_[kV].x, velocity_.linear, plan.fraction), rotationRate(turn) * rate};
  acceleration_ = {carriedOn(history_[kA].x, acceleration_.linear, plan.a_fraction),
                   rotationRate(turn) * carriedOn(history_[kA].r, turn_rate, plan.a_fraction)};
}

void BodySystem::finishStep(const StepPlan& plan, RigidBodyState& next)
{
  if (plan.fraction != 1.0 || plan.a_fraction != 1.0)
    carryOn(plan);
  next.linear_acceleration = acceleration_.linear;
  next.angular_acceleration = acceleration_.angular;
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
