#pragma once

#include "slender_sim/dynamics/time_config.h"
#include "slender_sim/rod/rod_stepper.h"
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
SceneRod buildSceneRod(const RodConfig& rod, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& gravity,
                       Integrator integrator);

/// Spreads the point loads of a rod over the forces on its nodes and the torques on its edges; both are empty where the
/// scene gives none. Each of the two edges at an inner node bears half of a torque there.
RodInputs rodLoads(const RodConfig& rod, const RodModel& model, Integrator integrator);

/// Gives a clamped section the orientation of `direction` and `director` in place of that of its motion's poses. What
/// is left out of the two stays as it is at the start, at `section`: the tangent, or the first material axis, carried
/// to the new tangent by the smallest rotation. Returns the angle by which the section turns at the first pose [rad].
double orientGrasp(GraspConfig& grasp, const Pose& section);

/// The state at rest at the nodes `initial`, with its frames.
RodState startSceneRod(const RodConfig& rod, const SceneRod& built, const Eigen::Matrix3Xd& initial);

}   // namespace slender
