#pragma once

#include <vector>

#include "slender_sim/scene/scene_grasps.h"
#include "slender_sim/scene/statics_run.h"

namespace slender {

/// Statics of a scene: equilibria under growing loads, and the load at which they cease to be stable. It works on the
/// world and the state of a simulation, which outlive it.
class StaticsRunner
{
public:
  /// `inputs` holds grasps, bodies and obstacles as their motions have them at time 0, and the loads at factor 1.
  /// Displacements count from `start`. Throws SceneError for objects that have no statics: cloth with contact, what
  /// tracks a guide, or nothing but threads.
  StaticsRunner(const SceneConfig& config, const SceneState& start, WorldInputs inputs, World& world,
                SceneGrasps& grasps, SceneState& state);

  /// The stable equilibrium that is reached from the present state under loads of this factor. The state becomes it.
  StepReport solve(double factor);
  /// What `statics` of the scene asks for; without the key one equilibrium.
  StaticsRun run();

private:
  Eigen::Vector3d gravityAt(double factor) const;
  /// All inputs of a rod at a load factor, with the imperfection.
  RodInputs loadsAt(int rod, double factor) const;
  /// What the load factor multiplies, times `factor`.
  RodInputs loadsPerFactor(int rod, double factor) const;
  RodStepper& stepper();   ///< of the only rod
  void perturb(double first_factor, StaticsRun& run);
  void runFactors(const std::vector<double>& factors, StaticsRun& run);
  void runPath(const PathConfig& path, StaticsRun& run);
  void findCritical(double up_to, StaticsRun& run);
  StaticsRow rowAt(double factor, const StepReport& report);

  const SceneConfig& config_;
  const SceneState& start_;
  const WorldInputs inputs_;
  World& world_;
  SceneGrasps& grasps_;
  SceneState& state_;
  FactorScales scales_;
  Eigen::Matrix3Xd imperfection_;   ///< forces on the nodes of the only rod [N]; without columns: none
};

}   // namespace slender
