#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../contact/island_stepper.h"
#include "../rod/rod_part.h"
#include "../thread/thread_guard.h"
#include "../thread/thread_part.h"
#include "island.h"
#include "thread_merging.h"

namespace slender {

/// The parts of one island, by their numbers in the world.
struct IslandContent
{
  std::vector<int> rods, threads;
  std::vector<int> bodies;   ///< simulated ones, and driven ones that something is welded to or that have a shape
};

/// Rods, threads, and bodies that contact or welds join, and the obstacles that they meet. All of them are minimised
/// together, in implicit steps.
class JoinedParts final : public RodIsland
{
public:
  /// Appends the grasps of the welds to the rods of the state. Throws std::invalid_argument for models that are not
  /// valid, and for states in which surfaces touch or cross.
  JoinedParts(const WorldModel& world, IslandContent content, WorldState& state);

  StepReport step(WorldState& state, const WorldInputs& inputs) override;
  /// Of rods and bodies. Threads have no equilibrium: they stay where they are, and the others do not feel them.
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) override;
  void finish(WorldState& state, const WorldInputs& inputs, StepReport& report) override;
  const std::vector<ContactTerm>* contacts() const override;
  void setThreads(int threads) override;
  const std::vector<Wrench>& wrenches(int rod) const override { return rods_[rod].stepper->wrenches; }
  RodEnergies energies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const override
  {
    return rods_[rod].stepper->energies(state, gravity);
  }

private:
  struct Rod
  {
    int index;   ///< in the world
    std::unique_ptr<RodStepper::Impl> stepper;
    std::unique_ptr<RodPart> part;
    RodInputs inputs;   ///< of the present step, with the targets of grasps that driven bodies carry
  };
  struct Body
  {
    int index;
    std::unique_ptr<BodyPart> part;
  };
  /// A thread, or a part that has broken off it.
  struct Strand
  {
    std::unique_ptr<ThreadStepper::Impl> stepper;
    std::unique_ptr<ThreadPart> part;
  };
  struct Thread
  {
    int index;
    std::vector<Strand> strands;   ///< as many as there have ever been at once
    ThreadInputs inputs, still;    ///< of the present step; without flow, for what has broken off
    ThreadGroupState work;
    std::array<EndLoad, 2> loads;
  };
  /// Where a solid of the contact comes from.
  struct Solid
  {
    enum class Kind
    {
      obstacle,
      body,
      floor   ///< on which a thread slips
    } kind;
    int index;   ///< of the obstacle, the body or the thread
  };

  void addRods(WorldState& state);
  void addThreads();
  void addContact();
  BodyPart* simulated(int body) const;
  std::vector<int> objectsWeldedTo(int body) const;

  std::string badInput(const WorldState& state, const WorldInputs& inputs) const;
  bool endsHaveRoom(const WorldState& state, const WorldInputs& inputs, StepReport& report) const;
  bool begin(const WorldState& state, const WorldInputs& inputs, StepReport& report);
  bool beginThreads(const WorldState& state, const WorldInputs& inputs, StepReport& report);
  void setSolids(const WorldState& state, const WorldInputs& inputs);
  void carryGrasps(const WorldInputs& inputs);
  void setMembers();
  void end(WorldState& state);
  void endThread(Thread& thread);
  double& stiffnessOf(WorldState& state) const;
  void addStrand(Thread& thread) const;
  void checkClearance(const WorldState& state);

  const WorldModel& world_;
  const IslandContent content_;
  std::vector<Rod> rods_;
  std::vector<Body> bodies_;   ///< simulated ones
  std::vector<Thread> threads_;
  std::vector<Weld> welds_;   ///< rod: place in rods_; body: of the world
  std::vector<Solid> solids_;
  ThreadGuard guard_;
  ThreadMerging merging_;
  bool merges_ = false;
  std::vector<ThreadPart*> strands_;   ///< of the present step
  std::vector<IslandStepper::Member> members_;
  std::vector<ThreadGuard::Strand> guarded_;
  IslandStepper stepper_;
};

}   // namespace slender
