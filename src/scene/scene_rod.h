#pragma once

#include "slender_sim/dynamics/time_config.h"
#include "slender_sim/rod/rod_model.h"
#include "slender_sim/scene/config.h"

/// From a rod of a scene to its model and its first state. Both throw std::invalid_argument with name, value and range.
namespace slender {

struct SceneRod
{
  RodModel model;
  /// Twist of the first state at each node [rad], unwrapped; empty: `initial_twist`, evenly over the joints.
  Eigen::VectorXd initial_twist;
};

/// The model of a rod whose rest shape is `rest`, with the curvature and the formulation that the rod asks for.
SceneRod buildSceneRod(const RodConfig& rod, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& gravity, Integrator integrator);

/// The state at rest at the nodes `initial`, with its frames.
RodState startSceneRod(const RodConfig& rod, const SceneRod& built, const Eigen::Matrix3Xd& initial);

}  // namespace slender
