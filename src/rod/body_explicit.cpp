// An explicit step of a body together with the nodes that it carries. Rods hand their torques over to it (thesis
// 4.5.3).
#include "body_part.h"

#include "free_rotation.h"
#include "linalg/cholesky6.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

/// Inertia of a point mass.
Eigen::Matrix3d pointInertia(double mass, const Eigen::Vector3d& r)
{
  return mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
}

}   // namespace

/// Calls apply(carried, grasp) for each grasp that the body carries now.
template <class Do>
void BodyPart::forCarried(const Do& apply) const
{
  for (const Carried& carried : carried_)
    if (const GraspState& g = carried.rod->work.grasps[carried.grasp]; g.active)
      apply(carried, g);
}

/// Mass, inertia and motion at the start of the substep of the body with the nodes that it carries.
void BodyPart::compose()
{
  const RigidBodyModel& m = system.model();
  whole_.mass = m.mass;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = m.inertia;   // about the body's own centre of mass so far
  forCarried([&](const Carried& carried, const GraspState& g) {
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const double mass = carried.rod->model->mass[i];
      const Eigen::Vector3d r = carried.X_BG * g.nodes_G[i - g.first_node];
      whole_.mass += mass;
      moment += mass * r;
      inertia += pointInertia(mass, r);
    }
  });
  centre_ = moment / whole_.mass;
  whole_.inertia = inertia - pointInertia(whole_.mass, centre_);
  const Eigen::Vector3d arm = now_.X_WB.orientation * centre_;
  whole_.start = {now_.X_WB.position + arm, now_.X_WB.orientation};
  whole_.velocity = {now_.velocity.linear + now_.velocity.angular.cross(arm), now_.velocity.angular};
}

/// Of the body itself, and of what it carries; torques about the common centre of mass.
void BodyPart::addForces(Eigen::Vector3d& force, Eigen::Vector3d& torque) const
{
  const RigidBodyModel& m = system.model();
  const Eigen::Vector3d& centre = whole_.start.position;
  force = m.force;
  torque = m.torque;
  if (m.gravity)
    force += m.mass * gravity;
  torque += (now_.X_WB.position - centre).cross(force);
  forCarried([&](const Carried& carried, const GraspState& g) {
    const RodWork& rod = *carried.rod;
    const Wrench& wrench = rod.wrenches[carried.grasp];
    force += wrench.force;
    torque += wrench.torque + (g.X_WG.position - centre).cross(wrench.force);
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d drag = -rod.model->damping(i) * rod.work.v.col(i);
      force += drag;
      torque += (rod.work.x.col(i) - centre).cross(drag);
    }
  });
}

/// Damping of the body alone, about its own centre of mass, by the velocity at the end of the substep; the nodes have
/// their own.
void BodyPart::damp(double h, Eigen::Vector3d& momentum)
{
  const RigidBodyModel& m = system.model();
  const double k = h * m.linear_damping * m.mass;
  const Eigen::Matrix3d r = whole_.start.orientation.toRotationMatrix(),
                        arm = skew(now_.X_WB.position - whole_.start.position);
  const Eigen::Matrix3d own = h * m.angular_damping * (r * m.inertia * r.transpose()) - k * arm * arm;
  BodySystem::Matrix6 matrix;
  matrix << (whole_.mass + k) * Eigen::Matrix3d::Identity(), -k * arm, k * arm,
      r * whole_.inertia * r.transpose() + own;
  BodySystem::Vector6 end;
  end << whole_.mass * whole_.velocity.linear, momentum;
  Cholesky6 factor;
  factor.compute(matrix);   // a body has mass, so the matrix is positive definite
  factor.solveInPlace(end);
  whole_.velocity.linear = end.head<3>();
  momentum -= k * arm * whole_.velocity.linear + own * Eigen::Vector3d(end.tail<3>());
}

/// The centre moves by symplectic Euler. The angular momentum advances in the same way, and then the body turns as a
/// free body with this momentum does.
StepFailure BodyPart::predict(const Substep& substep, StepReport&)
{
  const double h = substep.length;
  compose();
  Eigen::Vector3d force, torque;
  addForces(force, torque);
  const Eigen::Quaterniond& q = whole_.start.orientation;
  Twist& v = whole_.velocity;
  Eigen::Vector3d momentum = q * (whole_.inertia * (q.conjugate() * v.angular)) + h * torque;
  v.linear += h / whole_.mass * force;
  if (system.model().linear_damping > 0 || system.model().angular_damping > 0)
    damp(h, momentum);
  whole_.pose = {whole_.start.position + h * v.linear, rotateFreely(whole_.inertia, q, momentum, h)};
  v.angular = angularVelocity(whole_.inertia, whole_.pose.orientation, momentum);
  return place(whole_);
}

/// Takes over the motion at the end of the substep.
StepFailure BodyPart::place(const ProjectedBody& whole)
{
  const Eigen::Vector3d arm = whole.pose.orientation * centre_;
  next_.X_WB = {whole.pose.position - arm, whole.pose.orientation};
  next_.velocity = {whole.velocity.linear - whole.velocity.angular.cross(arm), whole.velocity.angular};
  system.load(next_);   // rods follow it
  const bool finite = next_.X_WB.position.allFinite() && next_.X_WB.orientation.coeffs().allFinite() &&
                      next_.velocity.linear.allFinite() && next_.velocity.angular.allFinite();
  return finite ? StepFailure::none : StepFailure::state_not_finite;
}

bool BodyPart::addTo(FastProjection& projection)
{
  number_ = projection.addBody();
  return false;
}

void BodyPart::giveTo(FastProjection& projection, bool at_start)
{
  if (at_start)
    compose();
  projection.body(number_) = whole_;
  if (at_start)
    projection.body(number_).pose = whole_.start;
}

StepFailure BodyPart::takeFrom(FastProjection& projection, const ProjectionReport& result, bool at_start)
{
  if (!result.ok)
    return StepFailure::none;
  const ProjectedBody& moved = projection.body(number_);
  if (!at_start)
    return place(moved);
  now_.X_WB = {moved.pose.position - moved.pose.orientation * centre_, moved.pose.orientation};
  return StepFailure::none;
}

}   // namespace slender
