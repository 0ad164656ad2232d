// Explicit symplectic Euler [Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1.2] with frames that follow
// quasistatically.
#include <algorithm>
#include <cmath>

#include "rod_stepper_impl.h"

namespace slender {

/// Forces as the substep begins, and the velocities and positions that free nodes have by them alone; held nodes are
/// put where their grasps will be.
StepFailure RodStepper::Impl::explicitPredict(const RodInputs& inputs, double duration, double t, double h,
                                              StepReport& report)
{
  const int n = model->nodes();
  const RodEvaluation now = evaluateStart(inputs, duration, t);
  if (now.min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  if (!std::isfinite(now.energy()))
    return StepFailure::state_not_finite;
  report.max_strain = std::max(report.max_strain, now.max_strain);
  elasticWrenches(inputs);

  next = work;
  next.last_step = h;
  for (int i = 0; i < n; ++i)
  {
    const Eigen::Vector3d force = load(inputs, i) - (isotropic ? isotropic->nodeGradient(i) : system.nodeGradient(i));
    next.v.col(i) = model->mass[i] * work.v.col(i) + h * force;
  }
  if (model->damped())   // by the velocity at the end of the step: linear, so it costs nothing to treat implicitly
    for (int i = 0; i < n; ++i)
      next.v.col(i) /= model->mass[i] + h * model->damping(i);
  else
    for (int i = 0; i < n; ++i)
      next.v.col(i) /= model->mass[i];
  next.x += h * next.v;
  holdNodes(inputs, duration, t + h);
  return StepFailure::none;
}

RodEvaluation RodStepper::Impl::evaluateStart(const RodInputs& inputs, double duration, double t)
{
  if (isotropic)
    return isotropic->evaluate(work);
  system.leaveOutStretching(model->inextensible);
  system.load(work);
  system.setTwistLoads(inputs.torques);
  if (model->stiffness_damping > 0)
  {
    startStrainHistory(inputs, duration, t);
    strain_reference = strain_start - work.strain_rate;   // rate over one second: ratio = damping
    system.setResponse(model->stiffness_damping, &strain_reference);
  }
  else
    system.setResponse(0.0, nullptr);
  for (int i = 0; i < model->nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  system.placeGrasps(stage_poses);
  if (work.last_step == 0.0)
    system.relaxFrames();
  return system.evaluate(false);
}

/// What the rod's elasticity and its loads do to the grippers, and to the bodies that carry it, as the substep begins.
void RodStepper::Impl::elasticWrenches(const RodInputs& inputs)
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
      const Eigen::Vector3d force = load(inputs, i) - (isotropic ? isotropic->nodeGradient(i) : system.nodeGradient(i));
      w.force += force;
      w.torque += (work.x.col(i) - g.X_WG.position).cross(force);
    }
    w.torque += isotropic ? isotropic->clampTorque(static_cast<int>(k)) : system.clampTorque(static_cast<int>(k));
  }
}

/// Positions and velocities of held nodes at an instant; those of grasps that bodies carry follow stage_poses and
/// carried_velocity.
void RodStepper::Impl::holdNodes(const RodInputs& inputs, double duration, double at)
{
  for (std::size_t k = 0; k < next.grasps.size(); ++k)
  {
    const GraspState& g = next.grasps[k];
    if (!g.active)
      continue;
    Twist velocity = carried_velocity[k];
    if (g.body < 0)
      stage_poses[k] = graspPose((*origin)[k], inputs.grasps[k], duration, std::min(at / duration, 1.0), &velocity);
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d arm = stage_poses[k].orientation * g.nodes_G[i - g.first_node];
      next.x.col(i) = stage_poses[k].position + arm;
      next.v.col(i) = velocity.linear + velocity.angular.cross(arm);
    }
  }
}

/// End of the substep at the nodes' final positions: frames, twists, reactions, checks.
StepFailure RodStepper::Impl::explicitFinish(const RodInputs& inputs, double duration, double t, double h)
{
  const int n = model->nodes();
  holdNodes(inputs, duration, t + h);
  if (!next.x.allFinite() || !next.v.allFinite())
    return StepFailure::state_not_finite;
  for (std::size_t k = 0; k < wrenches.size(); ++k)
  {
    // Newton's law of a held node: gripper's force = m a + damping - (internal and external forces); the rod's is the
    // opposite
    const GraspState& g = work.grasps[k];
    if (!g.active || g.body >= 0)
      continue;
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d force =
          -model->mass[i] * (next.v.col(i) - work.v.col(i)) / h - model->damping(i) * next.v.col(i);
      wrenches[k].force += force;
      wrenches[k].torque += (work.x.col(i) - work.grasps[k].X_WG.position).cross(force);
    }
  }
  if (isotropic)
    return isotropic->settle(work, stage_poses, next);

  // frames carried along to the new positions, then one Newton step towards their equilibrium there
  const bool viscous = model->stiffness_damping > 0;
  system.accept();
  for (int i = 0; i < n; ++i)
    system.setPosition(i, next.x.col(i));
  system.placeGrasps(stage_poses);
  if (viscous)   // massless frames relax in stiffness_damping seconds, which may be less than a step: that takes an
                 // implicit rate
    system.setResponse(model->stiffness_damping / h, &strain_start);
  const RodEvaluation end = system.evaluate(false);
  if (end.min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  if (!std::isfinite(end.energy()))
    return StepFailure::state_not_finite;
  system.solveFrames();
  if (viscous)
  {
    system.accept();
    system.turnFrames();
    system.evaluate(false);
    system.strains(strain_end);
    next.strain_rate = (strain_end - strain_start) / h;
    system.setResponse(0.0, nullptr);
    system.store(next);
  }
  else
    system.storeTurned(next);
  return StepFailure::none;
}

/// Projected positions and velocities; wrenches take up the forces of the constraints on held nodes.
void RodStepper::Impl::takeProjection(const FastProjection& projection, int chain)
{
  projection.correct(chain, next.x, next.v);
  for (std::size_t k = 0; k < wrenches.size(); ++k)
  {
    const GraspState& g = work.grasps[k];
    if (!g.active || g.body >= 0)
      continue;
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d force = projection.force(chain, i);
      wrenches[k].force += force;
      wrenches[k].torque += (work.x.col(i) - g.X_WG.position).cross(force);
    }
  }
}

}   // namespace slender
