#pragma once

#include "slender_sim/world/world_model.h"
#include "slender_sim/world/world_state.h"

/// Islands: what is stepped together. Private to the world.
namespace slender {

/// Parts that are stepped as one system. An island knows which parts of the world it holds.
class Island
{
public:
  virtual ~Island() = default;
  Island() = default;
  Island(const Island&) = delete;
  Island& operator=(const Island&) = delete;

  /// Advances its parts by one step. On failure their state is untouched and the report says why.
  virtual StepReport step(WorldState& state, const WorldInputs& inputs) = 0;
  /// The stable equilibrium of its parts. Throws std::invalid_argument where the island has none.
  virtual StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs) = 0;
  /// Is called when all islands have made their step, and the time is that of its end. Writes into the state what
  /// follows from the step, and completes the report.
  virtual void finish(WorldState&, const WorldInputs&, StepReport&) {}
  /// Appends the contacts of the last step.
  virtual void addContacts(std::vector<ContactForce>&) const {}
  virtual void setThreads(int) {}
};

/// An island with rods. Rods are named by their place in the island.
class RodIsland : public virtual Island
{
public:
  virtual const std::vector<Wrench>& wrenches(int rod) const = 0;
  virtual RodEnergies rodEnergies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const = 0;
  /// Forces of contact on the nodes of a rod [N]; without columns for a rod that touches nothing.
  virtual Eigen::Matrix3Xd rodContactForces(int) const { return Eigen::Matrix3Xd(3, 0); }
  virtual RodStepper* stepper(int) { return nullptr; }   ///< of a rod that meets nothing
};

/// An island of cloths. Cloths are named by their place in the island.
class ClothIsland : public virtual Island
{
public:
  virtual ClothEnergies clothEnergies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const = 0;
  virtual const Eigen::Matrix3Xd& pinForces(int cloth) const = 0;
  virtual Eigen::Matrix3Xd clothContactForces(int cloth) const = 0;
  virtual void check(WorldState&) {}   ///< Throws std::invalid_argument where its cloths cross something.
};

/// Takes an island's part out of the state of the world by swapping, and gives it back at the end of its life, also
/// when a step throws.
template <class IslandType>
class Loan
{
public:
  Loan(IslandType& island, WorldState& state) : island_(island), state_(state) { island_.exchange(state_); }
  ~Loan() { island_.exchange(state_); }
  Loan(const Loan&) = delete;
  Loan& operator=(const Loan&) = delete;

private:
  IslandType& island_;
  WorldState& state_;
};

inline Pose normalized(const Pose& pose) { return {pose.position, pose.orientation.normalized()}; }

}   // namespace slender
