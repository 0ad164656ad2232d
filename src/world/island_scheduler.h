#pragma once

#include <map>
#include <vector>

#include "step_group.h"
#include "island_finder.h"
#include "object_island.h"
#include "world_objects.h"
#include "group_loop.h"

namespace slender {

/// Rods, threads, cloths and bodies that contact or welds can join, and the obstacles that they meet.
///
/// In each step the parts are divided into islands. The division begins with parts that are joined, or that would come
/// near each other if they kept their velocities. When all islands have made their step, parts of different islands
/// whose ways came near each other are joined, and these islands make their step again.
class IslandScheduler final : public StepGroup
{
public:
  /// Appends the grasps of the welds to the rods of the state. Throws std::invalid_argument for models that are not
  /// valid, and for states in which surfaces touch or cross.
  IslandScheduler(const WorldModel& world, WorldContent content, WorldState& state);

  StepReport step(WorldState& state, const WorldInputs& inputs) override;
  /// Of rods, bodies, and cloths that touch nothing. Threads have no equilibrium: they stay where they are, and the
  /// others do not feel them. Throws std::invalid_argument if there are other cloths, or objects that track a guide.
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) override;
  void finish(WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  void addContacts(ContactLoads& out) const override;
  void forgetContacts() override { islands_.clear(); }
  void setThreads(int threads) override { loop_.threads = threads; }
  ClothEnergies clothEnergies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const override
  {
    return objects_.cloths[cloth].part().work().energies(state, gravity);
  }
  const Eigen::Matrix3Xd& pinForces(int cloth) const override
  {
    return objects_.cloths[cloth].part().work().pin_forces;
  }
  Eigen::Matrix3Xd clothContactForces(int cloth) const override
  {
    return contactForces(objects_.cloths[cloth], objects_.cloths[cloth].part());
  }

  /// A rod, named by its place in the content.
  RodObject& rod(int place) { return objects_.rods[place]; }
  /// On its nodes [N]; without columns for a rod that touches nothing.
  Eigen::Matrix3Xd rodContactForces(int place) const
  {
    return contactForces(objects_.rods[place], *objects_.rods[place].part);
  }

private:
  Eigen::Matrix3Xd contactForces(const WorldObject& object, const Part& part) const;
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
  std::vector<ObjectIsland*> islands_;               ///< of the present step
  std::vector<int> places_;                          ///< objects of one island
  GroupLoop loop_;
};

}   // namespace slender
