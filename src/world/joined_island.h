#pragma once

#include <vector>

#include "../contact/island_stepper.h"
#include "../thread/thread_guard.h"
#include "joined_objects.h"
#include "thread_merging.h"

namespace slender {

/// Some of the objects that may meet, whose parts are minimised together in a step, with their contact.
class JoinedIsland
{
public:
  /// `places`: of its objects in JoinedObjects::all, ascending. The objects must outlive the island.
  JoinedIsland(JoinedObjects& objects, const std::vector<int>& places, const TimeConfig& time);
  JoinedIsland(const JoinedIsland&) = delete;
  JoinedIsland& operator=(const JoinedIsland&) = delete;

  /// Begins a step of its objects, which have been loaded: takes the parts that they have now, the motion of solids and
  /// the stiffness of contact.
  void begin(WorldState& state, const WorldInputs& inputs);
  /// Advances its parts by `duration` [s].
  StepReport step(double duration);
  /// Writes into the state what belongs to the island as a whole.
  void end(WorldState& state) const;
  bool stepped() const { return stepped_; }   ///< since forgetStep() and begin()
  void forgetStep() { stepped_ = false; }

  /// Box of the surface of an object over the last step, radii included [m]; `k`: among the island's objects.
  const BoundingBox& sweptBox(std::size_t k) const { return swept_[k]; }
  const std::vector<int>& places() const { return places_; }   ///< of its objects
  /// Contacts of the last step; null: nothing touches.
  const ContactPotential* contact() const { return stepper_.island().contact(); }
  IslandStepper& stepper() { return stepper_; }
  /// Threads that evaluate its parts; 0: as OpenMP says.
  void setThreads(int threads);

private:
  void sortObjects();
  std::vector<ContactSolid> takeSolids();
  void setCarriers();
  void setSolids(const WorldState& state, const WorldInputs& inputs);
  void setMembers();
  void setStrands();
  void trace();

  const WorldModel& world_;
  JoinedObjects& shared_;
  const std::vector<int> places_;
  std::vector<WorldObject*> objects_;
  std::vector<RodObject*> rods_;   ///< among them, like the next two
  std::vector<ThreadObject*> threads_;
  std::vector<BodyObject*> bodies_;
  std::vector<const JoinedSolid*> solids_;   ///< that its parts may touch
  int nodes_ = 0;                            ///< of its rods
  ThreadGuard guard_;
  ThreadMerging merging_;
  std::vector<IslandStepper::Member> members_;
  std::vector<std::size_t> member_end_;   ///< per object: its members end before this one
  std::vector<ThreadPart*> strands_;      ///< of the present step
  std::vector<ThreadGuard::Strand> guarded_;
  std::vector<BoundingBox> swept_;   ///< per object
  IslandStepper stepper_;
  bool stepped_ = false;
};

}   // namespace slender
