#pragma once

#include <vector>

#include "../contact/island_stepper.h"
#include "../thread/thread_guard.h"
#include "joined_objects.h"
#include "thread_merging.h"

namespace slender {

/// Some of the parts that may meet, which are minimised together in a step, with their contact.
class JoinedIsland
{
public:
  /// `parts`: numbers of its parts, see JoinedObjects. The objects must outlive the island, and no part may be added.
  JoinedIsland(JoinedObjects& objects, const std::vector<int>& parts, const TimeConfig& time);
  JoinedIsland(const JoinedIsland&) = delete;
  JoinedIsland& operator=(const JoinedIsland&) = delete;

  /// Begins a step: takes the strands that its threads have now, the motion of solids and the stiffness of contact.
  void begin(const WorldState& state, const WorldInputs& inputs);
  /// Advances its parts, whose states have been loaded, by `duration` [s].
  StepReport step(double duration);
  /// Writes into the state what belongs to the island as a whole.
  void end(WorldState& state) const;
  bool stepped() const { return stepped_; }   ///< since forgetStep() and begin()
  void forgetStep() { stepped_ = false; }

  /// Box of the surface of a part over the last step, radii included [m]; `place`: among the island's parts.
  const BoundingBox& sweptBox(std::size_t place) const { return swept_[place]; }
  const std::vector<int>& parts() const { return parts_; }
  /// Contacts of the last step; null: nothing touches.
  const ContactPotential* contact() const { return stepper_.island().contact(); }
  IslandStepper& stepper() { return stepper_; }
  /// Threads that evaluate its parts; 0: as OpenMP says.
  void setThreads(int threads);

private:
  std::vector<ContactSolid> takeSolids();
  void setCarriers();
  void setSolids(const WorldState& state, const WorldInputs& inputs);
  void setMembers();
  void trace();

  const WorldModel& world_;
  JoinedObjects& objects_;
  const std::vector<int> parts_;
  std::vector<JoinedRod*> rods_;
  std::vector<JoinedThread*> threads_;
  std::vector<JoinedCloth*> cloths_;
  std::vector<JoinedBody*> bodies_;
  std::vector<const JoinedSolid*> solids_;   ///< that its parts may touch
  int nodes_ = 0;                            ///< of its rods
  ThreadGuard guard_;
  ThreadMerging merging_;
  std::vector<ThreadPart*> strands_;   ///< of the present step
  std::vector<IslandStepper::Member> members_;
  std::vector<ThreadGuard::Strand> guarded_;
  std::vector<BoundingBox> swept_;   ///< per part
  IslandStepper stepper_;
  bool stepped_ = false;
};

}   // namespace slender
