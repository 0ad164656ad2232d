#include "step_loop.h"
#include "slender_sim/linalg/interruption.h"

#include <algorithm>
#include <cmath>

namespace slender {

StepLoop::StepLoop(const TimeConfig& time, std::vector<RodStepper::Impl*> rods, const RodGroupModel* group) : time_(time), rods_(std::move(rods))
{
  plan_.stages.reserve(2);
  if (time_.integrator == Integrator::symplectic_euler)
    explicit_ = std::make_unique<ExplicitSystem>(group, rods_);
  else if (group)
    coupled_ = std::make_unique<CoupledSystem>(*group, rods_);
}

StepLoop::~StepLoop() = default;

bool StepLoop::begin(const RodState* states, StepReport& report)
{
  std::string what;
  if (!(duration_ > 0) || !std::isfinite(duration_))
    what = "step length must be positive and finite, got " + std::to_string(duration_);
  for (std::size_t r = 0; r < rods_.size() && what.empty(); ++r)
    if (!rods_[r]->inputsFinite(states[r], inputs_[r], what))
      what = "rod '" + rods_[r]->model->name + "': " + what + " is not finite or not valid; correct this input";
  if (!what.empty())
  {
    report.ok = false;
    report.failure = StepFailure::input_not_finite;
    report.message = what;
    return false;
  }
  for (std::size_t r = 0; r < rods_.size(); ++r)
    rods_[r]->begin(states[r]);
  return true;
}

/// Whether nothing but the step itself can change the energy. Methods without damping at infinite frequency can feed on a stiff rod's
/// stretching when it turns far in a step; contact stores energy that is not counted.
bool StepLoop::conserves(const RodState* states) const
{
  bool conserving = (time_.integrator == Integrator::implicit_midpoint || time_.integrator == Integrator::generalized_alpha) &&
                    !(coupled_ && coupled_->hasContact());
  for (std::size_t r = 0; conserving && r < rods_.size(); ++r)
    for (std::size_t k = 0; k < states[r].grasps.size(); ++k)
      if (states[r].grasps[k].active && states[r].grasps[k].body < 0)
      {
        const Pose& a = states[r].grasps[k].X_WG;
        const Pose& b = inputs_[r].grasps[k].X_WG;
        conserving = conserving && a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
      }
  return conserving;
}

double StepLoop::energy(bool at_start, double* allowance)
{
  double sum = coupled_ ? coupled_->bodyEnergy(!at_start) : 0.0, allowed = 0.0;
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    double own = 0.0;
    sum += at_start ? rods_[r]->startEnergy(inputs_[r], &own) : rods_[r]->endEnergy(inputs_[r]);
    allowed += own;
  }
  if (allowance)
    *allowance = allowed + (coupled_ ? 0.05 * std::abs(coupled_->bodyEnergy(false)) : 0.0);
  return sum;
}

StepReport StepLoop::step(RodState* states, const RodInputs* inputs, double duration, RodGroupState* group, const RodGroupInputs* group_inputs)
{
  StepReport report;
  inputs_ = inputs;
  duration_ = duration;
  if (!begin(states, report))
    return report;
  if (coupled_)
    coupled_->begin(*group, *group_inputs, duration);
  if (explicit_ && group)
    explicit_->begin(*group, *group_inputs, duration);

  const bool explicit_step = explicit_ != nullptr;
  const bool adaptive = time_.error_tolerance > 0 && !explicit_step;
  const bool conserving = conserves(states);
  double allowance = 0.0;
  const double start_energy = conserving ? energy(true, &allowance) : 0.0;
  double t = 0.0, h = adaptive && !rods_.empty() && states[0].next_step > 0 ? states[0].next_step : duration;
  int cuts = 0;   // since the last good substep
  while (t < duration)
  {
    // the last substep ends exactly with the step; a sliver would be worse than a slightly longer one
    const bool last = t + h > duration * (1 - 1e-9);
    const double length = last ? duration - t : h;
    const bool can_shorten = !explicit_step && 0.5 * length >= time_.min_step;
    StepReport sub;
    failed_ = 0;
    StepFailure failure = explicit_step ? explicit_->step(inputs_, duration_, t, length, sub, failed_) : implicitStep(t, length, sub);
    if (conserving && failure == StepFailure::none && energy(false, nullptr) > start_energy + allowance)
      failure = StepFailure::energy_grew;
    const double ratio = sub.error_estimate / time_.error_tolerance;
    const bool inaccurate = adaptive && failure == StepFailure::none && ratio > 1 && can_shorten;
    if (failure != StepFailure::none || inaccurate)
    {
      report.iterations += sub.iterations;
      report.factorizations += sub.factorizations;
      const auto refuse_bodies = [&report](StepFailure why, const std::string& message) {
        report.ok = false;
        report.failure = why;
        report.message = message;
        return report;
      };
      if (stepsInterrupted())
        return rods_.empty() ? refuse_bodies(StepFailure::interrupted, kStepInterrupted)
                             : rods_[failed_]->refuse(report, StepFailure::interrupted, kStepInterrupted);
      const bool shortest = !adaptive && 0.5 * length < duration * std::ldexp(1.0 - 1e-9, -time_.newton.max_cuts);
      if (!inaccurate && (!can_shorten || shortest || ++cuts > time_.newton.max_cuts))
        return rods_.empty() ? refuse_bodies(failure, "the bodies' motion was not found: use a shorter step")
                             : rods_[failed_]->refuseUnsolved(report, failure, length, explicit_step);
      report.cut_steps += !inaccurate;
      h = length * (inaccurate ? std::clamp(stepFactor(ratio), 0.2, 0.8) : 0.5);
      continue;
    }
    t = last ? duration : t + length;
    for (std::size_t r = 0; r < rods_.size(); ++r)
    {
      rods_[r]->moveGrasps(inputs_[r], duration, t);
      std::swap(rods_[r]->work, rods_[r]->next);
    }
    if (coupled_)
      coupled_->commitStep();
    if (explicit_)
      explicit_->commitStep();
    cuts = 0;
    ++sub.substeps;
    report.merge(sub);
    h = std::max(last && adaptive ? h : 0.0, length * (adaptive ? std::clamp(stepFactor(ratio), 0.5, 2.0) : 2.0));
  }
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    rods_[r]->work.next_step = adaptive ? std::min(h, duration) : 0.0;
    states[r] = rods_[r]->work;
  }
  if (coupled_)
    coupled_->end(*group);
  if (explicit_ && group)
    explicit_->end(*group);
  return report;
}

StepFailure StepLoop::implicitStep(double t, double h, StepReport& report)
{
  double previous = rods_.empty() ? 0.0 : rods_[0]->work.last_step;   // a rod that has lost its history makes all start anew
  for (const RodStepper::Impl* rod : rods_)
    previous = std::min(previous, rod->work.last_step);
  planStep(time_.integrator, time_.spectral_radius, h, previous, plan_);
  const auto failing = [&](std::size_t r, StepFailure failure) {
    failed_ = r;
    return failure;
  };
  for (std::size_t r = 0; r < rods_.size(); ++r)
    if (const StepFailure failure = rods_[r]->beginStep(plan_, inputs_[r], duration_, t, h); failure != StepFailure::none)
      return failing(r, failure);
  if (coupled_)
    coupled_->beginStep(plan_, t);

  for (std::size_t s = 0; s < plan_.stages.size(); ++s)
  {
    for (std::size_t r = 0; r < rods_.size(); ++r)
      rods_[r]->beginStage(s, inputs_[r], duration_, t, h);
    const NewtonResult newton = coupled_ ? coupled_->solveStage(plan_, s, t, h, time_.newton) : minimize(rods_[0]->system, time_.newton);
    report.iterations += newton.iterations;
    report.factorizations += newton.factorizations;
    if (!newton.ok())
      return failing(farthestFromBalance(), newton.failure);
    report.residual = std::max(report.residual, newton.residual);
    report.max_strain = std::max(report.max_strain, newton.max_strain);
    const bool last = s + 1 == plan_.stages.size();
    if (coupled_)
      coupled_->endStage(plan_, s, last);
    for (std::size_t r = 0; r < rods_.size(); ++r)
      last ? rods_[r]->finishStep(inputs_[r], duration_, t, h, report) : rods_[r]->endStage(s, inputs_[r], duration_, t, h);
  }
  return StepFailure::none;
}

/// The rod on which the largest unbalanced force acts.
std::size_t StepLoop::farthestFromBalance() const
{
  Largest force;
  for (std::size_t r = 0; r < rods_.size(); ++r)
    if (const Largest own = rods_[r]->unbalancedForce(); own.any())
      force.add(static_cast<int>(r), own.value());
  return force.any() ? static_cast<std::size_t>(force.index()) : 0;
}

/// Next step length over this one for a local error that is `ratio` times the tolerance, with a margin.
double StepLoop::stepFactor(double ratio) const
{
  return 0.9 * std::pow(std::max(ratio, 1e-12), -1.0 / (order(time_.integrator) + 1));
}

}  // namespace slender
