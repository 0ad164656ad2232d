#pragma once

#include <memory>
#include <string>

#include "cloth_statics.h"
#include "cloth_system.h"
#include "slender_sim/cloth/plastic_flow.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/dynamics/substep_controller.h"

namespace slender {

class ClothStepper::Impl : SubstepEquations
{
public:
  Impl(std::shared_ptr<const ClothModel> m, const ClothOptions& o);

  void useBudget(std::shared_ptr<WorkBudget> budget);
  StepReport step(ClothState& state, const ClothInputs& inputs, double duration);
  double stableStep();
  StepReport statics(ClothState& state, const ClothInputs& inputs, bool search, bool leave_saddles);
  /// Lets the clamped faces act that `state` holds, and no others. Comes before each use of the system with another
  /// state.
  void followClamps(const ClothState& state);
  bool respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
               Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change);

  std::shared_ptr<const ClothModel> model;
  ClothOptions options;
  std::unique_ptr<ClothSystem> system;
  Eigen::Matrix3Xd pin_forces, average_forces, lowest_mode;

private:
  // cloth_stepper.cpp
  bool inputsFine(const ClothState& state, const ClothInputs& inputs, double duration, std::string& what) const;
  StepReport refuse(StepReport& report, StepFailure failure, const std::string& message) const;
  std::string explain(StepFailure failure, double length);
  /// Refuses a step of `length` seconds that could not be solved. The message says why and where the cloth was farthest
  /// from a solution.
  StepReport refuseUnsolved(StepReport& report, StepFailure failure, double length);
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep& substep) override;
  bool shorterMayHelp(StepFailure failure) const override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;
  StepFailure implicitStep(const ClothInputs& inputs, double from, double to, double duration, StepReport& report);
  void combine(const Combination& c, PointVector& result) const;
  StepFailure finish(const Stage& stage, const ClothInputs& inputs, double h, double fraction, StepReport& report);
  double workOnFree(const PointVector& forces) const;
  Eigen::Vector3d pinAt(const ClothInputs& inputs, std::size_t pin, double fraction) const;
  void useConstantMatrix();
  bool isExplicit() const
  {
    return options.integrator == Integrator::symplectic_euler || options.integrator == Integrator::imex;
  }

  // cloth_newton.cpp: a stage's equation
  StepFailure minimize(StepReport& report);
  StepFailure linearized(StepReport& report);
  double largest(const PointVector& d) const;
  bool createsEnergy(double energy_end, double average_work, double pin_work) const;

  // cloth_explicit.cpp
  StepFailure explicitStep(const ClothInputs& inputs, double from, double to, double duration, StepReport& report);
  StepFailure imexStep(const ClothInputs& inputs, double from, double to, double duration, StepReport& report);
  ClothEvaluation addForces(const ClothInputs& inputs, bool with_constant);
  ClothEvaluation acceleration(const ClothInputs& inputs, double delta);

  std::unique_ptr<ClothStatics> statics_;   ///< from the first equilibrium on
  /// what the system is of, where not all clamped faces of the model act; otherwise null
  std::shared_ptr<const ClothModel> clamped_model_;
  std::vector<int> clamp_pins_;   ///< of the state whose clamped faces act; with clamped faces only
  bool clamps_known_ = false;
  std::shared_ptr<WorkBudget> budget_;
  bool own_budget_ = true;
  long ownWork() const { return own_budget_ ? budget_->done() : 0; }   ///< others report their budgets themselves
  PlasticFlow plastic_;
  const ClothInputs* inputs_ = nullptr;   ///< of the present step
  double duration_ = 0;                   ///< of the present step [s]
  ClothState work_, next_;                ///< start of a substep, and its end
  Eigen::Matrix3Xd pins_start_, averages_start_, averages_, wind_v_;
  std::vector<int> at_bound_;
  StepPlan plan_;
  PointVector x_, best_, trial_, d_, pin_motion_, v_, force_;
  PointVector x_start_, v_start_, a_start_, x_stage_, v_stage_, q_hat_, q_tilde_, guess_;   ///< of an implicit step
  std::unique_ptr<ShiftedMatrix> constant_;                                                 ///< imex only
  double constant_h_ = 0;
  std::vector<char> constant_held_;
  std::vector<double> constant_weight_;
  double shortest_edge_ = 0;
  /// At the start of an implicit step, as evaluate() counts it there, and the elastic energy itself [J]. Steps of one
  /// stage count that of the end in the same way; steps of two, whose stages have viscous forces of their own, without
  /// these.
  double energy_start_ = 0, elastic_start_ = 0;
};

}   // namespace slender
