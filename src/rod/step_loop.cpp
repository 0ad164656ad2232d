#include "step_loop.h"
#include "slender_sim/linalg/interruption.h"

#include <algorithm>
#include <cmath>

namespace slender {

StepLoop::StepLoop(const TimeConfig& time, std::vector<RodStepper::Impl*> rods, const RodGroupModel* group)
  : time_(time),
    rods_(std::move(rods))
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

/// Whether nothing but the step itself can change the energy. Methods without damping at infinite frequency can feed on
/// a stiff rod's stretching when it turns far in a step; contact stores energy that is not counted.
bool StepLoop::conserves(const RodState* states) const
{
  bool conserving =
      (time_.integrator == Integrator::implicit_midpoint || time_.integrator == Integrator::generalized_alpha) &&
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

StepReport StepLoop::step(RodState* states, const RodInputs* inputs, double duration, RodGroupState* group,
                          const RodGroupInputs* group_inputs)
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

  conserving_ = conserves(states);
  double allowance = 0.0;
  const double start_energy = conserving_ ? energy(true, &allowance) : 0.0;
  most_energy_ = start_energy + allowance;
  SubstepRule rule{duration,
                   0.0,
                   explicit_ ? 0.0 : time_.error_tolerance,
                   time_.min_step,
                   order(time_.integrator),
                   time_.newton.max_cuts};
  if (rule.error_tolerance > 0 && !rods_.empty())
    rule.first = states[0].next_step;
  SubstepController controller(rule);
  controller.run(*this, duration, report);
  if (!report.ok)
    return report;
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    rods_[r]->work.next_step = controller.nextLength();
    states[r] = rods_[r]->work;
  }
  if (coupled_)
    coupled_->end(*group);
  if (explicit_ && group)
    explicit_->end(*group);
  return report;
}

StepFailure StepLoop::attempt(const Substep& substep, StepReport& report)
{
  failed_ = 0;
  const StepFailure failure = explicit_
                                  ? explicit_->step(inputs_, duration_, substep.from, substep.length, report, failed_)
                                  : implicitStep(substep.from, substep.length, report);
  if (conserving_ && failure == StepFailure::none && energy(false, nullptr) > most_energy_)
    return StepFailure::energy_grew;
  return failure;
}

void StepLoop::accept(const Substep& substep)
{
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    rods_[r]->moveGrasps(inputs_[r], duration_, substep.to);
    std::swap(rods_[r]->work, rods_[r]->next);
  }
  if (coupled_)
    coupled_->commitStep();
  if (explicit_)
    explicit_->commitStep();
}

/// Explicit steps have one length, on which their stability depends.
bool StepLoop::shorterMayHelp(StepFailure) const { return explicit_ == nullptr; }

void StepLoop::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  if (!rods_.empty())
  {
    failure == StepFailure::interrupted
        ? rods_[failed_]->refuse(report, failure, kStepInterrupted)
        : rods_[failed_]->refuseUnsolved(report, failure, substep.length, explicit_ != nullptr);
    return;
  }
  report.ok = false;
  report.failure = failure;
  report.message =
      failure == StepFailure::interrupted ? kStepInterrupted : "the bodies' motion was not found: use a shorter step";
}

StepFailure StepLoop::implicitStep(double t, double h, StepReport& report)
{
  // a rod that has lost its history makes all start anew
  double previous = rods_.empty() ? 0.0 : rods_[0]->work.last_step;
  for (const RodStepper::Impl* rod : rods_)
    previous = std::min(previous, rod->work.last_step);
  planStep(time_.integrator, time_.spectral_radius, h, previous, plan_);
  const auto failing = [&](std::size_t r, StepFailure failure) {
    failed_ = r;
    return failure;
  };
  for (std::size_t r = 0; r < rods_.size(); ++r)
    if (const StepFailure failure = rods_[r]->beginStep(plan_, inputs_[r], duration_, t, h);
        failure != StepFailure::none)
      return failing(r, failure);
  if (coupled_)
    coupled_->beginStep(plan_, t);

  for (std::size_t s = 0; s < plan_.stages.size(); ++s)
  {
    for (std::size_t r = 0; r < rods_.size(); ++r)
      rods_[r]->beginStage(s, inputs_[r], duration_, t, h);
    const NewtonResult newton =
        coupled_ ? coupled_->solveStage(plan_, s, t, h, time_.newton) : minimize(rods_[0]->system, time_.newton);
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
      last ? rods_[r]->finishStep(inputs_[r], duration_, t, h, report)
           : rods_[r]->endStage(s, inputs_[r], duration_, t, h);
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

}   // namespace slender
