#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "slender_sim/dynamics/failure_place.h"
#include "slender_sim/world/world_model.h"
#include "slender_sim/world/world_state.h"

namespace slender {

/// A world cannot be built. `kind` and `index` tell the part that is not valid; kind none: several parts do not fit
/// together.
class WorldError : public std::invalid_argument
{
public:
  WorldError(FailurePlace::Kind part, int part_index, const std::string& what)
    : std::invalid_argument(what),
      kind(part),
      index(part_index)
  {
  }
  FailurePlace::Kind kind;
  int index;
};

/// Greatest distances of averages of a tracked part from those of its guide [m].
struct TrackingError
{
  double met = 0.0;        ///< of those that are met
  double at_bound = 0.0;   ///< of those whose forces are at their bounds
  double blend = 0.0;      ///< that functions which took over leave for now: the others count from there
};

/// Parts, and the islands in which they are stepped. An island is what contact or joints connect, stepped as one
/// system; a part that nothing else meets is an island of its own. Parts are named by their index in the model.
class World
{
public:
  /// Finds the islands of the model. Appends the grasps of welds to the rods of `state`. Throws WorldError for models
  /// that are not valid, and for states in which surfaces touch or cross already.
  World(WorldModel model, WorldState& state);
  ~World();

  const WorldModel& model() const;

  /// Advances by one step of model().time.step. On failure the whole state is untouched, and the report says why.
  StepReport step(WorldState& state, const WorldInputs& inputs);
  /// The stable equilibria of all rods, bodies and cloths under the inputs, one island after the other. Velocities
  /// become zero. Threads have none and stay as they are. On failure the whole state is untouched. Throws
  /// std::invalid_argument for tracked parts and for cloths with contact.
  StepReport solveEquilibrium(WorldState& state, const WorldInputs& inputs);

  /// Threads for lone rods and for contact (at least 1; default: that of the environment variable SLENDER_THREADS, or
  /// else of the processors). Results do not depend on it.
  void setThreads(int threads);
  /// Throws std::invalid_argument where cloths with contact cross something in this state.
  void checkCloths(WorldState& state);

  /// Loads on grasps, as RodStepper::wrenches(), and energies.
  const std::vector<Wrench>& rodWrenches(int rod) const;
  RodEnergies rodEnergies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const;
  /// The stepper of a rod that is an island of its own and tracks nothing; nullptr for others.
  RodStepper* rodStepper(int rod);

  const Eigen::Matrix3Xd& pinForces(int cloth) const;   ///< as ClothStepper::pinForces()
  /// Forces of contact on the vertices of a cloth or the nodes of a rod in the last step (3 x n [N]); zero if it
  /// touches nothing.
  Eigen::Matrix3Xd contactForces(const ObjectRef& part) const;
  ClothEnergies clothEnergies(int cloth, const ClothState& state, const Eigen::Vector3d& gravity) const;

  /// Contacts by the barrier in the last step.
  std::vector<ContactForce> contacts() const { return contactLoads().contacts; }
  /// The same, and what they exert on obstacles and bodies.
  ContactLoads contactLoads() const;
  /// All forces of contact are zero until the next step: the state has become another one.
  void forgetContacts();

  /// Test functions in force of a tracked cloth or rod.
  const FunctionSet& functions(const ObjectRef& part, const WorldState& state) const;
  /// Has another set of test functions act from the next step on. What its averages are away from the guide's goes
  /// within `blend` [s], without a jump in position or velocity; 0: in one step. Throws std::invalid_argument for
  /// functions that depend on each other on the vertices that are free.
  void setFunctions(int cloth, std::size_t set, double blend, WorldState& state) const;
  /// Of a cloth or a rod in this state; zero for parts that track nothing.
  TrackingError trackingError(const ObjectRef& part, const WorldState& state) const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
