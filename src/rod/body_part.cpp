#include "body_part.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/geometry/rotation.h"

namespace slender {

void BodyPart::retreat(double share)
{
  const Pose &base = system.base(), &trial = system.pose;
  BodySystem::Vector6 way;
  way << trial.position - base.position, rotationVector(trial.orientation * base.orientation.conjugate());
  system.moveAlong(way, share);
}

void BodyPart::evaluate(bool with_hessian, const HessianShift& shift)
{
  system.evaluate(with_hessian);
  evaluation = {};
  evaluation.potential = system.energy();
  if (coupled)
    return;
  addOwnContacts(with_hessian);
  if (!with_hessian)
    return;
  system.addShift(shift);
  evaluation.inertia.negative = !factor_.compute(system.hessian);
}

/// Contacts with what moves as prescribed. The curvature of the turn is left out: it is g h^2 / r of the inertia.
void BodyPart::addOwnContacts(bool with_hessian)
{
  using Rows = Eigen::Matrix<double, 3, 6>;
  const auto displacement = [this](const Eigen::Vector3d& at) {
    Rows rows;
    rows << Eigen::Matrix3d::Identity(), -skew(at - system.pose.position);
    return rows;
  };
  for (const ContactTerm* term : own_terms)
  {
    Rows rows = Rows::Zero();
    if (term->carried)
      rows = displacement(term->position);
    for (int p = 0; p < 4 && !term->carried; ++p)
      if (term->point[p] >= 0)
        rows += term->weight[p] * displacement(position(term->point[p] - first_point));
    system.gradient -= rows.transpose() * term->force;
    if (with_hessian)
      system.hessian += rows.transpose() * term->stiffness * rows;
  }
  for (const ContactRow* contact : own_rows)
  {
    BodySystem::Vector6 row = BodySystem::Vector6::Zero();
    for (int p = 0; p < 4; ++p)
      if (contact->point[p] >= 0)
        row +=
            contact->along[p] * displacement(position(contact->point[p] - first_point)).transpose() * contact->normal;
    if (with_hessian)
      system.hessian += contact->stiffness * row * row.transpose();
  }
}

// ---- statics

StaticScales BodyPart::scales() const
{
  StaticScales result;
  result.mass = system.model().mass;
  return result;
}

void BodyPart::weighDirection()
{
  const Eigen::Matrix3d r = system.pose.orientation.toRotationMatrix();
  system.gradient << -system.model().mass * direction.head<3>(),
      -r * system.model().inertia * r.transpose() * direction.tail<3>();
}

// ---- the surface

void BodyPart::gather(Eigen::Matrix3Xd& x) const
{
  for (int i = 0; i < points(); ++i)
    x.col(first_point + i) = position(i);
}

Eigen::Matrix3Xd BodyPart::surfaceAt(const Pose& pose) const
{
  Eigen::Matrix3Xd x(3, points());
  for (int i = 0; i < points(); ++i)
    x.col(i) = pose * Eigen::Vector3d(surface_.points.col(i));
  return x;
}

Eigen::Vector3d BodyPart::moveAt(const Eigen::Vector3d& position) const
{
  return direction.head<3>() + direction.tail<3>().cross(position - system.pose.position);
}

/// Its pieces touch solids alone: rods, threads and cloths touch the solid of the body.
void BodyPart::addSurface(ContactSurface& surface) const
{
  if (!hasSurface())
    return;
  const int first = surface.points, object = static_cast<int>(surface.objects.size());
  for (const BodySurface::Segment& s : surface_.segments)
    surface.segments.push_back({first + s.a, first + s.b, s.radius, object, 0.0, 0.0});
  for (const std::array<int, 3>& t : surface_.triangles)
    surface.triangles.push_back({{first + t[0], first + t[1], first + t[2]}, surface_.radius, object, 0});
  surface.points += points();
  ContactObject own;
  own.first_point = first;
  own.self = own.others = false;
  own.friction = friction_;
  own.carrier = carrier_;
  surface.objects.push_back(own);
}

// ---- the matrix of the island

void BodyPart::notePattern(SharedMatrix& matrix)
{
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j)
      matrix.note(offset + i, offset + j);
}

void BodyPart::addHessian(SharedMatrix& matrix, const HessianShift& shift)
{
  system.addShift(shift);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j)
      matrix.add(offset + i, offset + j, system.hessian(i, j));
}

void BodyPart::takeGradient(double* right) const { Eigen::Map<BodySystem::Vector6>(right + offset) = -system.gradient; }

void BodyPart::takeDirection(const double* solution)
{
  direction = Eigen::Map<const BodySystem::Vector6>(solution + offset);
}

void BodyPart::addColumnsAt(const Eigen::Vector3d& position, int component, double weight, Columns& row) const
{
  const Eigen::Vector3d r = position - system.pose.position;
  // (turn x r)_c = turn_next r_after - turn_after r_next
  const int next = (component + 1) % 3, after = (component + 2) % 3;
  row.push(offset + component, weight);
  row.push(offset + 3 + next, weight * r[after]);
  row.push(offset + 3 + after, -weight * r[next]);
}

void BodyPart::addForceAt(const Eigen::Vector3d& position, const Eigen::Vector3d& force)
{
  system.gradient.head<3>() -= force;
  system.gradient.tail<3>() -= (position - system.pose.position).cross(force);
}

double BodyPart::stepLimit() const
{
  constexpr double kMostTurn = 0.7;   // [rad] of a step of Newton's method, as of edges
  return kMostTurn / std::max(kMostTurn, direction.tail<3>().norm());
}

double BodyPart::incrementSize(double length) const
{
  return std::max(direction.head<3>().lpNorm<Eigen::Infinity>() / length,
                  direction.tail<3>().lpNorm<Eigen::Infinity>());
}

double BodyPart::residual() const
{
  const RigidBodyModel& m = system.model();
  return std::max(system.gradient.head<3>().lpNorm<Eigen::Infinity>(),
                  system.gradient.tail<3>().lpNorm<Eigen::Infinity>() * std::sqrt(m.mass / m.inertia.trace()));
}

Largest BodyPart::unbalancedForce() const
{
  Largest force;
  force.add(0, residual());
  return force;
}

double BodyPart::forceScale() const { return system.model().mass * gravity.norm() + system.model().force.norm(); }

// ---- steps

void BodyPart::begin(const RigidBodyState& state, const Eigen::Vector3d& step_gravity)
{
  now_ = next_ = state;
  gravity = step_gravity;
}

/// Friction needs the turn of a body in a substep. Two poses tell it only if it is less than half a turn.
double BodyPart::longestSubstep(double duration) const
{
  constexpr double kMostTurn = 2.0;   // [rad]
  const double rate = now_.velocity.angular.norm();
  return hasSurface() && friction_ > 0.0 && rate * duration > kMostTurn ? kMostTurn / rate : duration;
}

StepFailure BodyPart::beginSubstep(const StepPlan& plan, const Substep& substep)
{
  plan_ = &plan;
  length_ = substep.length;
  system.load(now_);
  start_wrench_.setZero();
  start_inertia_.setZero();
  return StepFailure::none;
}

BoundingBox BodyPart::surfaceBox(double ahead) const
{
  BoundingBox box = BoundingBox::empty();
  if (reach_ < 0.0)
    return box;
  box.include(now_.X_WB.position + ahead * now_.velocity.linear);
  box.enlarge(reach_);
  return box;
}

/// A body may come to rest with its weight on few contacts. A barrier that is much softer holds it at gaps so small
/// that Newton's method needs many iterations.
BarrierRange BodyPart::barrierRange(double) const
{
  constexpr double kAcceleration = 10.0;   // [m/s^2]
  BarrierRange range;
  if (reach_ >= 0.0)
    range.least = system.model().mass * kAcceleration;
  return range;
}

void BodyPart::addStartLoad(const BodySystem::Vector6& wrench, const BodySystem::Matrix6& inertia)
{
  start_wrench_ += wrench;
  start_inertia_ += inertia;
}

void BodyPart::solveStartAcceleration()
{
  const RigidBodyModel& m = system.model();
  start_wrench_.head<3>() += m.force - m.linear_damping * m.mass * system.velocity().linear;
  if (m.gravity)
    start_wrench_.head<3>() += m.mass * gravity;
  start_acceleration_ = system.startAcceleration(start_wrench_, start_inertia_);
}

void BodyPart::beginStage(std::size_t stage)
{
  if (stage == 0)
  {
    compose();
    system.setWhole(centre_, whole_.inertia);
  }
  system.beginStage(*plan_, stage, length_, gravity);
}

void BodyPart::endStage(std::size_t stage, bool last, StepReport& report)
{
  system.accept();
  system.endStage(plan_->stages[stage], last);
  if (!last)
    return;
  system.finishStep(*plan_, next_);
  next_.last_step = length_;
  report.error_estimate =
      std::max(report.error_estimate, system.localError(*plan_, length_, std::max(reach_, gyration()), next_));
}

double BodyPart::gyration() const { return std::sqrt(0.5 * system.model().inertia.trace() / system.model().mass); }

double BodyPart::energyOf(const RigidBodyState& s) const
{
  const RigidBodyModel& m = system.model();
  const Eigen::Vector3d w = s.X_WB.orientation.conjugate() * s.velocity.angular;
  return 0.5 * m.mass * s.velocity.linear.squaredNorm() + 0.5 * w.dot(m.inertia * w) - m.force.dot(s.X_WB.position) -
         (m.gravity ? m.mass * gravity.dot(s.X_WB.position) : 0.0);
}

/// The allowed growth is a share of the kinetic energy, and of the work of the forces along the radius of gyration. It
/// does not depend on where the origin of coordinates is.
double BodyPart::energyAtStart(double& allowance)
{
  const RigidBodyModel& m = system.model();
  const Eigen::Vector3d force = m.force + (m.gravity ? Eigen::Vector3d(m.mass * gravity) : Eigen::Vector3d::Zero());
  const double energy = energyOf(now_);
  allowance += 0.05 * (energy + force.dot(now_.X_WB.position) + force.norm() * gyration());
  return energy;
}

void BodyPart::refuse(StepFailure failure, double length, StepReport& report) const
{
  const bool squeezed = failure == StepFailure::squeezed;
  report.refuse(failure, "body '" + system.model().name + "': " +
                             (squeezed                              ? "what it touches leaves it no room"
                              : failure == StepFailure::energy_grew ? "energy of the parts that it is stepped with grew"
                                                                    : "its motion was not found") +
                             " at a step of " + milliseconds(length) + ": use a shorter step" +
                             (squeezed ? ", or slow down what is driven" : ""));
}

}   // namespace slender
