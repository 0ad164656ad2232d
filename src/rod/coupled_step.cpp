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
  parts_.resize(rods.size());
  for (std::size_t r = 0; r < rods.size(); ++r)
  {
    parts_[r].rod = rods[r];
    parts_[r].system = &rods[r]->system;
    coupled_.chains.push_back(&parts_[r]);
    parts_[r].index = static_cast<int>(r);
    least_edge_ = std::min(least_edge_, rods[r]->model->rest_length.minCoeff());
  }
  int nodes = 0;
  for (const auto& rod : model.rods)
    nodes += rod->nodes();
  parallel_ = rods.size() > 1 && nodes >= 4000;
  bodies_.reserve(model.bodies.size());
  for (const RigidBodyModel& body : model.bodies)
  {
    simulated_.push_back(body.simulated ? static_cast<int>(bodies_.size()) : -1);
    if (body.simulated)
      bodies_.emplace_back(body);
  }
  body_direction_.resize(bodies_.size(), BodySystem::Vector6::Zero());
  driven_.resize(model.bodies.size());
  obstacles_.resize(model.contact.obstacles.size());
  if (model.contact.rods.empty())
    return;
  for (const GroupContact::Rod& rod : model.contact.rods)
  {
    parts_[rod.rod].point = static_cast<int>(coupled_.points.size());
    for (int i = 0; i < model.rods[rod.rod]->nodes(); ++i)
      coupled_.points.push_back({&parts_[rod.rod], i});
  }
  ContactOptions options = model.contact.options;
  options.least_stiffness = std::max(options.least_stiffness, leastStiffness(model, rods[0]->time.step));
  contact_ = std::make_unique<ContactPotential>(contactSurface(model), options);
  first_stiffness_ = contact_->stiffness();
  coupled_.solid_moves.assign(obstacles_.size(), 0);
  for (const GroupContact::Body& body : model.contact.bodies)
    coupled_.solid_moves.push_back(simulated_[body.body] >= 0);
  points_.resize(3, coupled_.points.size());
  points_base_ = points_end_ = points_;
  solids_.resize(obstacles_.size() + model.contact.bodies.size());
  solids_base_ = solids_end_ = solids_;
}

void CoupledSystem::begin(const RodGroupState& state, const RodGroupInputs& inputs, double duration)
{
  origin_ = &state;
  inputs_ = &inputs;
  duration_ = duration;
  bodies_now_ = bodies_next_ = state.bodies;
  if (contact_)
    stiffness_now_ = state.contact_stiffness > 0 ? state.contact_stiffness : first_stiffness_;
}

void CoupledSystem::placeDriven(double fraction)
{
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (!model_.bodies[b].simulated)
      driven_[b] = poseBetween(origin_->bodies[b].X_WB, origin_->bodies[b].velocity, inputs_->bodies[b], duration_,
                               fraction, nullptr);
  for (std::size_t k = 0; k < obstacles_.size(); ++k)
    obstacles_[k] = poseBetween(origin_->obstacles[k], origin_->obstacle_velocities[k], inputs_->obstacles[k],
                                duration_, fraction, nullptr);
}

void CoupledSystem::placeWelds()
{
  for (const Weld& weld : model_.welds)
    if (simulated_[weld.body] >= 0)
      parts_[weld.rod].rod->stage_poses[weld.grasp] = bodies_[simulated_[weld.body]].pose * weld.X_BG;
  for (RodPart& part : parts_)
    if (part.welded)
      part.rod->system.placeGrasps(part.rod->stage_poses);
}

void CoupledSystem::gather(Eigen::Matrix3Xd& x, std::vector<Pose>& solids) const
{
  for (const RodPart& part : parts_)
    if (part.point >= 0)
      for (int i = 0; i < part.rod->model->nodes(); ++i)
        x.col(part.point + i) = part.rod->system.position(i);
  std::copy(obstacles_.begin(), obstacles_.end(), solids.begin());
  for (std::size_t k = 0; k < model_.contact.bodies.size(); ++k)
  {
    const GroupContact::Body& b = model_.contact.bodies[k];
    solids[obstacles_.size() + k] =
        (simulated_[b.body] >= 0 ? bodies_[simulated_[b.body]].pose : driven_[b.body]) * b.X_BS;
  }
}

void CoupledSystem::beginStep(const StepPlan& plan, double t)
{
  coupled_.exact = false;
  for (RodPart& part : parts_)
    mapUnknowns(part);
  bool fresh = false;
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b] >= 0)
    {
      bodies_[simulated_[b]].load(bodies_now_[b]);
      fresh = fresh || !bodies_now_[b].has_history;
    }
  if (fresh && plan.needs_acceleration)
    startAccelerations();
  placeDriven(t / duration_);
  if (contact_)
  {
    contact_->setStiffness(stiffness_now_);   // not what an attempt that failed left
    gather(points_base_, solids_base_);
  }
}

/// Accelerations of the bodies, and of what they carry, from the forces in the rods as they are. Contacts count from
/// the first step on.
void CoupledSystem::startAccelerations()
{
  std::vector<BodySystem::Vector6> wrench(bodies_.size(), BodySystem::Vector6::Zero());
  std::vector<BodySystem::Matrix6> inertia(bodies_.size(), BodySystem::Matrix6::Zero());
  const auto forCarried = [&](auto&& f) {
    for (RodPart& part : parts_)
      for (std::size_t k = 0; k < part.rod->work.grasps.size(); ++k)
        if (const GraspState& g = part.rod->work.grasps[k]; g.active && g.body >= 0)
          f(part, k, simulated_[g.body]);
  };
  for (RodPart& part : parts_)
    if (part.welded)
    {
      part.rod->system.setResponse(0.0, nullptr);   // an attempt that failed leaves its viscous response
      for (int i = 0; i < part.rod->model->nodes(); ++i)
        part.rod->system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), part.rod->load(inputs_->rods[part.index], i));
      part.rod->system.evaluateWhole(false);
      part.rod->system.closeGradient();
    }
  forCarried([&](RodPart& part, std::size_t k, int b) {
    const GraspState& g = part.rod->work.grasps[k];
    wrench[b].tail<3>() += part.rod->system.clampTorque(static_cast<int>(k));
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = part.rod->work.x.col(i) - bodies_[b].pose.position, w = bodies_[b].velocity().angular;
      const double m = part.rod->model->mass[i];
      const Eigen::Vector3d force = -part.rod->system.nodeGradient(i) - m * w.cross(w.cross(r));
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
    const RigidBodyModel& m = bodies_[b].model();
    wrench[b].head<3>() += m.force - m.linear_damping * m.mass * bodies_[b].velocity().linear;
    if (m.gravity)
      wrench[b].head<3>() += m.mass * inputs_->gravity;
    acceleration[b] = bodies_[b].startAcceleration(wrench[b], inertia[b]);
  }
  forCarried([&](RodPart& part, std::size_t k, int b) {
    const GraspState& g = part.rod->work.grasps[k];
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = part.rod->work.x.col(i) - bodies_[b].pose.position, w = bodies_[b].velocity().angular;
      part.rod->work.a.col(i) = acceleration[b].head<3>() + acceleration[b].tail<3>().cross(r) + w.cross(w.cross(r));
    }
  });
}

/// Nodes that a body carries are points of it.
void CoupledSystem::setCarriedInertia(const Stage& stage)
{
  const double inertia = 1.0 / (stage.tau_a * stage.tau_a), damping = 1.0 / stage.tau_v;
  for (const Weld& weld : model_.welds)
  {
    const RodPart& part = parts_[weld.rod];
    const GraspState& g = part.rod->work.grasps[weld.grasp];
    if (!g.active || g.body < 0)
      continue;
    const BodySystem& body = bodies_[simulated_[weld.body]];
    const RodModel& m = *part.rod->model;
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = weld.X_BG * g.nodes_G[i - g.first_node];
      const double wm = m.mass[i] * inertia, wd = m.damping(i) * damping;
      part.rod->system.setInertia(i, wm + wd, (wm * body.inertiaTarget(r) + wd * body.dampingTarget(r)) / (wm + wd),
                                  part.rod->load(inputs_->rods[part.index], i));
    }
  }
}

NewtonResult CoupledSystem::solveStage(const StepPlan& plan, std::size_t s, double t, double h,
                                       const NewtonConfig& newton)
{
  const double before = s == 0 ? 0.0 : plan.stages[s - 1].time, now = plan.stages[s].time;
  for (BodySystem& body : bodies_)
    body.beginStage(plan, s, h, inputs_->gravity);
  setCarriedInertia(plan.stages[s]);
  placeDriven((t + now * h) / duration_);
  placeWelds();
  if (!contact_)
    return minimize(*this, newton);
  coupled_.matrix.beginStage();
  // friction sticks below a speed over the whole step: in cut steps that range would become too narrow to find
  contact_->begin(points_base_, solids_base_, duration_);
  if (s == 0)
    coupled_.takeFirst(contact_->terms(), nullptr, contact_->rows());
  return minimizeConfined(*this, (t + before * h) / duration_, (t + now * h) / duration_, newton,
                          model_.contact.options.gap / least_edge_);
}

Approach CoupledSystem::approach(double from, double to, double& reached)
{
  gather(points_end_, solids_end_);
  double alpha = contact_->stepLimit(points_base_, points_end_, solids_base_, solids_end_);
  reached = to;
  for (int attempt = 0; attempt < 20; ++attempt, alpha *= 0.5)
  {
    if (alpha < 1.0)
    {
      reached = from + alpha * (to - from);
      for (BodySystem& body : bodies_)
      {
        const Eigen::Vector3d turn = rotationVector(body.pose.orientation * body.base().orientation.conjugate());
        BodySystem::Vector6 way;
        way << body.pose.position - body.base().position, turn;
        body.moveAlong(way, attempt == 0 ? alpha : 0.5);
      }
      placeDriven(reached);
      for (RodPart& part : parts_)
      {
        RodSystem& system = part.rod->system;
        for (int i = 0; i < part.rod->model->nodes(); ++i)
          if (system.isFree(i))
            system.setPosition(i, system.basePosition(i) +
                                      (attempt == 0 ? alpha : 0.5) * (system.position(i) - system.basePosition(i)));
        part.rod->placeAt(inputs_->rods[part.index], duration_, reached);
      }
      placeWelds();
    }
    const RodEvaluation trial = evaluate(false);
    if (std::isfinite(trial.energy()) && trial.min_chi > kFoldedChi)
    {
      accept();
      return reached < to ? Approach::partly : Approach::arrived;
    }
    if (alpha == 1.0 && trial.min_chi <= kFoldedChi && std::isfinite(trial.potential))
      return Approach::arrived;   // not a matter of contact: minimize() will say so
  }
  return Approach::squeezed;
}

void CoupledSystem::placeHeld(double to)
{
  placeDriven(to);
  for (RodPart& part : parts_)
    part.rod->placeAt(inputs_->rods[part.index], duration_, to);
  placeWelds();
}

void CoupledSystem::endStage(const StepPlan& plan, std::size_t s, bool last)
{
  if (contact_)
  {
    points_base_ = points_;
    solids_base_ = solids_;
  }
  for (BodySystem& body : bodies_)
  {
    body.accept();
    body.endStage(plan.stages[s], last);
  }
  if (last)
    for (std::size_t b = 0; b < model_.bodies.size(); ++b)
      if (simulated_[b] >= 0)
        bodies_[simulated_[b]].finishStep(plan, bodies_next_[b]);
  for (const Weld& weld : model_.welds)
    if (simulated_[weld.body] >= 0)
    {
      const BodySystem& body = bodies_[simulated_[weld.body]];
      RodStepper::Impl& rod = *parts_[weld.rod].rod;
      rod.stage_poses[weld.grasp] = body.pose * weld.X_BG;
      const Twist& v = body.velocity();
      rod.carried_velocity[weld.grasp] = {v.linear + v.angular.cross(body.pose.orientation * weld.X_BG.position),
                                          v.angular};
    }
}

void CoupledSystem::commitStep()
{
  std::swap(bodies_now_, bodies_next_);
  if (!contact_)
    return;
  contact_->adaptStiffness();
  stiffness_now_ = contact_->stiffness();
}

void CoupledSystem::end(RodGroupState& state)
{
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
  {
    if (simulated_[b] >= 0)
      state.bodies[b] = bodies_now_[b];
    else
    {
      RigidBodyState& body = state.bodies[b];
      body.X_WB = poseBetween(body.X_WB, body.velocity, inputs_->bodies[b], duration_, 1.0, &body.velocity);
    }
  }
  for (std::size_t k = 0; k < obstacles_.size(); ++k)
    state.obstacles[k] = poseBetween(state.obstacles[k], Twist(state.obstacle_velocities[k]), inputs_->obstacles[k],
                                     duration_, 1.0, &state.obstacle_velocities[k]);
  state.contact_stiffness = stiffness_now_;
}

double CoupledSystem::bodyEnergy(bool next) const
{
  double sum = 0.0;
  for (std::size_t b = 0; b < model_.bodies.size(); ++b)
    if (simulated_[b] >= 0)
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
  if (!contact_)
    return std::numeric_limits<double>::infinity();
  for (const RodPart& part : parts_)
    if (part.point >= 0)
      points_.middleCols(part.point, part.rod->model->nodes()) = state.rods[part.index].x;
  std::copy(state.obstacles.begin(), state.obstacles.end(), solids_.begin());
  for (std::size_t k = 0; k < model_.contact.bodies.size(); ++k)
    solids_[state.obstacles.size() + k] =
        state.bodies[model_.contact.bodies[k].body].X_WB * model_.contact.bodies[k].X_BS;
  return contact_->clearance(points_, solids_);
}

const std::vector<ContactTerm>& CoupledSystem::contacts() const
{
  static const std::vector<ContactTerm> none;
  return contact_ ? contact_->terms() : none;
}

}   // namespace slender
