#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "../cloth/cloth_part.h"
#include "../rod/rod_part.h"
#include "../thread/thread_part.h"
#include "slender_sim/world/world_model.h"
#include "slender_sim/world/world_state.h"

/// Rods, threads, cloths, bodies and solids as JoinedParts and JoinedIsland share them. `index`: number in the world.
namespace slender {

struct JoinedRod
{
  int index;
  std::unique_ptr<RodStepper::Impl> stepper;
  std::unique_ptr<RodPart> part;
  RodInputs inputs;   ///< of the present step, with the targets of grasps that driven bodies carry
};

/// A simulated body.
struct JoinedBody
{
  int index;
  std::unique_ptr<BodyPart> part;
};

struct JoinedThread
{
  /// The thread, or a part that has broken off it.
  struct Strand
  {
    std::unique_ptr<ThreadStepper::Impl> stepper;
    std::unique_ptr<ThreadPart> part;
  };
  int index;
  std::vector<Strand> strands;   ///< as many as there have ever been at once
  ThreadInputs inputs, still;    ///< of the present step; without flow, for what has broken off
  ThreadGroupState work;         ///< its first strands are those of the present step
  std::array<EndLoad, 2> loads;
};

struct JoinedCloth
{
  int index;
  std::unique_ptr<ClothPart> part;
};

/// A solid that parts may touch.
struct JoinedSolid
{
  enum class Kind
  {
    obstacle,
    body,
    floor   ///< on which a thread slips
  } kind;
  int index;                        ///< of the obstacle, the body or the thread
  Obstacle obstacle;                ///< what others touch
  BodyPart* body = nullptr;         ///< that carries it; null: it moves as prescribed
  Pose X_BS{};                      ///< in the frame of the body
  std::vector<int> welded_rods{};   ///< places of rods that begin inside of it
};

/// Which parts of the world may meet, by their numbers.
struct IslandContent
{
  std::vector<int> rods, threads;
  std::vector<int> bodies;   ///< simulated ones, and driven ones that something is welded to or that have a shape
  std::vector<int> cloths;   ///< whose contact is the barrier
};

struct JoinedObjects
{
  /// Appends the grasps of the welds to the rods of the state, and makes room for the stiffnesses of contact. The model
  /// of the world must live as long.
  JoinedObjects(const WorldModel& world, IslandContent content, WorldState& state);
  /// The same rods and bodies without the threads and cloths, for steps of another kind. The state has the grasps of
  /// the welds.
  JoinedObjects(const JoinedObjects& other, const TimeConfig& time);
  JoinedObjects& operator=(const JoinedObjects&) = delete;

  /// Takes the inputs of the rods for a step. Returns false, and fills the report, where the inputs do not fit the
  /// state or are not finite.
  bool takeInputs(const WorldState& state, const WorldInputs& inputs, StepReport& report);

  const WorldModel& world;
  const IslandContent content;
  std::vector<JoinedRod> rods;
  std::vector<JoinedBody> bodies;
  std::vector<JoinedThread> threads;
  std::vector<JoinedCloth> cloths;
  std::vector<Weld> welds;   ///< rod: place in `rods`; body: number in the world
  std::vector<JoinedSolid> solids;

  // ---- numbers of all parts: rods, then threads, then cloths, then simulated bodies
  int parts() const { return partOfBody(bodies.size()); }
  int partOfThread(std::size_t thread) const { return static_cast<int>(rods.size() + thread); }
  int partOfCloth(std::size_t cloth) const { return partOfThread(threads.size()) + static_cast<int>(cloth); }
  int partOfBody(std::size_t body) const { return partOfCloth(cloths.size()) + static_cast<int>(body); }

private:
  void addParts(const TimeConfig& time);
  void addWelds(WorldState& state);
  void addSolids();
  void follow(const Weld& weld);
  BodyPart* simulated(int body) const;
  std::string badInput(const WorldState& state, const WorldInputs& inputs) const;
  void carryGrasps(const WorldInputs& inputs);
};

}   // namespace slender
