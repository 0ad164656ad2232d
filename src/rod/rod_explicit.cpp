// Explicit symplectic Euler [Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1.2] with frames that follow
// quasistatically.
#include <algorithm>
#include <cmath>

#include "rod_part.h"

namespace slender {

/// Forces as the substep begins, and the velocities and positions that free nodes have by them alone; held nodes are
/// put where their grasps will be.
StepFailure RodWork::explicitPredict(const Substep& next_substep, StepReport& report)
{
  substep = next_substep;
  const int n = model->nodes();
  const double h = substep.length;
  const RodEvaluation now = evaluateStart();
  if (now.min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  if (!std::isfinite(now.energy()))
    return StepFailure::state_not_finite;
  report.max_strain = std::max(report.max_strain, now.max_strain);
  elasticWrenches();

  next = work;
  next.last_step = h;
  for (int i = 0; i < n; ++i)
    next.v.col(i) = model->mass[i] * work.v.col(i) + h * nodeForce(i);
  if (model->damped())   // by the velocity at the end of the step: linear, so it costs nothing to treat implicitly
    for (int i = 0; i < n; ++i)
      next.v.col(i) /= model->mass[i] + h * model->damping(i);
  else
    for (int i = 0; i < n; ++i)
      next.v.col(i) /= model->mass[i];
  next.x += h * next.v;
  holdNodes(substep.from + h);
  return StepFailure::none;
}

RodEvaluation RodWork::evaluateStart()
{
  if (isotropic)
    return isotropic->evaluate(work);
  system.leaveOutStretching(model->inextensible);
  system.load(work);
  system.setTwistLoads(inputs->torques);
  if (model->stiffness_damping > 0)
  {
    startStrainHistory();
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
void RodWork::elasticWrenches()
{
  wrenches.assign(wrenches.size(), Wrench());
  addToWrenches([&](int i) { return nodeForce(i); }, true);
  for (std::size_t k = 0; k < wrenches.size(); ++k)
    if (work.grasps[k].active)
      wrenches[k].torque +=
          isotropic ? isotropic->clampTorque(static_cast<int>(k)) : system.clampTorque(static_cast<int>(k));
}

/// Positions and velocities of held nodes at an instant; those of grasps that bodies carry follow stage_poses and
/// carried_velocity.
void RodWork::holdNodes(double at)
{
  for (std::size_t k = 0; k < next.grasps.size(); ++k)
  {
    const GraspState& g = next.grasps[k];
    if (!g.active)
      continue;
    Twist velocity = carried_velocity[k];
    if (g.body < 0)
      stage_poses[k] = graspPose(k, std::min(at / duration, 1.0), &velocity);
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d arm = stage_poses[k].orientation * g.nodes_G[i - g.first_node];
      next.x.col(i) = stage_poses[k].position + arm;
      next.v.col(i) = velocity.linear + velocity.angular.cross(arm);
    }
  }
}

/// End of the substep at the nodes' final positions: frames, twists, reactions, checks.
StepFailure RodWork::explicitFinish()
{
  const int n = model->nodes();
  const double h = substep.length;
  holdNodes(substep.from + h);
  if (!next.x.allFinite() || !next.v.allFinite())
    return StepFailure::state_not_finite;
  // Newton's law of a held node: gripper's force = m a + damping - (internal and external forces); the rod's is the
  // opposite
  addToWrenches([&](int i) {
    return Eigen::Vector3d(-model->mass[i] * (next.v.col(i) - work.v.col(i)) / h - model->damping(i) * next.v.col(i));
  });
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

// ---- as a part of an island

bool RodPart::addTo(FastProjection& projection)
{
  const RodModel& m = *rod_.model;
  chain_ = m.inextensible ? projection.addChain(m.rest_length, m.mass, m.closed) : -1;
  return m.inextensible;
}

void RodPart::giveTo(FastProjection& projection, bool at_start)
{
  if (chain_ < 0)
    return;
  if (!numberUnknowns())   // other nodes are held than before
    projection.releaseAll(chain_);
  for (std::size_t k = 0; k < rod_.work.grasps.size(); ++k)
  {
    const GraspState& g = rod_.work.grasps[k];
    const Weld* weld = weldOf(static_cast<int>(k));
    for (int i = g.first_node; g.active && i <= g.last_node; ++i)
      if (weld)
        weld->body->weldTo(projection, chain_, i, weld->X_BG * g.nodes_G[i - g.first_node]);
      else
        projection.hold(chain_, i);
  }
  projection.setStart(chain_, rod_.work.x);
  projection.setTrial(chain_, at_start ? rod_.work.x : rod_.next.x);
}

/// Wrenches take up the forces of the constraints on held nodes.
StepFailure RodPart::takeFrom(FastProjection& projection, const ProjectionReport& result, bool at_start)
{
  if (!result.ok)
  {
    if (chain_ != std::max(result.chain, 0))
      return StepFailure::none;
    rod_.overstretched = {result.chain < 0 ? -1 : result.first_node, result.last_node};
    return StepFailure::overstretched;
  }
  if (at_start)
    takeStart(projection);
  else if (chain_ >= 0)
  {
    projection.correct(chain_, rod_.next.x, rod_.next.v);
    rod_.addToWrenches([&](int node) { return projection.force(chain_, node); });
  }
  return StepFailure::none;
}

/// Nodes, and grasps that bodies carry, as the substep begins.
void RodPart::takeStart(const FastProjection& projection)
{
  RodState& now = rod_.work;
  if (chain_ >= 0)
  {
    rod_.next.v.setZero(3, rod_.model->nodes());   // velocities stay
    projection.correct(chain_, now.x, rod_.next.v);
  }
  for (const Weld& weld : welds_)
  {
    GraspState& g = now.grasps[weld.grasp];
    if (!g.active)
      continue;
    g.X_WG = rod_.stage_poses[weld.grasp] = weld.body->state().X_WB * weld.X_BG;
    for (int i = g.first_node; i <= g.last_node; ++i)
      now.x.col(i) = g.X_WG * g.nodes_G[i - g.first_node];
  }
}

/// Implicit substeps end with their last stage.
StepFailure RodPart::finishSubstep(StepReport&)
{
  if (!isExplicit(rod_.time.integrator))
    return StepFailure::none;
  takeCarriedMotion();
  return rod_.explicitFinish();
}

}   // namespace slender
