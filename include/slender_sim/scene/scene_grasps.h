#pragma once

#include <optional>
#include <string>
#include <vector>

#include "slender_sim/scene/scene_state.h"
#include "slender_sim/world/world.h"

namespace slender {

/// The grasps of a scene: first those of all rods, then those of all cloths. The class knows their held parts, their
/// driving frames, and the wrenches on them.
class SceneGrasps
{
public:
  std::size_t size() const { return refs_.size(); }
  const GraspRef& operator[](std::size_t grasp) const { return refs_[grasp]; }
  auto begin() const { return refs_.begin(); }
  auto end() const { return refs_.end(); }

  bool isActive(int grasp) const;
  /// Returns the pose of the held section, or of the frame of a cloth's grasp, in the world.
  const Pose& pose(int grasp) const;
  /// Returns the name of the rod or cloth that the grasp holds.
  const std::string& heldObject(int grasp) const;
  /// Returns the force [N] and torque [N m] on the gripper in the last step.
  const Wrench& wrench(int grasp) const;

  /// Returns the pose of the held section when the driving frame M of a grasp (a gripper or a body) is at X_WM. The
  /// offset in M is the one that the scene gives, or the one at the start (`attach: initial`). attach() and setOffset()
  /// replace it.
  GraspTarget targetOf(int grasp, const Pose& X_WM, const std::optional<Twist>& velocity = std::nullopt) const;
  /// Sets the offset in the driving frame from the present pose X_WM of this frame and the pose of the held section.
  void setOffset(int grasp, const Pose& X_WM);

  /// Lets an existing grasp of a rod take hold of nodes first..last at their present places. Nothing jumps, because the
  /// offset from a table, or from a body or obstacle of the scene, is measured again, whatever `attach` of the scene
  /// says. Throws std::invalid_argument if the grasp or the nodes do not exist, if another active grasp holds one of
  /// the nodes, or if several nodes are held by position.
  void attach(int grasp, int first_node, int last_node, Hold hold);
  /// Lets an existing grasp of a cloth take hold of vertices, given in any order. Throws std::invalid_argument if there
  /// are no vertices, if one does not exist, or if another grasp holds one.
  void attachVertices(int grasp, std::vector<int> vertices);
  void release(int grasp);

private:
  friend class Simulation;
  friend class StaticsRunner;
  friend class StateTransfer;

  /// The configuration, the model and the state must outlive the grasps.
  SceneGrasps(const SceneConfig& config, const WorldModel& model, SceneState& state, std::vector<GraspRef> refs);

  /// Sets the inputs that the scene itself defines at `time` [s]: tables are evaluated, all other objects stay in
  /// place.
  void inputsAt(double time, SceneInputs& inputs) const;
  /// Copies the targets of grasps to the inputs of the rods and cloths that they hold.
  void takeTargets(const SceneInputs& inputs, WorldInputs& world);
  /// Updates the poses of grasps of cloths to their targets, and the wrenches of all grasps. Call it after a step.
  void takeWrenches(const World& world);

  /// Throws std::invalid_argument if there is no such grasp.
  const GraspRef& checked(int grasp) const;
  void checkHeld(int rod, int grasp, int first_node, int last_node) const;
  /// Sets the offset from the driving frame: the pose of a table at `time` [s], or the present pose of the followed
  /// body or obstacle.
  void takeOffset(int grasp, double time);
  /// Returns the target of a grasp, or that of the body or obstacle that it follows.
  GraspTarget drivenTarget(int grasp, const SceneInputs& inputs) const;
  /// Returns the target of the followed body or obstacle, or nullptr if the scene has none of this name.
  const GraspTarget* followed(const BodyMotion& motion, const SceneInputs& inputs) const;
  GraspFrame& frameOf(const GraspRef& ref) const;

  const SceneConfig& config_;
  const WorldModel& model_;
  SceneState& state_;
  std::vector<GraspRef> refs_;
  std::vector<Pose> cloth_targets_;   ///< per grasp: pose at the end of the step; used for grasps of cloths
};

}   // namespace slender
