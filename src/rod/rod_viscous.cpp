// Rayleigh stiffness damping: every strain s gets the extra force stiffness_damping * k * ds/dt (thesis 5.3.1). A
// stage's rate is (s - s~) / tau_v with s~ the stage's own combination of past strains, so the damping has the
// integrator's order.
#include "rod_work.h"

namespace slender {

void RodWork::startStrainHistory()
{
  placeAt(substep.from / duration);
  system.evaluate(false);
  system.strains(strain_start);
  if (work.strain_rate.cols() != strain_start.cols())
    work.strain_rate.setZero(4, strain_start.cols());
  if (work.strain_rate_previous.cols() != strain_start.cols())
    work.strain_rate_previous = work.strain_rate;
}

/// A stage inside the step lies on the chord between the step's ends, but its strain does not lie on the chord of their
/// strains, which is what its backward difference means. That sag, second order in the step, is taken from the step
/// before.
void RodWork::setViscousResponse(const Stage& stage, double h)
{
  const Combination& c = stage.q_tilde;
  if (plan->fraction == 1.0)
    strain_sag.setZero(4, 0);
  else if (work.last_step > 0 && work.strain_previous.cols() == strain_start.cols())
    strain_sag = (h / work.last_step) * (h / work.last_step) * work.strain_previous;
  else
    strain_sag.setZero(4, strain_start.cols());
  strain_reference = c[kQ] * strain_start + c[kV] * work.strain_rate;
  if (c[kA] != 0 && work.last_step > 0)
    strain_reference += (c[kA] / work.last_step) * (work.strain_rate - work.strain_rate_previous);
  if (c[kQPrevious] != 0)
    strain_reference +=
        c[kQPrevious] * (work.strain_previous.cols() == strain_start.cols() ? work.strain_previous : strain_start);
  if (c[kQStage] != 0)
    strain_reference += c[kQStage] * strain_stage;
  if (strain_sag.cols() > 0)
    strain_reference += strain_sag;
  system.setResponse(model->stiffness_damping / stage.tau_v, &strain_reference);
}

/// For frames that are carried from a stage inside the step to its end, by TR-BDF2: the strain at the stage's time by
/// the trapezoidal rule (the stage's own strain is a point on a chord, one order worse), then the two-step backward
/// difference. Second order, and damped however fast the frames relax.
void RodWork::setViscousResponseAtEnd(const Stage& stage, double h)
{
  const double c = plan->fraction, r = (1 - c) / c, weight = (1 + r) * (1 + r) / (1 + 2 * r);
  strain_end = strain_start + (0.5 * c * h) * (work.strain_rate + (strain_stage - strain_reference) / stage.tau_v);
  strain_end = weight * strain_end - (weight - 1) * strain_start;
  system.setResponse(model->stiffness_damping * (1 + 2 * r) / ((1 + r) * (1 - c) * h), &strain_end);
}

void RodWork::finishStrainHistory(const Stage& stage)
{
  system.strains(strain_end);
  const double c = plan->fraction;
  if (c == 1.0)
    next.strain_rate = (strain_end - strain_reference) / stage.tau_v;
  else
  {
    next.strain_previous = (1 - c) * strain_start + c * strain_end;   // the chord at the stage's time
    next.strain_rate = work.strain_rate +
                       ((next.strain_previous + strain_sag - strain_reference) / stage.tau_v - work.strain_rate) / c;
    next.strain_previous = strain_stage - next.strain_previous;
  }
  next.strain_rate_previous = work.strain_rate;
  if (time.integrator == Integrator::bdf2)
    next.strain_previous = strain_start;
  system.setResponse(0.0, nullptr);
  if (plan->fraction != 1.0)
    end_evaluation = system.evaluate(false);   // elastic alone
}

}   // namespace slender
