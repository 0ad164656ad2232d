#pragma once

#include <array>
#include <string>
#include <vector>

#include "slender_sim/scene/scene_grasps.h"
#include "slender_sim/scene/scene_state.h"

/// Transfers the state of a running scene to the edited scene. Objects with the same name are the same object in both
/// scenes, and likewise grasps of the same object.
namespace slender {

/// A weld of a scene. Lists are in the order of WorldModel::welds.
struct BodyWeld
{
  int body, index;     ///< indices of the body, and of the weld among the welds of this body
  int rod;             ///< that it holds
  std::size_t grasp;   ///< index among the grasps of the rod: welds follow its own grasps, in the order of all welds
};
/// Returns all welds of a scene.
std::vector<BodyWeld> weldsOf(const SceneConfig& config);

class StateTransfer
{
public:
  /// `before` and `now` are the grasps of the two scenes, in scene order. The configurations must outlive this object.
  StateTransfer(const SceneConfig& from, const SceneGrasps& before, const SceneConfig& to,
                const std::vector<GraspRef>& now);

  /// Throws SceneError if the table of a new object has already left its first pose at `time` [s].
  void checkTables(double time) const;
  /// Returns the reason why the edited scene has no initial state: a new body is welded to a rod that existed before.
  /// Returns an empty text if it has an initial state.
  std::string newWelds() const;
  /// Copies the poses of welded parts in their bodies.
  void takeWelds(const std::vector<Pose>& before, WorldModel& model) const;

  /// Copies `before` into `state`, which must be as the edited scene gives it, without the grasps of welds. New grasps
  /// of objects that stay are released. `world` is that of the edited scene. Throws SceneError if an object has another
  /// size than before.
  void take(const SceneState& before, const WorldModel& world, SceneState& state) const;
  /// Copies the parts that the constructor of World adds to a state: the grasps of welds, and the contact stiffness.
  void takeAdded(const SceneState& before, SceneState& state) const;
  /// Lets new grasps take hold of objects that stay, at their places at `time` [s]. Grasps of new objects and grasps
  /// that follow a new body take their offsets. Throws SceneError if a grasp needs nodes that are already held.
  void attachNew(SceneGrasps& grasps, double time) const;

private:
  /// Returns the index that an object had before the edit; -1: it is new.
  int indexBefore(const ObjectRef& object) const;
  bool isHeldAsBefore(int rod) const;
  void takeContacts(const std::vector<int>& same, const std::vector<ContactMemory>& from,
                    std::vector<ContactMemory>& to) const;
  void takeGrasps(const SceneState& before, SceneState& state) const;

  const SceneConfig& to_;
  const double gap_ratio_;   ///< the gap of contact before the edit over the one after it; 1 if a scene has no contact
  const std::vector<GraspRef> before_, now_;
  const std::vector<BodyWeld> welds_before_, welds_now_;
  // per object, grasp or weld of the edited scene: its index in the scene before the edit; -1: it is new
  std::array<std::vector<int>, 4> objects_;   ///< by ObjectRef::Kind
  const std::vector<int>&rods_ = objects_[ObjectRef::rod], &cloths_ = objects_[ObjectRef::cloth],
        &bodies_ = objects_[ObjectRef::body], &obstacles_ = objects_[ObjectRef::obstacle];
  std::vector<int> threads_, grasps_, welds_;
};

}   // namespace slender
