#include "step_loop.h"
#include "slender_sim/linalg/interruption.h"

#include <cmath>

namespace slender {

StepLoop::StepLoop(const TimeConfig& time, RodStepper::Impl& rod) : time_(time), rod_(rod)
{
  plan_.stages.reserve(2);
  if (time_.integrator == Integrator::symplectic_euler)
    explicit_ = std::make_unique<ExplicitSystem>(std::vector<RodStepper::Impl*>{&rod_});
}

StepLoop::~StepLoop() = default;

bool StepLoop::begin(const RodState& state, StepReport& report)
{
  std::string what;
  if (!(duration_ > 0) || !std::isfinite(duration_))
    what = "step length must be positive and finite, got " + std::to_string(duration_);
  else if (!rod_.inputsFinite(state, *inputs_, what))
    what = "rod '" + rod_.model->name + "': " + what + " is not finite or not valid; correct this input";
  if (!what.empty())
  {
    report.ok = false;
    report.failure = StepFailure::input_not_finite;
    report.message = what;
    return false;
  }
  rod_.begin(state);
  return true;
}

/// Whether nothing but the step itself can change the energy. Methods without damping at infinite frequency can feed on
/// a stiff rod's stretching when it turns far in a step.
bool StepLoop::conserves(const RodState& state) const
{
  if (time_.integrator != Integrator::implicit_midpoint && time_.integrator != Integrator::generalized_alpha)
    return false;
  for (std::size_t k = 0; k < state.grasps.size(); ++k)
    if (state.grasps[k].active && state.grasps[k].body < 0)
    {
      const Pose &from = state.grasps[k].X_WG, &to = inputs_->grasps[k].X_WG;
      if (from.position != to.position || from.orientation.coeffs() != to.orientation.coeffs())
        return false;
    }
  return true;
}

StepReport StepLoop::step(RodState& state, const RodInputs& inputs, double duration)
{
  StepReport report;
  inputs_ = &inputs;
  duration_ = duration;
  if (!begin(state, report))
    return report;
  if (explicit_)
    explicit_->setInputs(0, inputs);

  conserving_ = conserves(state);
  double allowance = 0.0;
  const double start_energy = conserving_ ? rod_.startEnergy(inputs, &allowance) : 0.0;
  most_energy_ = start_energy + allowance;
  SubstepRule rule{duration,
                   0.0,
                   explicit_ ? 0.0 : time_.error_tolerance,
                   time_.min_step,
                   order(time_.integrator),
                   time_.newton.max_cuts};
  if (rule.error_tolerance > 0)
    rule.first = state.next_step;
  SubstepController controller(rule);
  controller.run(*this, duration, report);
  if (!report.ok)
    return report;
  rod_.work.next_step = controller.nextLength();
  state = rod_.work;
  return report;
}

StepFailure StepLoop::attempt(const Substep& substep, StepReport& report)
{
  std::size_t failed = 0;   // the only rod
  const StepFailure failure = explicit_ ? explicit_->step(duration_, substep.from, substep.length, report, failed)
                                        : implicitStep(substep.from, substep.length, report);
  if (conserving_ && failure == StepFailure::none && rod_.endEnergy(*inputs_) > most_energy_)
    return StepFailure::energy_grew;
  return failure;
}

void StepLoop::accept(const Substep& substep)
{
  rod_.moveGrasps(*inputs_, duration_, substep.to);
  std::swap(rod_.work, rod_.next);
}

/// Explicit steps have one length, on which their stability depends.
bool StepLoop::shorterMayHelp(StepFailure) const { return explicit_ == nullptr; }

void StepLoop::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  if (failure == StepFailure::interrupted)
    rod_.refuse(report, failure, kStepInterrupted);
  else
    rod_.refuseUnsolved(report, failure, substep.length, explicit_ != nullptr);
}

StepFailure StepLoop::implicitStep(double t, double h, StepReport& report)
{
  planStep(time_.integrator, time_.spectral_radius, h, rod_.work.last_step, plan_);
  if (const StepFailure failure = rod_.beginStep(plan_, *inputs_, duration_, t, h); failure != StepFailure::none)
    return failure;
  for (std::size_t s = 0; s < plan_.stages.size(); ++s)
  {
    rod_.beginStage(s, *inputs_, duration_, t, h);
    const NewtonResult newton = minimize(rod_.system, time_.newton);
    report.iterations += newton.iterations;
    report.factorizations += newton.factorizations;
    if (!newton.ok())
      return newton.failure;
    report.residual = std::max(report.residual, newton.residual);
    report.max_strain = std::max(report.max_strain, newton.max_strain);
    if (s + 1 == plan_.stages.size())
      rod_.finishStep(*inputs_, duration_, t, h, report);
    else
      rod_.endStage(s, *inputs_, duration_, t, h);
  }
  return StepFailure::none;
}

}   // namespace slender
