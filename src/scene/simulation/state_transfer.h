#pragma once

#include <string>
#include <vector>

#include "slender_sim/scene/scene_grasps.h"
#include "slender_sim/scene/scene_state.h"

/// From the state of a scene that runs to that of the edited scene. Objects, and grasps of an object, are the same in
/// both if their names are.
namespace slender {

class StateTransfer
{
public:
  /// The configurations must outlive it. `before`, `now`: grasps of the two scenes, in their order.
  StateTransfer(const SceneConfig& from, const SceneGrasps& before, const SceneConfig& to,
                const std::vector<GraspRef>& now);

  /// Throws SceneError when a table of an object that is new has moved on from its first pose at `time`.
  void checkTables(double time) const;
  /// Why the two scenes have no common start: a new body is welded to a rod that was there before. Empty: they have.
  std::string newWelds() const;
  /// Hands over where in their bodies welds are.
  void takeWelds(const std::vector<Pose>& before, WorldModel& model) const;

  /// Into a state as the scene gives it, without the grasps of welds. New grasps of objects that stay are released.
  /// Throws SceneError for objects whose sizes differ; `world`: of the edited scene.
  void take(const SceneState& before, const WorldModel& world, SceneState& state) const;
  /// Into what the world has added to that state: the grasps of welds, and the stiffness of contact.
  void takeAdded(const SceneState& before, SceneState& state) const;
  /// New grasps take hold where their objects are at `time`; those of new objects, and those that follow a body which
  /// is new, take their offsets. Throws SceneError for nodes that are held already.
  void attachNew(SceneGrasps& grasps, double time) const;

private:
  bool ownerStays(const GraspRef& grasp) const;
  bool isHeldAsBefore(int rod) const;
  void takeGrasps(const SceneState& before, SceneState& state) const;

  const SceneConfig &from_, &to_;
  const std::vector<GraspRef> before_, now_;
  // per object, grasp or weld of the edited scene: which of the scene before it is; -1: it is new
  std::vector<int> rods_, threads_, cloths_, bodies_, obstacles_, grasps_, welds_;
};

}   // namespace slender
