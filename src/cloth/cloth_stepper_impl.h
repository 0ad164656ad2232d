#pragma once

#include "cloth_stages.h"
#include "cloth_statics.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

/// A cloth on its own: divides its steps and solves their stages; explicit steps and statics.
class ClothStepper::Impl : public ClothStages, SubstepEquations
{
public:
  Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o);

  StepReport step(ClothState& state, const ClothInputs& inputs, double duration);
  double stableStep() const;
  StepReport statics(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles);
  bool respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
               Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change);

  Eigen::Matrix3Xd average_forces, lowest_mode;

private:
  // cloth_stepper.cpp
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep&) override { commitStep(); }
  bool shorterMayHelp(StepFailure failure) const override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;
  using ClothStages::refuse;
  std::string explain(StepFailure failure, double length) const override;
  void systemChanged() override;

  // cloth_newton.cpp: an implicit step, and the equation of a stage
  StepFailure implicitStep(double from, double to, StepReport& report);
  StepFailure finishStep(StepReport& report);
  double workOnFree(const PointVector& forces) const;
  StepFailure minimize(StepReport& report);
  StepFailure linearized(StepReport& report);
  double largest(const PointVector& d) const;
  bool createsEnergy(double energy_end, double average_work, double pin_work) const;

  // cloth_explicit.cpp
  void useConstantMatrix();
  StepFailure explicitStep(double from, double to, StepReport& report);
  StepFailure imexStep(double from, double to, StepReport& report);

  std::unique_ptr<ClothStatics> statics_;   ///< from the first equilibrium on
  StepPlan own_plan_;
  PointVector best_;
  std::unique_ptr<ShiftedMatrix> constant_;   ///< imex only
  double constant_h_ = 0;
  std::vector<char> constant_held_;
  std::vector<double> constant_weight_;
};

}   // namespace slender
