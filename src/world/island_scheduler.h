#pragma once

#include <exception>
#include <map>
#include <memory>
#include <vector>

#include "island_finder.h"
#include "object_island.h"
#include "world_objects.h"
#include "world_statics.h"

namespace slender {

/// Steps the cloths that lead others, or all other objects of a world, with the obstacles that they meet. Private to
/// the world.
///
/// In each step the parts are divided into islands. The division begins with parts that are joined, or that would come
/// near each other if they kept their velocities. When all islands have made their step, parts of different islands
/// whose ways came near each other are joined, and these islands make their step again.
class IslandScheduler
{
public:
  /// Appends the grasps of the welds to the rods of the state. Throws std::invalid_argument for models that are not
  /// valid, and for states in which surfaces touch or cross.
  IslandScheduler(const WorldModel& world, bool leaders, WorldState& state);

  /// Advances its objects by one step. On failure their state is untouched and the report says why.
  StepReport step(WorldState& state, const WorldInputs& inputs);
  /// Of rods, bodies, and cloths that touch nothing. Threads have no equilibrium: they stay where they are, and the
  /// others do not feel them. Throws std::invalid_argument if there are other cloths, or objects that track a guide.
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs);
  /// Is called when all objects of the world have made their step, and the time is that of its end. Writes into the
  /// state what follows from the step, and completes the report.
  void finish(WorldState& state, const WorldInputs& inputs, StepReport& report);
  /// Adds the contacts of the last step, and what they exert on obstacles and bodies.
  void addContacts(ContactLoads& out) const;
  /// The state is another one: there was no last step.
  void forgetContacts();
  void setThreads(int threads) { threads_ = threads; }
  /// Throws std::invalid_argument where cloths that collide by impulses cross something.
  void checkCloths(const WorldState& state);

  // ---- of its objects, by their numbers in the world
  RodObject& rod(int number) { return objects_.rods.at(number); }
  ClothEnergies clothEnergies(int number, const ClothState& state, const Eigen::Vector3d& gravity) const;
  const Eigen::Matrix3Xd& pinForces(int number) const;
  Eigen::Matrix3Xd contactForces(const ObjectRef& of) const;   ///< on the nodes of a rod, the vertices of a cloth [N]

private:
  void checkIntegrator() const;
  Eigen::Matrix3Xd contactForces(const WorldObject& object, const Part& part, int count) const;
  void checkClearance(WorldState& state);
  void fitRanges(const Meeting& meeting, WorldState& state);

  bool endsHaveRoom(const WorldState& state, const WorldInputs& inputs, StepReport& report) const;
  bool begin(const WorldState& state, const WorldInputs& inputs, StepReport& report);
  void predict();
  void arrange(WorldState& state, const WorldInputs& inputs);
  StepReport stepIslands();
  StepReport stepAndJoin(WorldState& state, const WorldInputs& inputs);
  bool joinThoseThatMet();

  const WorldModel& world_;
  WorldObjects objects_;
  int nodes_ = 0;   ///< of its rods, and vertices of its cloths

  IslandFinder finder_;
  std::vector<IslandFinder::Reach> reach_;           ///< per object
  std::vector<Part*> parts_;                         ///< of one object
  std::map<std::vector<int>, ObjectIsland> known_;   ///< islands that have been needed, by the places of their objects
  std::vector<ObjectIsland*> islands_;               ///< of the present step, or the only one of the statics
  std::unique_ptr<WorldStatics> statics_;            ///< of the present equilibrium; null: a step came after it
  std::vector<int> places_;                          ///< objects of one island
  int threads_ = 0;                                  ///< See parallelFor().
  std::vector<StepReport> reports_;                  ///< of the islands that step in parallel
  std::vector<std::exception_ptr> errors_;           ///< that these islands throw
};

}   // namespace slender
