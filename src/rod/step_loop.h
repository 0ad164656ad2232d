#pragma once

#include <memory>
#include <vector>

#include "coupled_system.h"
#include "explicit_system.h"
#include "rod_stepper_impl.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

/// Advances one rod, or rods with bodies and contact together, by a step, and changes the states only when all of it is
/// done.
class StepLoop : SubstepEquations
{
public:
  /// `group` null: a single rod on its own.
  StepLoop(const TimeConfig& time, std::vector<RodStepper::Impl*> rods, const RodGroupModel* group = nullptr);
  ~StepLoop() override;

  /// One state and one input per rod. `group`, its bodies and obstacles, for coupled rods only.
  StepReport step(RodState* states, const RodInputs* inputs, double duration, RodGroupState* group = nullptr,
                  const RodGroupInputs* group_inputs = nullptr);
  CoupledSystem* coupled() { return coupled_.get(); }   ///< of implicit steps of a group, else null

private:
  bool begin(const RodState* states, StepReport& report);
  bool conserves(const RodState* states) const;
  double energy(bool at_start, double* allowance);
  StepFailure implicitStep(double t, double h, StepReport& report);
  std::size_t farthestFromBalance() const;
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep& substep) override;
  bool shorterMayHelp(StepFailure failure) const override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;

  const TimeConfig time_;
  std::vector<RodStepper::Impl*> rods_;
  std::unique_ptr<CoupledSystem> coupled_;     ///< null: a single rod on its own, or explicit steps
  std::unique_ptr<ExplicitSystem> explicit_;   ///< null: implicit steps
  const RodInputs* inputs_ = nullptr;
  double duration_ = 0;
  bool conserving_ = false;   ///< the present step may not add to the energy
  double most_energy_ = 0;    ///< of a step that conserves: that at its start and the allowance [J]
  std::size_t failed_ = 0;    ///< rod that the last failure is about
  StepPlan plan_;
};

}   // namespace slender
