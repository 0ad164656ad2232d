// What happens to coupled rods, bodies and contact in a substep.
#include "coupled_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

ContactSurface contactSurface(const RodGroupModel& model)
{
  ContactSurface surface;
  for (const GroupContact::Rod& rod : model.contact.rods)
  {
    const RodModel& m = *model.rods[rod.rod];
    double start = 0.0;
    for (int j = 0; j < m.edges(); ++j)
    {
      ContactSegment s;
      s.a = surface.points + j;
      s.b = surface.points + (j + 1) % m.nodes();
      s.radius = std::max(m.radius_a[j], m.radius_b[j]);
      s.object = static_cast<int>(surface.objects.size());
      s.start = start;
      s.length = m.rest_length[j];
      start += s.length;
      surface.segments.push_back(s);
    }
    surface.objects.push_back({start, m.closed, rod.self, rod.others, rod.solids, rod.friction});
    surface.points += m.nodes();
  }
  for (const GroupContact::Obstacle& o : model.contact.obstacles)
    surface.solids.push_back({o.shape, o.friction, {}});
  for (const GroupContact::Body& b : model.contact.bodies)
  {
    surface.solids.push_back({b.shape, b.friction, {}});
    for (std::size_t k = 0; k < model.contact.rods.size(); ++k)   // what is welded to a body starts inside it
      for (const Weld& weld : model.welds)
        if (weld.body == b.body && weld.rod == model.contact.rods[k].rod)
          surface.solids.back().ignores.push_back(static_cast<int>(k));
  }
  return surface;
}

/// A contact force [N] that every scene meets: the weight of an edge, or what stops it within the gap in a step.
double leastStiffness(const RodGroupModel& model, double step)
{
  double mass = 0.0;
  for (const GroupContact::Rod& rod : model.contact.rods)
    mass = std::max(mass, model.rods[rod.rod]->mass.maxCoeff());
  return mass * std::max(10.0, model.contact.options.gap / (step * step));
}

}   // namespace

CoupledSystem::CoupledSystem(const RodGroupModel& model, const std::vector<RodStepper::Impl*>& rods) : model_(model)
{
  std::vector<Part*> parts;
  int nodes = 0;
  for (std::size_t r = 0; r < rods.size(); ++r)
  {
    const bool touches = std::any_of(model.contact.rods.begin(), model.contact.rods.end(),
                                     [r](const GroupContact::Rod& rod) { return rod.rod == static_cast<int>(r); });
    rods_.push_back(std::make_unique<RodPart>(*rods[r], touches));
    parts.push_back(rods_.back().get());
    nodes += model.rods[r]->nodes();
    island_.tolerances.least_edge = std::min(island_.tolerances.least_edge, rods[r]->model->rest_length.minCoeff());
  }
  island_.tolerances.angles_may_keep_shift = true;
  for (const RigidBodyModel& body : model.bodies)
  {
    if (body.simulated)
      bodies_.push_back(std::make_unique<BodyPart>(body));
    simulated_.push_back(body.simulated ? bodies_.back().get() : nullptr);
    if (body.simulated)
      parts.push_back(bodies_.back().get());
  }
  for (const Weld& weld : model.welds)
    if (simulated_[weld.body])
      rods_[weld.rod]->addWeld({weld.grasp, simulated_[weld.body], weld.X_BG});
  island_.setParts(parts);
  parallel_ = rods.size() > 1 && nodes >= 4000;
  island_.setThreads(0, parallel_);
  if (!model.contact.rods.empty())
    addContact();
}

void CoupledSystem::addContact()
{
  for (std::size_t k = 0; k < model_.contact.obstacles.size(); ++k)
    island_.solids.emplace_back();
  for (const GroupContact::Body& body : model_.contact.bodies)
  {
    island_.solids.emplace_back();
    island_.solids.back().body = simulated_[body.body];
    island_.solids.back().X_BS = body.X_BS;
  }
  ContactOptions options = model_.contact.options;
  options.least_stiffness = std::max(options.least_stiffness, leastStiffness(model_, rods_[0]->rod().time.step));
  island_.setContact(contactSurface(model_), options);
  first_stiffness_ = island_.contact()->stiffness();
}

void CoupledSystem::begin(const RodGroupState& state, const RodGroupInputs& inputs, double duration)
{
  inputs_ = &inputs;
  duration_ = duration;
  bodies_now_ = bodies_next_ = state.bodies;
  for (std::size_t r = 0; r < rods_.size(); ++r)
    rods_[r]->begin(inputs.rods[r], duration);
  for (const auto& body : bodies_)
    body->gravity = inputs.gravity;
  island_.beginStep(duration);
  if (!hasContact())
    return;
  stiffness_now_ = state.contact_stiffness > 0 ? state.contact_stiffness : first_stiffness_;
  const auto set = [](IslandSolid& solid, const Pose& pose, const Twist& velocity, const GraspTarget& target) {
    solid.start = pose;
    solid.start_velocity = velocity;
    solid.target = target;
  };
  const std::size_t obstacles = state.obstacles.size();
  for (std::size_t k = 0; k < obstacles; ++k)
    set(island_.solids[k], state.obstacles[k], state.obstacle_velocities[k], inputs.obstacles[k]);
  for (std::size_t k = 0; k < model_.contact.bodies.size(); ++k)
  {
    const int b = model_.contact.bodies[k].body;
    if (!simulated_[b])
      set(island_.solids[obstacles + k], state.bodies[b].X_WB, state.bodies[b].velocity, inputs.bodies[b]);
  }
}

void CoupledSystem::beginStep(const StepPlan& plan, double t)
{
  bool fresh = false;
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b])
    {
      simulated_[b]->system.load(bodies_now_[b]);
      fresh = fresh || !bodies_now_[b].has_history;
    }
  if (fresh && plan.needs_acceleration)
    startAccelerations();
  if (hasContact())
    island_.contact()->setStiffness(stiffness_now_);   // not what an attempt that failed left
  island_.beginSubstep(t / duration_);
}

/// Accelerations of the bodies, and of what they carry, from the forces in the rods as they are. Contacts count from
/// the first step on.
void CoupledSystem::startAccelerations()
{
  std::vector<BodySystem::Vector6> wrench(bodies_.size(), BodySystem::Vector6::Zero());
  std::vector<BodySystem::Matrix6> inertia(bodies_.size(), BodySystem::Matrix6::Zero());
  const auto numberOf = [&](const BodyPart* body) {
    return std::find_if(bodies_.begin(), bodies_.end(), [&](const auto& b) { return b.get() == body; }) -
           bodies_.begin();
  };
  const auto forCarried = [&](auto&& f) {
    for (const auto& part : rods_)
      for (const RodPart::Weld& weld : part->welds())
        if (part->isActive(weld))
          f(*part, part->rod().work.grasps[weld.grasp], weld);
  };
  for (const auto& part : rods_)
    if (!part->welds().empty())
    {
      RodSystem& system = part->rod().system;
      system.setResponse(0.0, nullptr);   // an attempt that failed leaves its viscous response
      for (int i = 0; i < system.nodes(); ++i)
        system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), part->rod().load(part->inputs(), i));
      system.evaluateWhole(false);
      system.closeGradient();
    }
  forCarried([&](const RodPart& part, const GraspState& g, const RodPart::Weld& weld) {
    const RodStepper::Impl& rod = part.rod();
    const BodySystem& body = weld.body->system;
    const auto b = static_cast<std::size_t>(numberOf(weld.body));
    wrench[b].tail<3>() += rod.system.clampTorque(weld.grasp);
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = rod.work.x.col(i) - body.pose.position, w = body.velocity().angular;
      const double m = rod.model->mass[i];
      const Eigen::Vector3d force = -rod.system.nodeGradient(i) - m * w.cross(w.cross(r));
      wrench[b].head<3>() += force;
      wrench[b].tail<3>() += r.cross(force);
      inertia[b].topLeftCorner<3, 3>() += m * Eigen::Matrix3d::Identity();
      inertia[b].topRightCorner<3, 3>() -= m * skew(r);
      inertia[b].bottomLeftCorner<3, 3>() += m * skew(r);
      inertia[b].bottomRightCorner<3, 3>() -= m * skew(r) * skew(r);
    }
  });
  std::vector<BodySystem::Vector6> acceleration(bodies_.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b)
  {
    BodySystem& body = bodies_[b]->system;
    const RigidBodyModel& m = body.model();
    wrench[b].head<3>() += m.force - m.linear_damping * m.mass * body.velocity().linear;
    if (m.gravity)
      wrench[b].head<3>() += m.mass * inputs_->gravity;
    acceleration[b] = body.startAcceleration(wrench[b], inertia[b]);
  }
  forCarried([&](RodPart& part, const GraspState& g, const RodPart::Weld& weld) {
    const BodySystem& body = weld.body->system;
    const auto b = static_cast<std::size_t>(numberOf(weld.body));
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = part.rod().work.x.col(i) - body.pose.position, w = body.velocity().angular;
      part.rod().work.a.col(i) = acceleration[b].head<3>() + acceleration[b].tail<3>().cross(r) + w.cross(w.cross(r));
    }
  });
}

NewtonResult CoupledSystem::solveStage(const StepPlan& plan, std::size_t s, double t, double h,
                                       const NewtonConfig& newton)
{
  const double before = s == 0 ? 0.0 : plan.stages[s - 1].time, now = plan.stages[s].time;
  for (const auto& body : bodies_)
    body->system.beginStage(plan, s, h, inputs_->gravity);
  for (const auto& rod : rods_)
  {
    rod->setCarriedInertia(plan.stages[s]);
    rod->followJoints();
  }
  island_.beginStage(s == 0);
  return island_.solve((t + before * h) / duration_, (t + now * h) / duration_, newton);
}

void CoupledSystem::endStage(const StepPlan& plan, std::size_t s, bool last)
{
  if (hasContact())
    island_.endStage();
  for (const auto& body : bodies_)
  {
    body->accept();
    body->system.endStage(plan.stages[s], last);
  }
  if (last)
    for (std::size_t b = 0; b < model_.bodies.size(); ++b)
      if (simulated_[b])
        simulated_[b]->system.finishStep(plan, bodies_next_[b]);
  for (const auto& rod : rods_)
    rod->takeCarriedMotion();
}

void CoupledSystem::commitStep()
{
  std::swap(bodies_now_, bodies_next_);
  if (!hasContact())
    return;
  island_.contact()->adaptStiffness();
  stiffness_now_ = island_.contact()->stiffness();
}

void CoupledSystem::end(RodGroupState& state)
{
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
  {
    if (simulated_[b])
      state.bodies[b] = bodies_now_[b];
    else
    {
      RigidBodyState& body = state.bodies[b];
      body.X_WB = poseBetween(body.X_WB, body.velocity, inputs_->bodies[b], duration_, 1.0, &body.velocity);
    }
  }
  for (std::size_t k = 0; k < state.obstacles.size(); ++k)
    state.obstacles[k] = poseBetween(state.obstacles[k], Twist(state.obstacle_velocities[k]), inputs_->obstacles[k],
                                     duration_, 1.0, &state.obstacle_velocities[k]);
  state.contact_stiffness = stiffness_now_;
}

double CoupledSystem::bodyEnergy(bool next) const
{
  double sum = 0.0;
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b])
    {
      const RigidBodyModel& m = model_.bodies[b];
      const RigidBodyState& s = next ? bodies_next_[b] : bodies_now_[b];
      const Eigen::Vector3d w = s.X_WB.orientation.conjugate() * s.velocity.angular;
      sum += 0.5 * m.mass * s.velocity.linear.squaredNorm() + 0.5 * w.dot(m.inertia * w) - m.force.dot(s.X_WB.position);
      if (m.gravity)
        sum -= m.mass * inputs_->gravity.dot(s.X_WB.position);
    }
  return sum;
}

double CoupledSystem::clearance(const RodGroupState& state)
{
  if (!hasContact())
    return std::numeric_limits<double>::infinity();
  Eigen::Matrix3Xd points(3, 0);
  for (const GroupContact::Rod& rod : model_.contact.rods)
  {
    const Eigen::Matrix3Xd& x = state.rods[rod.rod].x;
    points.conservativeResize(3, points.cols() + x.cols());
    points.rightCols(x.cols()) = x;
  }
  std::vector<Pose> solids = state.obstacles;
  for (const GroupContact::Body& body : model_.contact.bodies)
    solids.push_back(state.bodies[body.body].X_WB * body.X_BS);
  return island_.contact()->clearance(points, solids);
}

const std::vector<ContactTerm>& CoupledSystem::contacts() const
{
  static const std::vector<ContactTerm> none;
  return hasContact() ? island_.contact()->terms() : none;
}

}   // namespace slender
