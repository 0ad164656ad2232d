#pragma once

#include <memory>
#include <string>
#include <vector>

#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/dynamics/newton.h"
#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/rod/rod_system.h"

namespace slender {

/// Work space and parts of RodStepper. Memory is reused from step to step.
class RodStepper::Impl
{
public:
  Impl(std::shared_ptr<const RodModel> model, const TimeConfig& time);

  StepReport step(RodState& state, const RodInputs& inputs, double duration);
  StepReport solveEquilibrium(RodState& state, const RodInputs& inputs);

  std::shared_ptr<const RodModel> model;
  TimeConfig time;
  RodSystem system;
  std::vector<Wrench> wrenches;

private:
  // rod_stepper.cpp
  void resizeFor(const RodState& state);
  double stepFactor(double ratio) const;
  bool inputsFinite(const RodState& state, const RodInputs& inputs, std::string& what) const;
  static Pose graspPose(const GraspState& start, const GraspTarget& target, double duration, double s, Twist* velocity);
  void placeAt(const RodInputs& inputs, double duration, double fraction);
  Eigen::Vector3d load(const RodInputs& inputs, int node) const;
  StepFailure computeAcceleration(const RodInputs& inputs, double duration, double t);
  StepFailure implicitStep(const RodInputs& inputs, double duration, double t, double h, StepReport& report);
  void finishStep(const RodInputs& inputs, double duration, double t, double h, const Stage& stage, StepReport& report);
  Eigen::Vector3d heldVelocity(const RodInputs& inputs, double duration, double at, int node, const Eigen::Vector3d& otherwise);
  Eigen::Vector3d combine(const Combination& c, int node) const;
  void computeWrenches(const RodInputs& inputs, double h);
  StepReport refuse(StepReport& report, StepFailure failure, const std::string& message);
  double mechanicalEnergy(const RodState& s, const RodInputs& inputs, const RodEvaluation& e, double* allowance) const;
  std::string explainFailure(StepFailure failure, double length, bool explicit_step) const;

  // rod_statics.cpp
  void carryFreeNodes(const RodInputs& inputs, double weight);
  StepReport finishEquilibrium(RodState& state, const RodInputs& inputs, StepReport& report);

  // rod_explicit.cpp
  StepFailure explicitStep(const RodInputs& inputs, double duration, double t, double h, StepReport& report);

  // rod_viscous.cpp: strain history of Rayleigh stiffness damping
  void startStrainHistory(const RodInputs& inputs, double duration, double t);
  void setViscousResponse(const Stage& stage, double h);
  void setViscousResponseAtEnd(const Stage& stage, double h);
  void finishStrainHistory(const Stage& stage);

  const std::vector<GraspState>* origin = nullptr;
  RodState work, next;              ///< start and end of a substep
  StepPlan plan;
  RodEvaluation end_evaluation;     ///< at the end of a substep whose stage lies inside it
  Eigen::Matrix3Xd stage_q, stage_v;
  Eigen::Matrix4Xd strain_start, strain_stage, strain_reference, strain_end, strain_sag;
  std::vector<Pose> stage_poses;
};

}  // namespace slender
