// Explicit symplectic Euler [Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1.2] with frames that follow quasistatically.
#include <algorithm>
#include <cmath>

#include "rod_stepper_impl.h"

namespace slender {

StepFailure RodStepper::Impl::explicitStep(const RodInputs& inputs, double duration, double t, double h, StepReport& report)
{
  const int n = model->nodes();
  system.load(work);
  const bool viscous = model->stiffness_damping > 0;
  if (viscous)
  {
    startStrainHistory(inputs, duration, t);
    strain_reference = strain_start - work.strain_rate;   // rate over one second: ratio = damping
    system.setResponse(model->stiffness_damping, &strain_reference);
  }
  for (int i = 0; i < n; ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), load(inputs, i));
  placeAt(inputs, duration, t / duration);
  if (work.last_step == 0.0)
    system.relaxFrames();
  RodEvaluation now = system.evaluate(false);
  if (now.min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  if (!std::isfinite(now.energy()))
    return StepFailure::state_not_finite;
  report.max_strain = now.max_strain;

  next = work;
  for (int i = 0; i < n; ++i)
    if (system.isFree(i))
    {
      // damping at the end of the step: linear, so it costs nothing to treat implicitly
      const double damping = model->mass_damping * model->mass[i] + model->drag[i];
      next.v.col(i) = (model->mass[i] * work.v.col(i) - h * system.nodeGradient(i)) / (model->mass[i] + h * damping);
      next.x.col(i) += h * next.v.col(i);
    }
  system.solveFrames();
  system.accept();
  if (!viscous)
    system.turnFrames();   // one Newton step of the frames per time step: they trail by less than the step's own error
  for (int i = 0; i < n; ++i)
    system.setPosition(i, next.x.col(i));
  placeAt(inputs, duration, (t + h) / duration);
  for (int i = 0; i < n; ++i)
    if (!system.isFree(i))
    {
      next.x.col(i) = system.position(i);
      next.v.col(i) = heldVelocity(inputs, duration, t + h, i, Eigen::Vector3d::Zero());
    }
  if (viscous)
  {
    // massless frames relax in stiffness_damping seconds, which may be less than a step: that takes an implicit rate
    system.setResponse(model->stiffness_damping / h, &strain_start);
    system.evaluate(false);
    system.solveFrames();
    system.accept();
    system.turnFrames();
  }
  now = system.evaluate(false);
  if (now.min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  if (!std::isfinite(now.energy()) || !next.x.allFinite())
    return StepFailure::state_not_finite;
  computeWrenches(inputs, h);
  system.store(next);
  if (viscous)
  {
    system.strains(strain_end);
    next.strain_rate = (strain_end - strain_start) / h;
    system.setResponse(0.0, nullptr);
  }
  next.last_step = h;
  return StepFailure::none;
}

}  // namespace slender
