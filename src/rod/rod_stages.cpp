// Parts of an implicit substep of one rod (thesis 4.6.2).
#include <algorithm>

#include "rod_work.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

StepFailure RodWork::computeAcceleration()
{
  // at the start of a run: frames to equilibrium, then a = M^-1 F
  system.setResponse(0.0, nullptr);
  system.setTwistLoads(inputs->torques);
  for (int i = 0; i < model->nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), load(i));
  placeAt(substep.from / duration);
  if (system.evaluate(false).min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  system.relaxFrames();
  work.a.resize(3, model->nodes());
  for (int i = 0; i < model->nodes(); ++i)
  {
    work.a.col(i) =
        system.isFree(i)
            ? Eigen::Vector3d((-system.nodeGradient(i) - model->damping(i) * work.v.col(i)) / model->mass[i])
            : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  system.store(work);
  return StepFailure::none;
}

StepFailure RodWork::beginSubstep(const StepPlan& step_plan, const Substep& next_substep)
{
  plan = &step_plan;
  substep = next_substep;
  for (std::size_t k = 0; k < work.grasps.size(); ++k)
    if (work.grasps[k].active && work.grasps[k].body >= 0)
      stage_poses[k] = work.grasps[k].X_WG;   // an attempt that failed leaves its trial poses
  system.load(work);
  if ((plan->needs_acceleration || time.error_tolerance > 0) && work.a.cols() == 0)
  {
    const StepFailure failure = computeAcceleration();
    if (failure != StepFailure::none)
      return failure;
    system.load(work);
  }
  if (model->stiffness_damping > 0)
    startStrainHistory();
  if (spins)
    beginSpins();
  next = work;
  stage_q.resize(3, model->nodes());
  stage_v.resize(3, model->nodes());
  return StepFailure::none;
}

/// Inertia and loads of a stage, and as its trial configuration the motion carried on.
void RodWork::beginStage(std::size_t s)
{
  const Stage& stage = plan->stages[s];
  const double h = substep.length;
  const double inertia = 1.0 / (stage.tau_a * stage.tau_a), damping = 1.0 / stage.tau_v;
  const double ahead = stage.time * h;
  system.setTwistLoads(inputs->torques);
  for (int i = 0; i < model->nodes(); ++i)
  {
    const Eigen::Vector3d q_hat = combine(stage.q_hat, i), q_tilde = combine(stage.q_tilde, i);
    const double wm = model->mass[i] * inertia, wd = model->damping(i) * damping;
    system.setInertia(i, system.isMoving(i) ? wm + wd : 0.0, (wm * q_hat + wd * q_tilde) / (wm + wd), load(i));
    Eigen::Vector3d guess = s == 0 ? Eigen::Vector3d(work.x.col(i) + ahead * work.v.col(i))
                                   : Eigen::Vector3d(stage_q.col(i) + (1 - plan->stages[0].time) * h * stage_v.col(i));
    if (s == 0 && work.a.cols() > 0)
      guess += 0.5 * ahead * ahead * work.a.col(i);
    system.setPosition(i, guess);
  }
  if (spins)
    beginSpinStage(s, h);
  placeAt((substep.from + stage.time * h) / duration);
  if (model->stiffness_damping > 0)
    setViscousResponse(stage, h);
}

/// Takes over the solution of a stage that is not the last.
void RodWork::endStage(std::size_t s)
{
  const Stage& stage = plan->stages[s];
  for (int i = 0; i < model->nodes(); ++i)
  {
    stage_q.col(i) = system.position(i);
    stage_v.col(i) = heldVelocity(substep.from + stage.time * substep.length, i,
                                  (stage_q.col(i) - combine(stage.q_tilde, i)) / stage.tau_v);
  }
  if (model->stiffness_damping > 0)
    system.strains(strain_stage);
  if (spins)
    endSpinStage(s);
  system.accept();
}

/// End of the step from its last stage: positions, velocities, accelerations, frames, reactions, history.
void RodWork::finish(StepReport& report)
{
  const int n = model->nodes();
  const Stage& stage = plan->stages.back();
  const double c = plan->fraction, h = substep.length, end = substep.from + h;
  const bool keep_a = plan->needs_acceleration || time.error_tolerance > 0;
  const bool keep_previous = time.integrator == Integrator::bdf2;
  if (keep_a)
    next.a.resize(3, n);
  double jump = 0.0;
  for (int i = 0; i < n; ++i)
  {
    const Eigen::Vector3d q = system.position(i);
    const Eigen::Vector3d v = (q - combine(stage.q_tilde, i)) / stage.tau_v;
    const Eigen::Vector3d x0 = work.x.col(i), v0 = work.v.col(i);
    next.x.col(i) = c == 1.0 ? q : Eigen::Vector3d(x0 + (q - x0) / c);
    next.v.col(i) = heldVelocity(end, i, c == 1.0 ? v : Eigen::Vector3d(v0 + (v - v0) / c));
    if (!keep_a)
      continue;
    const bool free = system.isMoving(i);
    const Eigen::Vector3d a = free ? Eigen::Vector3d((q - combine(stage.q_hat, i)) / (stage.tau_a * stage.tau_a))
                                   : Eigen::Vector3d((next.v.col(i) - v0) / h);
    const Eigen::Vector3d a0 = work.a.cols() ? Eigen::Vector3d(work.a.col(i)) : a;
    next.a.col(i) = a0 + (a - a0) / plan->a_fraction;
    if (free)
      jump = std::max(jump, order(time.integrator) == 2 ? (next.a.col(i) - a0).norm() : next.a.col(i).norm());
  }
  report.error_estimate = std::max(report.error_estimate, errorConstant(time.integrator) * h * h * jump);
  computeWrenches(h);
  if (spins)
    finishSpins();

  if (c != 1.0)
  {
    // The stage lies inside the step: carry the frames on to its end and let them relax there (thesis 4.3).
    if (model->stiffness_damping > 0)
      system.strains(strain_stage);
    system.accept();
    for (int i = 0; i < n; ++i)
      system.setPosition(i, next.x.col(i));
    placeAt(end / duration);
    for (int i = 0; i < n; ++i)
      next.x.col(i) = system.position(i);
    if (model->stiffness_damping > 0)
      setViscousResponseAtEnd(stage, h);
    end_evaluation = system.relaxFrames();
  }
  system.store(next);
  if (model->stiffness_damping > 0)
    finishStrainHistory(stage);
  if (keep_previous)
  {
    next.x_previous = work.x;
    next.v_previous = work.v;
  }
  next.last_step = h;
}

Eigen::Vector3d RodWork::heldVelocity(double at, int node, const Eigen::Vector3d& otherwise)
{
  if (system.isFree(node))
    return otherwise;
  for (std::size_t k = 0; k < origin->size(); ++k)
  {
    const GraspState& g = (*origin)[k];
    if (!g.active || node < g.first_node || node > g.last_node)
      continue;
    if (g.body >= 0)
      return carried_velocity[k].linear +
             carried_velocity[k].angular.cross(stage_poses[k].orientation * g.nodes_G[node - g.first_node]);
    Twist twist;
    const Pose pose = graspPose(k, std::min(at / duration, 1.0), &twist);
    return twist.linear + twist.angular.cross(pose.orientation * g.nodes_G[node - g.first_node]);
  }
  return otherwise;
}

Eigen::Vector3d RodWork::combine(const Combination& c, int i) const
{
  Eigen::Vector3d sum = c[kQ] * work.x.col(i) + c[kV] * work.v.col(i);
  if (c[kA] != 0)
    sum += c[kA] * work.a.col(i);
  if (c[kQPrevious] != 0)
    sum += c[kQPrevious] * work.x_previous.col(i) + c[kVPrevious] * work.v_previous.col(i);
  if (c[kQStage] != 0)
    sum += c[kQStage] * stage_q.col(i) + c[kVStage] * stage_v.col(i);
  return sum;
}

void RodWork::computeWrenches(double h)
{
  for (std::size_t k = 0; k < wrenches.size(); ++k)
  {
    Wrench& w = wrenches[k];
    w = Wrench{};
    const GraspState& g = work.grasps[k];
    if (!g.active)
      continue;
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      // Newton's law of the held node: gripper's force = m a + damping - (internal and external forces); the rod's is
      // the opposite
      Eigen::Vector3d force = -system.nodeGradient(i);
      if (h > 0 && g.body < 0)
        force -= model->mass[i] * (next.v.col(i) - work.v.col(i)) / h + model->damping(i) * next.v.col(i);
      w.force += force;
      w.torque += (system.position(i) - stage_poses[k].position).cross(force);
    }
    w.torque += system.clampTorque(static_cast<int>(k));
  }
}

}   // namespace slender
