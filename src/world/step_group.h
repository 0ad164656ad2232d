#pragma once

#include "slender_sim/world/world_model.h"
#include "slender_sim/world/world_state.h"

namespace slender {

/// Objects of the world that are stepped one group after the other. A group knows which objects of the world it holds.
/// Its cloths are named by their place in the group. Private to the world.
class StepGroup
{
public:
  virtual ~StepGroup() = default;
  StepGroup() = default;
  StepGroup(const StepGroup&) = delete;
  StepGroup& operator=(const StepGroup&) = delete;

  /// Advances its objects by one step. On failure their state is untouched and the report says why.
  virtual StepReport step(WorldState& state, const WorldInputs& inputs) = 0;
  /// The stable equilibrium of its objects. Throws std::invalid_argument where the group has none.
  virtual StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) = 0;
  /// Is called when all groups have made their step, and the time is that of its end. Writes into the state what
  /// follows from the step, and completes the report.
  virtual void finish(WorldState&, const WorldInputs&, StepReport&) {}
  /// Adds the contacts of the last step, and what they exert on obstacles and bodies.
  virtual void addContacts(ContactLoads&) const {}
  /// The state is another one: there was no last step.
  virtual void forgetContacts() {}
  virtual void setThreads(int) {}

  // ---- of groups that hold cloths
  virtual ClothEnergies clothEnergies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const = 0;
  virtual const Eigen::Matrix3Xd& pinForces(int cloth) const = 0;
  /// Without columns before the first step.
  virtual Eigen::Matrix3Xd clothContactForces(int cloth) const = 0;
  virtual void check(WorldState&) {}   ///< Throws std::invalid_argument where its cloths cross something.
};

/// Takes the states of a group out of that of the world by swapping, and gives them back at the end of its life, also
/// when a step throws.
template <class Group>
class Loan
{
public:
  Loan(Group& group, WorldState& state) : group_(group), state_(state) { group_.exchange(state_); }
  ~Loan() { group_.exchange(state_); }
  Loan(const Loan&) = delete;
  Loan& operator=(const Loan&) = delete;

private:
  Group& group_;
  WorldState& state_;
};

inline Pose normalized(const Pose& pose) { return {pose.position, pose.orientation.normalized()}; }

}   // namespace slender
