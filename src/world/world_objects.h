#pragma once

#include <algorithm>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "body_object.h"
#include "cloth_object.h"
#include "impulse_cloths.h"
#include "rod_object.h"
#include "thread_object.h"
#include "slender_sim/world/world_model.h"
#include "slender_sim/world/world_state.h"

/// The objects of a world, and the solids that they meet, as islands of them share them.
namespace slender {

/// A solid that parts may touch.
struct WorldSolid
{
  enum class Kind
  {
    obstacle,
    body,
    floor   ///< on which a thread slips
  } kind;
  int index;                                   ///< of the obstacle, the body or the thread
  Obstacle obstacle;                           ///< what others touch
  BodyPart* body = nullptr;                    ///< that carries it; null: it moves as prescribed
  Pose X_BS{};                                 ///< in the frame of the body
  std::vector<const WorldObject*> ignores{};   ///< that never touch it: its body, and rods that are welded into it

  std::string name() const;   ///< "obstacle 'table'"
  /// Not of a floor.
  ObjectRef partner() const { return {kind == Kind::body ? ObjectRef::body : ObjectRef::obstacle, index}; }
  /// For a contact of these objects, without the pose.
  ContactSolid asTouched(const std::vector<WorldObject*>& by) const;
};

/// The object of this kind with this number in the world; null: it is not among these. They are in ascending order.
template <class Objects>
auto* findObject(Objects& objects, int number)
{
  const auto at = std::lower_bound(objects.begin(), objects.end(), number,
                                   [](const WorldObject& object, int n) { return object.index < n; });
  return at != objects.end() && at->index == number ? &*at : nullptr;
}

struct WorldObjects
{
  /// The cloths that lead others, or all other objects. Appends the grasps of the welds to the rods of the state, and
  /// makes room for what contact keeps. The model of the world must live as long.
  WorldObjects(const WorldModel& world, bool leaders, WorldState& state);
  /// The bodies, and the rods that may meet something, for steps of another kind. The state has the grasps of the
  /// welds.
  WorldObjects(const WorldObjects& other, const TimeConfig& time);
  WorldObjects& operator=(const WorldObjects&) = delete;

  /// Takes the inputs of the rods for a step. Returns false, and fills the report, where the inputs do not fit the
  /// state or are not finite.
  bool takeInputs(const WorldState& state, const WorldInputs& inputs, StepReport& report);

  const WorldModel& world;
  std::deque<BodyObject> bodies;
  std::deque<RodObject> rods;
  std::deque<ClothObject> cloths;   ///< that do not collide by impulses
  std::deque<ThreadObject> threads;
  std::optional<ImpulseCloths> impulses;   ///< nothing: no cloth collides by impulses
  /// All of them in this order. Bodies come first, because rods follow them.
  std::vector<WorldObject*> all;
  std::vector<Weld> welds;                   ///< rod and body: numbers in the world
  std::vector<std::pair<int, int>> joined;   ///< places in `all` of rods and simulated bodies that welds join
  std::vector<WorldSolid> solids;

private:
  void addBodies();
  void addRod(int number, const TimeConfig& time);
  void addCloths(bool leaders);
  void addThreads();
  void add(WorldObject& object);
  bool touch() const;
  void addWelds(WorldState& state);
  void addSolids(bool with_bodies);
  void follow(const Weld& weld);
  std::string badInput(const WorldState& state, const WorldInputs& inputs) const;
  void carryGrasps(const WorldInputs& inputs);
};

/// Moves driven bodies and obstacles to the poses that they have at the end of a step of this duration [s].
void moveGiven(const WorldModel& world, const WorldInputs& inputs, double duration, WorldState& state);

}   // namespace slender
