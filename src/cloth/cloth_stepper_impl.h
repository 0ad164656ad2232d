#pragma once

#include "cloth_part.h"
#include "cloth_stages.h"
#include "cloth_statics.h"
#include "island/island.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

/// A cloth on its own: an island of one part, or explicit steps; and statics.
class ClothStepper::Impl : public ClothStages, SubstepEquations
{
public:
  Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o);

  StepReport step(ClothState& state, const ClothInputs& inputs, double duration);
  double stableStep() const;
  StepReport statics(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles);
  bool respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
               Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change);

  Eigen::Matrix3Xd lowest_mode;
  bool undivided = false;   ///< the present step is one of stepUndivided() that differs from those of the options

private:
  // cloth_stepper.cpp: implicit steps, and the substeps of explicit ones
  Island& island();
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep&) override { commitStep(); }
  bool shorterMayHelp(StepFailure failure) const override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;
  using ClothStages::refuse;
  std::string explain(StepFailure failure, double length) const override;
  void systemChanged() override;

  // cloth_explicit.cpp
  void useConstantMatrix();
  StepFailure explicitStep(double from, double to, StepReport& report);
  StepFailure imexStep(double from, double to, StepReport& report);

  std::unique_ptr<ClothStatics> statics_;   ///< from the first equilibrium on
  std::unique_ptr<ClothPart> part_;         ///< null: explicit steps
  /// Of the options, and of stepUndivided() if it steps otherwise; null until they are needed.
  std::unique_ptr<Island> island_, undivided_;
  std::unique_ptr<ShiftedMatrix> constant_;   ///< imex only
  double constant_h_ = 0;
  std::vector<char> constant_held_;
  std::vector<double> constant_weight_;
};

}   // namespace slender
