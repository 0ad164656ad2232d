// Static equilibria of a cloth as the stepper offers them.
#include "slender_sim/cloth/cloth_stepper.h"

#include "cloth_stepper_impl.h"
#include "dynamics/statics_advice.h"

namespace slender {

/// Searches for an equilibrium from `state`, or only assesses `state` when `search` is false.
StepReport ClothStepper::Impl::statics(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles)
{
  StepReport report;
  if (!accepts(state, inputs, 1.0, report))
    return report;
  const bool blown = !system->loads().empty() && inputs.wind != Eigen::Vector3d::Zero();
  if (!model->averages.empty() || plastic_.active() || blown)
    return refuse(report, StepFailure::input_not_finite,
                  "statics is for elastic cloth under gravity, loads and grasps: leave out " +
                      std::string(plastic_.active() ? "plasticity"
                                  : blown           ? "wind"
                                                    : "what it tracks") +
                      ", or let the cloth settle by time stepping with damping");
  followClamps(state);
  if (!statics_)
    statics_ = std::make_unique<ClothStatics>(clamped_model_ ? *clamped_model_ : *model, options.newton);
  if (!search)
    statics_->assess(state, inputs, report);
  else if (const StepFailure failure = statics_->solve(state, inputs, leave_saddles, report);
           failure != StepFailure::none)
    return refuse(report, failure, explainStatics(failure, "cloth", "start of the cloth"));
  pin_forces = statics_->pinForces();
  lowest_mode = statics_->mode();
  return report;
}

StepReport ClothStepper::solveEquilibrium(ClothState& state, const ClothInputs& inputs, bool leave_saddles)
{
  return impl_->statics(state, inputs, true, leave_saddles);
}
StepReport ClothStepper::assessEquilibrium(const ClothState& state, const ClothInputs& inputs)
{
  ClothState copy = state;
  return impl_->statics(copy, inputs, false, false);
}
const Eigen::Matrix3Xd& ClothStepper::lowestMode() const { return impl_->lowest_mode; }

}   // namespace slender
