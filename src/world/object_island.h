#pragma once

#include <vector>

#include "island/island.h"
#include "thread/merging.h"
#include "thread/thread_guard.h"
#include "world_objects.h"

namespace slender {

/// Some of the objects that may meet, whose parts are minimised together in a step, with their contact. The strands of
/// a thread that touches nothing are stepped one after the other.
class ObjectIsland
{
public:
  /// `places`: of its objects in WorldObjects::all, ascending. The objects must outlive the island.
  ObjectIsland(WorldObjects& objects, const std::vector<int>& places, const TimeConfig& time);
  ObjectIsland(const ObjectIsland&) = delete;
  ObjectIsland& operator=(const ObjectIsland&) = delete;

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
  const ContactPotential* contact() const { return island_.equations().contact(); }
  /// Adds the contacts of the last step, and what they exert on obstacles and bodies.
  void addContacts(ContactLoads& out) const;
  Island& island() { return island_; }
  /// Whether its parts are worth several threads.
  bool isLarge() const;
  /// Threads that evaluate its parts; 0: see parallelFor().
  void setThreads(int threads);

private:
  void sortObjects();
  void addSurface(WorldObject& object);
  std::vector<ContactSolid> takeSolids();
  void setCarriers();
  void setSolids(const WorldState& state, const WorldInputs& inputs);
  void setParts();
  void setStrands();
  int numberOf(const ObjectRef& partner) const;
  void takeRanges(WorldState& state);
  void takeSprings(WorldState& state);
  void giveSprings(WorldState& state) const;
  bool isDivisible() const;
  void blameSolids(StepReport& report);
  template <class F>
  void forParts(F&& f) const;
  void trace();

  const WorldModel& world_;
  WorldObjects& shared_;
  const std::vector<int> places_;
  std::vector<WorldObject*> objects_;
  std::vector<RodObject*> rods_;   ///< among them, like the next two
  std::vector<ThreadObject*> threads_;
  std::vector<BodyObject*> bodies_;
  std::vector<const WorldSolid*> solids_;   ///< that its parts may touch
  std::vector<WorldObject*> surfaces_;      ///< objects with a surface, in the order of those of the contact
  std::vector<ObjectRef> partners_;         ///< these, as far as they are no threads, which come last
  /// Numbers of surfaces and solids in the contact, sorted by what they are.
  std::vector<std::pair<ObjectRef, int>> numbers_;
  std::vector<std::vector<std::pair<int, double>>> ranges_;   ///< per solid, see ContactSolid::ranges
  int nodes_ = 0;                                             ///< of its rods
  ThreadGuard guard_;
  ThreadMerging merging_;
  std::vector<Part*> parts_, single_;
  std::vector<std::size_t> parts_end_;   ///< per object: its parts end before this one
  std::vector<ThreadPart*> strands_;     ///< of the present step
  std::vector<ThreadGuard::Strand> guarded_;
  std::vector<BoundingBox> swept_;   ///< per object
  Island island_;
  bool stepped_ = false;
};

}   // namespace slender
