#include "slender_sim/rod/rod_stepper.h"

#include <algorithm>
#include <cmath>

#include "rod_stepper_impl.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

RodStepper::RodStepper(std::shared_ptr<const RodModel> model, const TimeConfig& time) : impl_(std::make_unique<Impl>(std::move(model), time)) {}
RodStepper::~RodStepper() = default;
RodStepper::RodStepper(RodStepper&&) noexcept = default;

StepReport RodStepper::step(RodState& state, const RodInputs& inputs, double duration)
{
  return impl_->step(state, inputs, duration);
}
StepReport RodStepper::solveEquilibrium(RodState& state, const RodInputs& inputs)
{
  return impl_->solveEquilibrium(state, inputs);
}
const std::vector<Wrench>& RodStepper::wrenches() const
{
  return impl_->wrenches;
}
const RodModel& RodStepper::model() const
{
  return *impl_->model;
}

RodStepper::Impl::Impl(std::shared_ptr<const RodModel> m, const TimeConfig& t) : model(std::move(m)), time(t), system(*model)
{
  plan.stages.reserve(2);
}

void RodStepper::Impl::resizeFor(const RodState& state)
{
  const std::size_t grasps = state.grasps.size();
  stage_poses.resize(grasps);
  wrenches.resize(grasps);
}

bool RodStepper::Impl::inputsFinite(const RodState& state, const RodInputs& inputs, std::string& what) const
{
  const int nodes = model->nodes(), edges = model->edges();
  // names are built only when they are needed: a good step takes no memory
  const auto check = [&](bool good, const char* name, std::size_t number = std::string::npos) {
    if (!good && what.empty())
      what = number == std::string::npos ? std::string(name) : name + std::to_string(number);
    return good;
  };
  const auto refuse_count = [&](const char* name, std::size_t count, std::size_t expected) {
    what = std::string("number of ") + name + " (" + std::to_string(count) + " for " + std::to_string(expected) + ")";
    return false;
  };
  bool good = check(inputs.gravity.allFinite(), "gravity") && check(inputs.wind.allFinite(), "wind") && check(inputs.forces.allFinite(), "a nodal force");
  if (state.x.cols() != nodes || state.v.cols() != nodes || state.twist.size() != nodes || state.d1.cols() != edges)
    return refuse_count("nodes of the state", state.x.cols(), nodes);
  if (inputs.grasps.size() != state.grasps.size())
    return refuse_count("grasp targets", inputs.grasps.size(), state.grasps.size());
  if (inputs.forces.cols() != 0 && inputs.forces.cols() != state.x.cols())
    return refuse_count("nodal forces", inputs.forces.cols(), state.x.cols());
  for (std::size_t k = 0; k < inputs.grasps.size(); ++k)
  {
    const GraspTarget& g = inputs.grasps[k];
    if (!state.grasps[k].active)
      continue;
    const double norm = g.X_WG.orientation.norm();
    good = good && check(g.X_WG.position.allFinite() && std::isfinite(norm) && std::abs(norm - 1.0) < 1e-3, "pose of grasp ", k) &&
           check(!g.velocity || (g.velocity->linear.allFinite() && g.velocity->angular.allFinite()), "velocity of grasp ", k);
  }
  bool sound = state.x.allFinite() && state.v.allFinite() && state.d1.allFinite() && state.twist.allFinite() && state.a.allFinite() &&
               state.x_previous.allFinite() && state.v_previous.allFinite() && state.strain_rate.allFinite() &&
               state.strain_rate_previous.allFinite() && state.strain_previous.allFinite();
  for (const GraspState& g : state.grasps)
    sound = sound && (!g.active || (g.X_WG.position.allFinite() && g.X_WG.orientation.coeffs().allFinite() && g.velocity.linear.allFinite() &&
                                    g.velocity.angular.allFinite() && std::isfinite(g.section_twist[0]) && std::isfinite(g.section_twist[1])));
  return good && check(sound, "the state");
}

/// Pose (and velocity) of a grasp at a fraction of the whole step: uniform motion, or a cubic through both ends' velocities.
Pose RodStepper::Impl::graspPose(const GraspState& start, const GraspTarget& target, double duration, double s, Twist* velocity)
{
  const Eigen::Vector3d move = target.X_WG.position - start.X_WG.position;
  const Eigen::Vector3d turn = start.X_WG.orientation * rotationVector(start.X_WG.orientation.conjugate() * target.X_WG.orientation);
  const bool smooth = target.velocity.has_value();
  // cubic Hermite blend of displacement and end velocities; with neither the motion is uniform
  const double h01 = smooth ? s * s * (3 - 2 * s) : s, d01 = smooth ? 6 * s * (1 - s) : 1.0;
  const double h10 = smooth ? s * (1 - s) * (1 - s) : 0.0, d10 = smooth ? (1 - s) * (1 - 3 * s) : 0.0;
  const double h11 = smooth ? s * s * (s - 1) : 0.0, d11 = smooth ? s * (3 * s - 2) : 0.0;
  const Twist& v0 = start.velocity;
  const Twist v1 = smooth ? *target.velocity : Twist{};
  if (velocity)
  {
    velocity->linear = (d01 * move) / duration + d10 * v0.linear + d11 * v1.linear;
    velocity->angular = (d01 * turn) / duration + d10 * v0.angular + d11 * v1.angular;
  }
  if (s >= 1.0)
    return {target.X_WG.position, target.X_WG.orientation.normalized()};
  const Eigen::Vector3d phi = h01 * turn + duration * (h10 * v0.angular + h11 * v1.angular);
  return {start.X_WG.position + h01 * move + duration * (h10 * v0.linear + h11 * v1.linear),
          (fromRotationVector(phi) * start.X_WG.orientation).normalized()};
}

StepReport RodStepper::Impl::step(RodState& state, const RodInputs& inputs, double duration)
{
  StepReport report;
  std::string what;
  if (!(duration > 0) || !std::isfinite(duration))
    return refuse(report, StepFailure::input_not_finite, "step length must be positive and finite, got " + std::to_string(duration));
  if (!inputsFinite(state, inputs, what))
    return refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  resizeFor(state);
  origin = &state.grasps;   // poses of the grasps as the whole step begins
  work = state;

  const bool explicit_step = time.integrator == Integrator::symplectic_euler;
  const bool adaptive = time.error_tolerance > 0 && !explicit_step;
  // Methods without damping at infinite frequency can feed on a stiff rod's stretching when it turns far in a step.
  bool conserving = time.integrator == Integrator::implicit_midpoint || time.integrator == Integrator::generalized_alpha;
  for (std::size_t k = 0; k < state.grasps.size(); ++k)
    if (state.grasps[k].active)
    {
      const Pose& a = state.grasps[k].X_WG;
      const Pose& b = inputs.grasps[k].X_WG;
      conserving = conserving && a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
    }
  double energy = 0.0, allowance = 0.0;
  if (conserving)
  {
    system.load(work);
    system.setResponse(0.0, nullptr);
    energy = mechanicalEnergy(work, inputs, system.evaluate(false), &allowance);
  }
  double t = 0.0, h = adaptive && work.next_step > 0 ? work.next_step : duration;
  int cuts = 0;   // since the last good substep
  while (t < duration)
  {
    // the last substep ends exactly with the step; a sliver would be worse than a slightly longer one
    const bool last = t + h > duration * (1 - 1e-9);
    const double length = last ? duration - t : h;
    const bool can_shorten = !explicit_step && 0.5 * length >= time.min_step;
    StepReport sub;
    StepFailure failure = explicit_step ? explicitStep(inputs, duration, t, length, sub) : implicitStep(inputs, duration, t, length, sub);
    if (conserving && failure == StepFailure::none && mechanicalEnergy(next, inputs, end_evaluation, nullptr) > energy + allowance)
      failure = StepFailure::energy_grew;
    const double ratio = sub.error_estimate / time.error_tolerance;
    const bool inaccurate = adaptive && failure == StepFailure::none && ratio > 1 && can_shorten;
    if (failure != StepFailure::none || inaccurate)
    {
      report.iterations += sub.iterations;
      report.factorizations += sub.factorizations;
      const bool shortest = !adaptive && 0.5 * length < duration * std::ldexp(1.0 - 1e-9, -time.newton.max_cuts);
      if (!inaccurate && (!can_shorten || shortest || ++cuts > time.newton.max_cuts))
        return refuse(report, failure, explainFailure(failure, length, explicit_step));
      report.cut_steps += !inaccurate;
      h = length * (inaccurate ? std::clamp(stepFactor(ratio), 0.2, 0.8) : 0.5);
      continue;
    }
    std::swap(work, next);
    cuts = 0;
    ++sub.substeps;
    report.merge(sub);
    t = last ? duration : t + length;
    h = std::max(last && adaptive ? h : 0.0, length * (adaptive ? std::clamp(stepFactor(ratio), 0.5, 2.0) : 2.0));
  }
  work.next_step = adaptive ? std::min(h, duration) : 0.0;
  for (std::size_t k = 0; k < work.grasps.size(); ++k)
    if (work.grasps[k].active)
      work.grasps[k].X_WG = graspPose(state.grasps[k], inputs.grasps[k], duration, 1.0, &work.grasps[k].velocity);
  state = work;
  return report;
}

/// Elastic (as evaluated) plus kinetic energy and the loads' potential. `allowance`: growth that errors of a sound step may show.
double RodStepper::Impl::mechanicalEnergy(const RodState& s, const RodInputs& inputs, const RodEvaluation& e, double* allowance) const
{
  double kinetic = 0.0, potential = 0.0, weight = 0.0;
  for (int i = 0; i < model->nodes(); ++i)
  {
    const Eigen::Vector3d f = load(inputs, i);
    kinetic += 0.5 * model->mass[i] * s.v.col(i).squaredNorm();
    potential -= f.dot(s.x.col(i));
    weight += f.norm();
  }
  if (allowance)
    *allowance = 0.05 * (kinetic + e.stretch + e.bend_twist + weight * model->rest_length.sum()) +
                 1e-12 * model->stretch_modulus.dot(model->rest_length);   // a rod at rest: strains of a millionth
  return e.stretch + e.bend_twist + potential + kinetic;
}

/// Next step length over this one for a local error that is `ratio` times the tolerance, with a margin.
double RodStepper::Impl::stepFactor(double ratio) const
{
  return 0.9 * std::pow(std::max(ratio, 1e-12), -1.0 / (order(time.integrator) + 1));
}

StepReport RodStepper::Impl::refuse(StepReport& report, StepFailure failure, const std::string& message)
{
  report.ok = false;
  report.failure = failure;
  report.message = "rod '" + model->name + "': " + message;
  return report;
}

std::string RodStepper::Impl::explainFailure(StepFailure failure, double length, bool explicit_step) const
{
  const std::string at = " at a step of " + std::to_string(1e3 * length) + " ms";
  switch (failure)
  {
    case StepFailure::folded_back:
      return "two consecutive edges point (nearly) opposite ways" + at + ": use more edges, a stiffer rod or a slower motion" +
             (explicit_step ? "; if the motion is slow, the explicit step blew up: use a shorter step or an implicit integrator" : "");
    case StepFailure::singular_matrix:
      return "the stiffness matrix could not be made definite" + at + ": moduli or masses differ by too many orders of magnitude";
    case StepFailure::state_not_finite:
      return explicit_step ? "the explicit step blew up" + at + ": use a shorter step or an implicit integrator"
                           : "the configuration overflowed" + at + ": use a shorter step or check the inputs for jumps";
    case StepFailure::energy_grew:
      return "the energy grew out of nothing" + at + ": use a shorter step, or tr_bdf2, bdf2 or implicit_euler, which damp what the step cannot resolve";
    default:
      return "Newton's method did not converge" + at + ": use a shorter step, more time.newton.max_iterations or max_cuts, or slow the grasps down";
  }
}

void RodStepper::Impl::placeAt(const RodInputs& inputs, double duration, double fraction)
{
  for (std::size_t k = 0; k < stage_poses.size(); ++k)
    if (work.grasps[k].active)
      stage_poses[k] = graspPose((*origin)[k], inputs.grasps[k], duration, fraction, nullptr);
  system.placeGrasps(stage_poses);
}

/// load per node that does not depend on the configuration: weight, wind drag, extra forces
Eigen::Vector3d RodStepper::Impl::load(const RodInputs& inputs, int i) const
{
  Eigen::Vector3d f = model->mass[i] * inputs.gravity + model->drag[i] * inputs.wind;
  if (inputs.forces.cols() > 0)
    f += inputs.forces.col(i);
  return f;
}

StepFailure RodStepper::Impl::computeAcceleration(const RodInputs& inputs, double duration, double t)
{
  // at the start of a run: frames to equilibrium, then a = M^-1 F
  system.setResponse(0.0, nullptr);
  for (int i = 0; i < model->nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), load(inputs, i));
  placeAt(inputs, duration, t / duration);
  if (system.evaluate(false).min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  system.relaxFrames();
  work.a.resize(3, model->nodes());
  for (int i = 0; i < model->nodes(); ++i)
  {
    const double damping = model->mass_damping * model->mass[i] + model->drag[i];
    work.a.col(i) = system.isFree(i) ? Eigen::Vector3d((-system.nodeGradient(i) - damping * work.v.col(i)) / model->mass[i])
                                     : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  system.store(work);
  return StepFailure::none;
}

StepFailure RodStepper::Impl::implicitStep(const RodInputs& inputs, double duration, double t, double h, StepReport& report)
{
  const int n = model->nodes();
  planStep(time.integrator, time.spectral_radius, h, work.last_step, plan);
  system.load(work);
  const bool measure_error = time.error_tolerance > 0;
  if ((plan.needs_acceleration || measure_error) && work.a.cols() == 0)
  {
    const StepFailure failure = computeAcceleration(inputs, duration, t);
    if (failure != StepFailure::none)
      return failure;
    system.load(work);
  }
  const bool viscous = model->stiffness_damping > 0;
  if (viscous)
    startStrainHistory(inputs, duration, t);

  next = work;
  stage_q.resize(3, n);
  stage_v.resize(3, n);
  for (std::size_t s = 0; s < plan.stages.size(); ++s)
  {
    const Stage& stage = plan.stages[s];
    const double inertia = 1.0 / (stage.tau_a * stage.tau_a), damping = 1.0 / stage.tau_v;
    // predictor: the last velocity and acceleration carried on
    const double ahead = stage.time * h;
    for (int i = 0; i < n; ++i)
    {
      const Eigen::Vector3d q_hat = combine(stage.q_hat, i), q_tilde = combine(stage.q_tilde, i);
      const double wm = model->mass[i] * inertia, wd = (model->mass_damping * model->mass[i] + model->drag[i]) * damping;
      const bool free = system.isFree(i);
      system.setInertia(i, free ? wm + wd : 0.0, (wm * q_hat + wd * q_tilde) / (wm + wd), load(inputs, i));
      Eigen::Vector3d guess = s == 0 ? Eigen::Vector3d(work.x.col(i) + ahead * work.v.col(i)) : Eigen::Vector3d(stage_q.col(i) + (1 - plan.stages[0].time) * h * stage_v.col(i));
      if (s == 0 && work.a.cols() > 0)
        guess += 0.5 * ahead * ahead * work.a.col(i);
      system.setPosition(i, guess);
    }
    placeAt(inputs, duration, (t + stage.time * h) / duration);
    if (viscous)
      setViscousResponse(stage, h);
    const NewtonResult newton = minimize(system, time.newton);
    report.iterations += newton.iterations;
    report.factorizations += newton.factorizations;
    if (!newton.ok())
      return newton.failure;
    report.residual = std::max(report.residual, newton.residual);
    report.max_strain = std::max(report.max_strain, newton.max_strain);

    const bool last = s + 1 == plan.stages.size();
    if (!last)
    {
      for (int i = 0; i < n; ++i)
      {
        stage_q.col(i) = system.position(i);
        stage_v.col(i) = heldVelocity(inputs, duration, t + stage.time * h, i, (stage_q.col(i) - combine(stage.q_tilde, i)) / stage.tau_v);
      }
      if (viscous)
        system.strains(strain_stage);
      system.accept();
    }
    else
      finishStep(inputs, duration, t, h, stage, report);
  }
  return StepFailure::none;
}

/// End of the step from its last stage: positions, velocities, accelerations, frames, reactions, history.
void RodStepper::Impl::finishStep(const RodInputs& inputs, double duration, double t, double h, const Stage& stage, StepReport& report)
{
  const int n = model->nodes();
  const double c = plan.fraction;
  const bool keep_a = plan.needs_acceleration || time.error_tolerance > 0;
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
    next.v.col(i) = heldVelocity(inputs, duration, t + h, i, c == 1.0 ? v : Eigen::Vector3d(v0 + (v - v0) / c));
    if (!keep_a)
      continue;
    const bool free = system.isFree(i);
    const Eigen::Vector3d a = free ? Eigen::Vector3d((q - combine(stage.q_hat, i)) / (stage.tau_a * stage.tau_a)) : Eigen::Vector3d((next.v.col(i) - v0) / h);
    const Eigen::Vector3d a0 = work.a.cols() ? Eigen::Vector3d(work.a.col(i)) : a;
    next.a.col(i) = a0 + (a - a0) / plan.a_fraction;
    if (free)
      jump = std::max(jump, order(time.integrator) == 2 ? (next.a.col(i) - a0).norm() : next.a.col(i).norm());
  }
  report.error_estimate = errorConstant(time.integrator) * h * h * jump;
  computeWrenches(inputs, h);

  if (c != 1.0)
  {
    // The stage lies inside the step: carry the frames on to its end and let them relax there (thesis 4.3).
    if (model->stiffness_damping > 0)
      system.strains(strain_stage);
    system.accept();
    for (int i = 0; i < n; ++i)
      system.setPosition(i, next.x.col(i));
    placeAt(inputs, duration, (t + h) / duration);
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

Eigen::Vector3d RodStepper::Impl::heldVelocity(const RodInputs& inputs, double duration, double at, int node, const Eigen::Vector3d& otherwise)
{
  if (system.isFree(node))
    return otherwise;
  for (std::size_t k = 0; k < origin->size(); ++k)
  {
    const GraspState& g = (*origin)[k];
    if (!g.active || node < g.first_node || node > g.last_node)
      continue;
    Twist twist;
    const Pose pose = graspPose(g, inputs.grasps[k], duration, std::min(at / duration, 1.0), &twist);
    return twist.linear + twist.angular.cross(pose.orientation * g.nodes_G[node - g.first_node]);
  }
  return otherwise;
}

Eigen::Vector3d RodStepper::Impl::combine(const Combination& c, int i) const
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

void RodStepper::Impl::computeWrenches(const RodInputs&, double h)
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
      // Newton's law of the held node: gripper's force = m a + damping - (internal and external forces); the rod's is the opposite
      Eigen::Vector3d force = -system.nodeGradient(i);
      if (h > 0)
        force -= model->mass[i] * (next.v.col(i) - work.v.col(i)) / h + (model->mass_damping * model->mass[i] + model->drag[i]) * next.v.col(i);
      w.force += force;
      w.torque += (system.position(i) - stage_poses[k].position).cross(force);
    }
    w.torque += system.clampTorque(static_cast<int>(k));
  }
}

RodEnergies RodStepper::energies(const RodState& state, const Eigen::Vector3d& gravity) const
{
  Impl& impl = *impl_;
  const RodModel& m = *impl.model;
  impl.system.load(state);
  impl.system.setResponse(0.0, nullptr);
  for (int i = 0; i < m.nodes(); ++i)
    impl.system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  const RodEvaluation e = impl.system.evaluate(false);
  RodEnergies result;
  result.stretch = e.stretch;
  const RodArrays& a = impl.system.arrays();
  for (int i = 0; i < m.nodes(); ++i)
  {
    const double q = a.twist[i] - a.rest_twist[i];
    result.twist += 0.5 * a.beta[i] * q * q;
    result.kinetic += 0.5 * m.mass[i] * state.v.col(i).squaredNorm();
    result.gravity -= m.mass[i] * gravity.dot(state.x.col(i));
  }
  for (const ClampJoint& c : impl.system.clamps())
    result.twist += 0.5 * c.beta * (c.twist - c.rest_twist) * (c.twist - c.rest_twist);
  result.bend = e.bend_twist - result.twist;
  return result;
}

}  // namespace slender
