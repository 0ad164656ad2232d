#pragma once

#include <deque>
#include <string>
#include <vector>

#include "body_object.h"
#include "cloth_object.h"
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

  /// Not of a floor.
  ContactPartner partner() const
  {
    return {kind == Kind::body ? ContactPartner::body : ContactPartner::obstacle, index};
  }
  /// For a contact of these objects, without the pose.
  ContactSolid asTouched(const std::vector<WorldObject*>& by) const;
};

/// Objects of the world, by their numbers.
struct WorldContent
{
  std::vector<int> rods;   ///< those that may meet something come first
  std::vector<int> threads;
  std::vector<int> bodies;   ///< simulated ones, and driven ones that something is welded to or that have a shape
  std::vector<int> cloths;   ///< that do not collide by impulses
};

struct WorldObjects
{
  /// Appends the grasps of the welds to the rods of the state, and makes room for what contact keeps. The model
  /// of the world must live as long.
  WorldObjects(const WorldModel& world, WorldContent content, WorldState& state);
  /// The bodies, and the rods that may meet something, for steps of another kind. The state has the grasps of the
  /// welds.
  WorldObjects(const WorldObjects& other, const TimeConfig& time);
  WorldObjects& operator=(const WorldObjects&) = delete;

  /// Takes the inputs of the rods for a step. Returns false, and fills the report, where the inputs do not fit the
  /// state or are not finite.
  bool takeInputs(const WorldState& state, const WorldInputs& inputs, StepReport& report);

  const WorldModel& world;
  const WorldContent content;
  std::deque<BodyObject> bodies;
  std::deque<RodObject> rods;
  std::deque<ClothObject> cloths;
  std::deque<ThreadObject> threads;
  /// All of them in this order. Bodies come first, because rods follow them.
  std::vector<WorldObject*> all;
  std::vector<Weld> welds;                   ///< rod: place in `rods`; body: number in the world
  std::vector<std::pair<int, int>> joined;   ///< places in `all` of rods and simulated bodies that welds join
  std::vector<WorldSolid> solids;

  /// Null: the body is driven.
  const BodyObject* simulated(int body) const;

private:
  void addObjects(const TimeConfig& time);
  void add(WorldObject& object);
  bool touch() const;
  void addWelds(WorldState& state);
  void addSolids();
  void follow(const Weld& weld);
  std::string badInput(const WorldState& state, const WorldInputs& inputs) const;
  void carryGrasps(const WorldInputs& inputs);
};

}   // namespace slender
