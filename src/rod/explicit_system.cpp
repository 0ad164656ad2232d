#include "explicit_system.h"

#include <algorithm>
#include <cmath>

#include "linalg/cholesky6.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

/// Inertia of a point mass.
Eigen::Matrix3d pointInertia(double mass, const Eigen::Vector3d& r)
{
  return mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
}

/// Angular velocity of a body with this angular momentum.
Eigen::Vector3d spin(const Eigen::Matrix3d& inertia, const Eigen::Quaterniond& q, const Eigen::Vector3d& momentum)
{
  return q * (inertia.inverse() * (q.conjugate() * momentum));
}

}   // namespace

ExplicitSystem::ExplicitSystem(const TimeConfig& time, const std::vector<RodStepper::Impl*>& rods,
                               const std::vector<SimulatedBody>& bodies, std::vector<Weld> welds)
  : time_(time),
    welds_(std::move(welds))
{
  for (RodStepper::Impl* rod : rods)
  {
    const RodModel& m = *rod->model;
    rods_.push_back({rod, m.inextensible ? projection_.addChain(m.rest_length, m.mass, m.closed) : -1, nullptr});
    inextensible_ = inextensible_ || m.inextensible;
  }
  for (const SimulatedBody& added : bodies)
  {
    Body body;
    body.number = added.number;
    body.model = added.model;
    bodies_.push_back(body);
    projection_.addBody();
  }
}

void ExplicitSystem::begin(const std::vector<RigidBodyState>& bodies, const Eigen::Vector3d& gravity)
{
  gravity_ = gravity;
  for (Body& body : bodies_)
    body.now = body.next = bodies[body.number];
}

StepReport ExplicitSystem::step(double duration)
{
  StepReport report;
  duration_ = duration;
  SubstepController controller({duration, 0.0, 0.0, time_.min_step, order(time_.integrator), time_.newton.max_cuts});
  controller.run(*this, duration, report);
  for (const Rod& rod : rods_)
    rod.rod->work.next_step = controller.nextLength();
  return report;
}

void ExplicitSystem::accept(const Substep& substep)
{
  for (const Rod& rod : rods_)
  {
    rod.rod->moveGrasps(*rod.inputs, duration_, substep.to);
    std::swap(rod.rod->work, rod.rod->next);
  }
  for (Body& body : bodies_)
    body.now = body.next;
}

void ExplicitSystem::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  report.ok = false;
  report.failure = failure;
  if (failure == StepFailure::interrupted)
    report.message = kStepInterrupted;
  else if (rods_.empty())
    report.message = "the bodies' motion was not found: use a shorter step";
  else
    rods_[failed_].rod->refuseUnsolved(report, failure, substep.length, true);
}

void ExplicitSystem::end(std::vector<RigidBodyState>& bodies) const
{
  for (const Body& body : bodies_)
    bodies[body.number] = body.now;
}

/// Whether a weld holds now.
bool ExplicitSystem::isWelded(const Weld& weld) const
{
  const std::vector<GraspState>& grasps = rods_[weld.rod].rod->work.grasps;
  return weld.grasp < static_cast<int>(grasps.size()) && grasps[weld.grasp].active &&
         grasps[weld.grasp].body == weld.body;
}

/// Masses of the bodies with the nodes they carry, and where they are now.
void ExplicitSystem::composeBodies()
{
  for (Body& body : bodies_)
  {
    const RigidBodyModel& m = *body.model;
    body.mass = m.mass;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    Eigen::Matrix3d inertia = m.inertia;   // about the body's own centre of mass so far
    for (const Weld& weld : welds_)
      if (weld.body == body.number && isWelded(weld))
      {
        const GraspState& g = rods_[weld.rod].rod->work.grasps[weld.grasp];
        for (int i = g.first_node; i <= g.last_node; ++i)
        {
          const double mass = rods_[weld.rod].rod->model->mass[i];
          const Eigen::Vector3d r = weld.X_BG * g.nodes_G[i - g.first_node];
          body.mass += mass;
          moment += mass * r;
          inertia += pointInertia(mass, r);
        }
      }
    body.centre = moment / body.mass;
    body.inertia = inertia - pointInertia(body.mass, body.centre);
    const RigidBodyState& s = body.now;
    const Eigen::Vector3d arm = s.X_WB.orientation * body.centre;
    body.start = {s.X_WB.position + arm, s.X_WB.orientation};
    body.velocity = {s.velocity.linear + s.velocity.angular.cross(arm), s.velocity.angular};
  }
}

/// Symplectic Euler for the centre; for the rotation the momentum is advanced likewise, and the turn that belongs to it
/// found by the midpoint rule, which keeps the energy of a tumbling body.
void ExplicitSystem::predictBody(Body& body, double h)
{
  const RigidBodyModel& m = *body.model;
  const RigidBodyState& now = body.now;
  Eigen::Vector3d force = m.force, torque = m.torque;
  if (m.gravity)
    force += m.mass * gravity_;
  torque += (now.X_WB.position - body.start.position).cross(force);
  for (const Weld& weld : welds_)
    if (weld.body == body.number && isWelded(weld))
    {
      const RodStepper::Impl& rod = *rods_[weld.rod].rod;
      const GraspState& g = rod.work.grasps[weld.grasp];
      force += rod.wrenches[weld.grasp].force;
      torque += rod.wrenches[weld.grasp].torque +
                (g.X_WG.position - body.start.position).cross(rod.wrenches[weld.grasp].force);
      for (int i = g.first_node; i <= g.last_node; ++i)
      {
        const Eigen::Vector3d drag = -rod.model->damping(i) * rod.work.v.col(i);
        force += drag;
        torque += (rod.work.x.col(i) - body.start.position).cross(drag);
      }
    }
  const Eigen::Quaterniond& q = body.start.orientation;
  Twist& v = body.velocity;
  Eigen::Vector3d momentum = q * (body.inertia * (q.conjugate() * v.angular)) + h * torque;
  v.linear += h / body.mass * force;
  if (m.linear_damping > 0 || m.angular_damping > 0)
  {
    // damping of the body alone, about its own centre, by the velocity at the end; the nodes have their own
    const double k = h * m.linear_damping * m.mass;
    const Eigen::Matrix3d r = q.toRotationMatrix(), arm = skew(now.X_WB.position - body.start.position);
    const Eigen::Matrix3d own = h * m.angular_damping * (r * m.inertia * r.transpose()) - k * arm * arm;
    Eigen::Matrix<double, 6, 6> matrix;
    matrix << (body.mass + k) * Eigen::Matrix3d::Identity(), -k * arm, k * arm, r * body.inertia * r.transpose() + own;
    Eigen::Matrix<double, 6, 1> end;
    end << body.mass * v.linear, momentum;
    Cholesky6 factor;
    factor.compute(matrix);   // a body has mass, so the matrix is positive definite
    factor.solveInPlace(end);
    v.linear = end.head<3>();
    momentum -= k * arm * v.linear + own * Eigen::Vector3d(end.tail<3>());
  }
  Eigen::Vector3d turn = h * spin(body.inertia, q, momentum);
  for (int k = 0; k < 20; ++k)
  {
    const Eigen::Vector3d better = h * spin(body.inertia, fromRotationVector(0.5 * turn) * q, momentum);
    const bool settled = (better - turn).norm() <= 1e-15;
    turn = better;
    if (settled)
      break;
  }
  body.predicted = {body.start.position + h * v.linear, (fromRotationVector(turn) * q).normalized()};
  v.angular = spin(body.inertia, body.predicted.orientation, momentum);
}

/// Takes over a body's motion at the end of the substep, and moves the grasps that it carries.
void ExplicitSystem::placeBody(Body& body, const Pose& X, const Twist& velocity)
{
  RigidBodyState& next = body.next;
  const Eigen::Vector3d arm = X.orientation * body.centre;
  next.X_WB = {X.position - arm, X.orientation};
  next.velocity = {velocity.linear - velocity.angular.cross(arm), velocity.angular};
  for (const Weld& weld : welds_)
    if (weld.body == body.number && isWelded(weld))
    {
      RodStepper::Impl& rod = *rods_[weld.rod].rod;
      rod.stage_poses[weld.grasp] = next.X_WB * weld.X_BG;
      rod.carried_velocity[weld.grasp] = {
          next.velocity.linear + next.velocity.angular.cross(rod.stage_poses[weld.grasp].position - next.X_WB.position),
          next.velocity.angular};
    }
}

/// Moves a body, and what it carries, as the substep begins.
void ExplicitSystem::placeStart(Body& body, const Pose& X)
{
  Pose& X_WB = body.now.X_WB;
  X_WB = {X.position - X.orientation * body.centre, X.orientation};
  for (const Weld& weld : welds_)
    if (weld.body == body.number && isWelded(weld))
    {
      RodStepper::Impl& rod = *rods_[weld.rod].rod;
      GraspState& g = rod.work.grasps[weld.grasp];
      g.X_WG = rod.stage_poses[weld.grasp] = X_WB * weld.X_BG;
      for (int i = g.first_node; i <= g.last_node; ++i)
        rod.work.x.col(i) = g.X_WG * g.nodes_G[i - g.first_node];
    }
}

StepFailure ExplicitSystem::attempt(const Substep& substep, StepReport& report)
{
  const double t = substep.from, h = substep.length;
  failed_ = 0;
  // before a run's first step whatever stretching a rod comes with is taken out without becoming a velocity
  const bool first =
      std::any_of(rods_.begin(), rods_.end(), [](const Rod& rod) { return rod.rod->work.last_step == 0.0; });
  if (inextensible_ && first)
  {
    composeBodies();
    if (const StepFailure failure = project(h, true, report); failure != StepFailure::none)
      return failure;
  }
  for (failed_ = 0; failed_ < rods_.size(); ++failed_)
    if (const StepFailure failure =
            rods_[failed_].rod->explicitPredict(*rods_[failed_].inputs, duration_, t, h, report);
        failure != StepFailure::none)
      return failure;
  composeBodies();
  for (Body& body : bodies_)
    predictBody(body, h);
  if (inextensible_)
  {
    if (const StepFailure failure = project(h, false, report); failure != StepFailure::none)
      return failure;
  }
  else
    for (Body& body : bodies_)
      placeBody(body, body.predicted, body.velocity);
  for (failed_ = 0; failed_ < rods_.size(); ++failed_)
    if (const StepFailure failure = rods_[failed_].rod->explicitFinish(*rods_[failed_].inputs, duration_, t, h);
        failure != StepFailure::none)
      return failure;
  for (const Body& body : bodies_)
  {
    const RigidBodyState& b = body.next;
    if (!b.X_WB.position.allFinite() || !b.X_WB.orientation.coeffs().allFinite() || !b.velocity.linear.allFinite() ||
        !b.velocity.angular.allFinite())
    {
      failed_ = 0;
      return StepFailure::state_not_finite;
    }
  }
  return StepFailure::none;
}

/// Restores the lengths of inextensible rods' edges. `start_only`: of the state the substep begins with, velocities
/// staying what they are.
StepFailure ExplicitSystem::project(double h, bool start_only, StepReport& report)
{
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    if (rods_[r].chain < 0)
      continue;
    RodStepper::Impl& rod = *rods_[r].rod;
    const int n = rod.model->nodes();
    owner_.assign(n, -1);
    arm_.resize(n);
    for (std::size_t k = 0; k < rod.work.grasps.size(); ++k)
    {
      const GraspState& g = rod.work.grasps[k];
      if (g.active)
        std::fill(owner_.begin() + g.first_node, owner_.begin() + g.last_node + 1, -2);
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      for (const Weld& weld : welds_)
        if (weld.rod == static_cast<int>(r) && weld.body == bodies_[b].number && isWelded(weld))
        {
          const GraspState& g = rod.work.grasps[weld.grasp];
          for (int i = g.first_node; i <= g.last_node; ++i)
          {
            owner_[i] = static_cast<int>(b);
            arm_[i] = weld.X_BG * g.nodes_G[i - g.first_node] - bodies_[b].centre;
          }
        }
    for (int i = 0; i < n; ++i)
      if (owner_[i] >= 0)
        projection_.weld(rods_[r].chain, i, owner_[i], arm_[i]);
      else
        owner_[i] == -2 ? projection_.hold(rods_[r].chain, i) : projection_.release(rods_[r].chain, i);
    projection_.setStart(rods_[r].chain, rod.work.x);
    projection_.setTrial(rods_[r].chain, start_only ? rod.work.x : rod.next.x);
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b)
  {
    ProjectedBody& body = projection_.body(static_cast<int>(b));
    body.mass = bodies_[b].mass;
    body.inertia = bodies_[b].inertia;
    body.start = bodies_[b].start;
    body.pose = start_only ? bodies_[b].start : bodies_[b].predicted;
    body.velocity = bodies_[b].velocity;
  }
  const ProjectionReport result = projection_.project(h);
  if (!result.ok)
  {
    failed_ = 0;
    while (failed_ + 1 < rods_.size() && rods_[failed_].chain != std::max(result.chain, 0))
      ++failed_;
    rods_[failed_].rod->overstretched =
        result.chain < 0 ? std::array<int, 2>{-1, -1} : std::array<int, 2>{result.first_node, result.last_node};
    return StepFailure::overstretched;
  }
  report.projection_iterations = std::max(report.projection_iterations, result.iterations);
  report.constraint_error = std::max(report.constraint_error, result.constraint_error);
  if (start_only && result.iterations == 0)
    return StepFailure::none;
  for (std::size_t r = 0; r < rods_.size(); ++r)
    if (rods_[r].chain >= 0 && start_only)
    {
      rods_[r].rod->next.v.setZero(3, rods_[r].rod->model->nodes());
      projection_.correct(rods_[r].chain, rods_[r].rod->work.x, rods_[r].rod->next.v);
    }
    else if (rods_[r].chain >= 0)
      rods_[r].rod->takeProjection(projection_, rods_[r].chain);
  for (std::size_t b = 0; b < bodies_.size(); ++b)
  {
    const ProjectedBody& body = projection_.body(static_cast<int>(b));
    start_only ? placeStart(bodies_[b], body.pose) : placeBody(bodies_[b], body.pose, body.velocity);
  }
  return StepFailure::none;
}

}   // namespace slender
