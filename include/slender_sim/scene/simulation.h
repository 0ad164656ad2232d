#pragma once

#include <memory>
#include <string>
#include <vector>

#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/scene/config.h"

namespace slender {

/// State of all objects of a scene at one instant.
struct SceneState
{
  double time = 0.0;          ///< simulated [s] = steps * step length
  std::uint64_t steps = 0;
  std::vector<RodState> rods;
};

/// Inputs of one step, latched before it. Indices follow the scene's order of grasps (over all rods).
struct SceneInputs
{
  std::vector<GraspTarget> grasps;
  Eigen::Vector3d wind{0, 0, 0};
};

/// A grasp of the scene: which rod, which of its grasps, and its configuration.
struct GraspRef { int rod; int index; const GraspConfig* config; };

/// The scene composed once from its checked configuration: models, steppers, initial state.
class Simulation
{
public:
  /// Throws SceneError (scene/reader.h) when the configuration cannot be built. With `start: equilibrium` it solves for it.
  explicit Simulation(SceneConfig config);

  const SceneConfig& config() const { return config_; }
  const SceneState& state() const { return state_; }
  const RodModel& rodModel(int rod) const { return steppers_[rod].model(); }
  const std::vector<GraspRef>& grasps() const { return grasps_; }

  /// Inputs as the scene itself defines them at the end of the coming step: tables evaluated, everything else held where it is.
  SceneInputs defaultInputs() const;

  /// One step of config().time.step. On failure the state is untouched.
  StepReport step(const SceneInputs& inputs);

  /// Back to the initial state.
  void reset();

  /// Takes hold of nodes first..last of a rod as they are now, under the name of an existing grasp of that rod.
  void attach(int grasp, int first_node, int last_node, Hold hold);
  void release(int grasp);

  const Wrench& wrench(int grasp) const;
  RodEnergies energies(int rod) const;

  /// Exact restart. save writes a temporary file and renames it; load throws std::runtime_error naming what does not fit.
  void save(const std::string& path) const;
  void load(const std::string& path);

private:
  SceneConfig config_;
  SceneState state_, initial_;
  std::vector<RodStepper> steppers_;
  std::vector<GraspRef> grasps_;
};

}  // namespace slender
