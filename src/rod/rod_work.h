#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "slender_sim/rod/isotropic_rod.h"
#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/dynamics/newton.h"
#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/rod/rod_system.h"

namespace slender {

/// The working copy of a rod: its part in a step and its work space, which is reused from step to step.
class RodWork
{
public:
  RodWork(std::shared_ptr<const RodModel> model, const TimeConfig& time);

  std::shared_ptr<const RodModel> model;
  TimeConfig time;
  RodSystem system;
  std::vector<Wrench> wrenches;
  RodState work, next;   ///< start and end of a substep
  /// Of all grasps at the instant being solved for. Those of grasps carried by bodies are set from outside.
  std::vector<Pose> stage_poses;
  std::vector<Twist> carried_velocity;   ///< of the frames of grasps carried by bodies

  // rod_stepper.cpp: a whole step, in substeps
  /// The inputs must live as long as the step of `duration` seconds.
  void begin(const RodState& state, const RodInputs& step_inputs, double step_duration);
  bool inputsFinite(const RodState& state, const RodInputs& inputs, std::string& what) const;
  /// Takes the end of the substep as the present state. Its grasps move on, so that clamps measure turns from where
  /// they are.
  void accept();
  /// Held nodes and frames at a fraction of the step; poses of carried grasps stay as they are.
  void placeAt(double fraction);
  RodEnergies energies(const RodState& state, const Eigen::Vector3d& gravity);
  double startEnergy(double* allowance);
  double endEnergy() const { return mechanicalEnergy(next, end_evaluation, nullptr); }
  StepReport refuse(StepReport& report, StepFailure failure, const std::string& message);
  /// Largest unbalanced force [N] on a free node in the last evaluation of an implicit step.
  Largest unbalancedForce() const;
  /// Refuses a step of `length` seconds that could not be solved. The message says why and where the rod was farthest
  /// from a solution. `why`: takes the place of explainFailure(); empty: nothing does.
  void refuseUnsolved(StepReport& report, StepFailure failure, double length, const std::string& why);
  Eigen::Vector3d load(int node) const;

  // rod_stages.cpp: an implicit substep; the stages' equations are solved between beginStage and endStage or finish
  StepFailure beginSubstep(const StepPlan& step_plan, const Substep& next_substep);
  void beginStage(std::size_t stage);
  void endStage(std::size_t stage);
  void finish(StepReport& report);
  /// Wrenches of the grasps at the last evaluation, for a substep of h seconds; 0: at rest.
  void computeWrenches(double h);

  /// From now on edges have inertia about their tangents, see RodState::spin.
  void keepSpins();

  // rod_explicit.cpp: an explicit substep; bodies move and constraints are projected between its two functions
  StepFailure explicitPredict(const Substep& next_substep, StepReport& report);
  StepFailure explicitFinish();
  /// Adds force(node) [N] on each node of active grasps to the wrenches of these. Those of grasps that bodies carry
  /// change only with `carried`.
  template <class Force>
  void addToWrenches(const Force& force, bool carried = false)
  {
    for (std::size_t k = 0; k < wrenches.size(); ++k)
    {
      const GraspState& g = work.grasps[k];
      for (int i = g.first_node; g.active && (carried || g.body < 0) && i <= g.last_node; ++i)
      {
        const Eigen::Vector3d f = force(i);
        wrenches[k].force += f;
        wrenches[k].torque += (work.x.col(i) - g.X_WG.position).cross(f);
      }
    }
  }
  std::array<int, 2> overstretched{-1, -1};   ///< held nodes that the last failed projection found too far apart

  const RodInputs* inputs = nullptr;   ///< of the step
  double duration = 1.0;               ///< of the step [s]
  const StepPlan* plan = nullptr;      ///< of the substep
  Substep substep;

private:
  double spinEnergy(const RodState& state) const
  {
    return state.spin.size() > 0 ? 0.5 * model->spin_inertia.dot(state.spin.cwiseAbs2()) : 0.0;
  }
  double mechanicalEnergy(const RodState& s, const RodEvaluation& e, double* allowance) const;
  std::string explainFailure(StepFailure failure, double length) const;
  /// Pose (and velocity) of a grasp at a fraction of the whole step: uniform motion, or a cubic through both ends'
  /// velocities.
  Pose graspPose(std::size_t grasp, double fraction, Twist* velocity) const
  {
    const GraspState& start = (*origin)[grasp];
    return poseBetween(start.X_WG, start.velocity, inputs->grasps[grasp], duration, fraction, velocity);
  }
  StepFailure computeAcceleration();
  Eigen::Vector3d heldVelocity(double at, int node, const Eigen::Vector3d& otherwise);
  Eigen::Vector3d combine(const Combination& c, int node) const;

  // rod_spin.cpp: turns of edges about their tangents, with inertia
  double combineTurn(const Combination& c, int edge) const;
  void beginSpins();
  void beginSpinStage(std::size_t stage, double h);
  void endSpinStage(std::size_t stage);
  void finishSpins();

  // rod_explicit.cpp
  RodEvaluation evaluateStart();
  /// Of its elasticity and its loads on a node [N].
  Eigen::Vector3d nodeForce(int node) const
  {
    return load(node) - (isotropic ? isotropic->nodeGradient(node) : system.nodeGradient(node));
  }
  void elasticWrenches();
  void holdNodes(double at);

  // rod_viscous.cpp: strain history of Rayleigh stiffness damping
  void startStrainHistory();
  void setViscousResponse(const Stage& stage, double h);
  void setViscousResponseAtEnd(const Stage& stage, double h);
  void finishStrainHistory(const Stage& stage);

  bool without_frames;   ///< a state may come without them
  const std::vector<GraspState>* origin = nullptr;
  RodEvaluation end_evaluation;   ///< at the end of a substep whose stage lies inside it
  Eigen::Matrix3Xd stage_q, stage_v;
  bool spins = false;
  Eigen::VectorXd stage_turn, stage_spin;
  std::unique_ptr<IsotropicRod> isotropic;   ///< explicit steps of isotropic rods
  Eigen::Matrix4Xd strain_start, strain_stage, strain_reference, strain_end, strain_sag;
};

}   // namespace slender
