#pragma once

#include <vector>

#include "slender_sim/scene/config.h"
#include "slender_sim/world/world_state.h"

namespace slender {

/// Vertices of a cloth that move as one rigid body.
struct ClothGrasp : GraspFrame
{
  std::vector<int> vertices;   ///< ascending; no other active grasp of the cloth holds them
  Eigen::Matrix3Xd points_G;   ///< where they are in the grasp's frame [m]
};

/// State of all objects of a scene at one instant. The grasps of a rod in the scene come first in RodState::grasps.
struct SceneState : WorldState
{
  /// per cloth: those of the scene; ClothState::pins are what the active ones hold
  std::vector<std::vector<ClothGrasp>> cloth_grasps;
  /// Per grasp of the scene: the held section seen from the pose that drives it; with `attach: section` identity until
  /// attach().
  std::vector<Pose> grasp_offsets;
  std::vector<Wrench> wrenches;   ///< per grasp of the scene, of the last step
};

/// What drives one thread during a step.
struct ThreadDrive
{
  Pose nozzle;                              ///< at the end of the step
  double flow_rate = 0.0;                   ///< during it [m^3/s]
  Eigen::Vector3d belt_velocity{0, 0, 0};   ///< [m/s]
};

/// Inputs of one step, latched before it. Indices follow the scene's order of grasps (over all rods, then all
/// cloths) and of guides (over all tracked cloths, then all tracked rods).
struct SceneInputs
{
  std::vector<GraspTarget> grasps;
  std::vector<GraspTarget> bodies, obstacles;   ///< per body (simulated ones: ignored) and obstacle of the scene
  std::vector<ThreadDrive> threads;             ///< per thread of the scene
  /// The vertices or nodes of the guide of each tracked object at the end of the step (3 x n [m]). They are ignored if
  /// the guide is a cloth.
  std::vector<Eigen::Matrix3Xd> guides;
  Eigen::Vector3d wind{0, 0, 0};
};

/// A grasp of the scene. It says which rod or cloth has it, which of the grasps there it is, and how it is configured.
struct GraspRef
{
  ObjectRef object;
  int index;
  const GraspConfig* config;
};

/// A guide of the scene. It says which cloth or rod has it, the name of that object, and what the guide follows.
struct GuideRef
{
  ObjectRef object;
  std::string name;
  const TrackingConfig* tracking;
};

}   // namespace slender
