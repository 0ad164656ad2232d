#pragma once

#include <memory>

#include "explicit_system.h"
#include "rod_stepper_impl.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

/// Advances a rod on its own by a step, and changes the state only when all of it is done.
class StepLoop : SubstepEquations
{
public:
  StepLoop(const TimeConfig& time, RodStepper::Impl& rod);
  ~StepLoop() override;

  StepReport step(RodState& state, const RodInputs& inputs, double duration);

private:
  bool begin(const RodState& state, StepReport& report);
  bool conserves(const RodState& state) const;
  StepFailure implicitStep(double t, double h, StepReport& report);
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep& substep) override;
  bool shorterMayHelp(StepFailure failure) const override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;

  const TimeConfig time_;
  RodStepper::Impl& rod_;
  std::unique_ptr<ExplicitSystem> explicit_;   ///< null: implicit steps
  const RodInputs* inputs_ = nullptr;
  double duration_ = 0;
  bool conserving_ = false;   ///< the present step may not add to the energy
  double most_energy_ = 0;    ///< of a step that conserves: that at its start and the allowance [J]
  StepPlan plan_;
};

}   // namespace slender
