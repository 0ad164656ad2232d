#pragma once

#include <optional>
#include <string>
#include <vector>

#include "slender_sim/scene/scene_state.h"
#include "slender_sim/world/world.h"

namespace slender {

/// The grasps of a scene, over all its rods and then all its cloths: what they hold, what drives them, and what they
/// bear.
class SceneGrasps
{
public:
  std::size_t size() const { return refs_.size(); }
  const GraspRef& operator[](std::size_t grasp) const { return refs_[grasp]; }
  auto begin() const { return refs_.begin(); }
  auto end() const { return refs_.end(); }

  bool isActive(int grasp) const;
  /// Where the held section, or the frame of a cloth's grasp, is.
  const Pose& pose(int grasp) const;
  /// Name of the rod or cloth that it holds.
  const std::string& heldObject(int grasp) const;
  /// Force and torque on the gripper in the last step.
  const Wrench& wrench(int grasp) const;

  /// Returns the pose of the held section when the driving frame M of a grasp (a gripper or a body) is at X_WM. The
  /// offset in M is the one that the scene gives, or the one at the start (`attach: initial`). attach() and setOffset()
  /// replace it.
  GraspTarget targetOf(int grasp, const Pose& X_WM, const std::optional<Twist>& velocity = std::nullopt) const;
  /// Takes the offset between the driving frame now at X_WM and the held section.
  void setOffset(int grasp, const Pose& X_WM);

  /// Takes hold of nodes first..last of a rod as they are now, under the name of an existing grasp of that rod. Nothing
  /// jumps: the offset from a table, or from a body or obstacle of the scene, is taken anew, whatever `attach` says of
  /// the scene's start. Throws std::invalid_argument: no such grasp or nodes, overlap with another active grasp,
  /// several nodes held by position.
  void attach(int grasp, int first_node, int last_node, Hold hold);
  /// Likewise of vertices of a cloth, in any order. Throws std::invalid_argument: no such vertices, none, held by
  /// another grasp.
  void attachVertices(int grasp, std::vector<int> vertices);
  void release(int grasp);

private:
  friend class Simulation;
  friend class StaticsRunner;
  friend class StateTransfer;

  /// The configuration, the model and the state outlive the grasps.
  SceneGrasps(const SceneConfig& config, const WorldModel& model, SceneState& state, std::vector<GraspRef> refs);

  /// Inputs as the scene itself defines them at `time`: tables evaluated, everything else held where it is.
  void inputsAt(double time, SceneInputs& inputs) const;
  /// Hands the targets of grasps over to the rods and cloths that they hold.
  void takeTargets(const SceneInputs& inputs, WorldInputs& world);
  /// After a step: grasps of cloths are where they were to go; wrenches of all.
  void takeWrenches(const World& world);

  void check(int grasp) const;
  void checkHeld(int rod, int grasp, int first_node, int last_node) const;
  /// The offset from the driving frame as a table has it at `time`, or as a body or obstacle of the scene stands now.
  void takeOffset(int grasp, double time);
  /// What drives a grasp: its target, or the body or obstacle that it follows.
  GraspTarget drivenTarget(int grasp, const SceneInputs& inputs) const;
  /// Of the frame that a grasp with a body's motion follows; null when the scene has no such body or obstacle.
  const GraspTarget* followed(const BodyMotion& motion, const SceneInputs& inputs) const;
  GraspState& held(const GraspRef& ref) { return state_.rods[ref.rod].grasps[ref.index]; }
  const GraspState& held(const GraspRef& ref) const { return state_.rods[ref.rod].grasps[ref.index]; }

  const SceneConfig& config_;
  const WorldModel& model_;
  SceneState& state_;
  std::vector<GraspRef> refs_;
  std::vector<Pose> cloth_targets_;   ///< per grasp: of those of cloths, where they are at the end of the step
};

}   // namespace slender
