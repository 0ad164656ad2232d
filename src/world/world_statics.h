#pragma once

#include <memory>

#include "island/statics.h"
#include "object_island.h"
#include "world_objects.h"

namespace slender {

/// Static equilibrium of the rods and bodies that may meet, as one island, without friction: steps of implicit Euler
/// that grow, from rest each time. Each minimises the energy with a proximal term whose weight is the mass over the
/// step squared. The weight never becomes zero, because contact needs a step. Saddles are left as Statics leaves them.
/// Threads stay where they are, and exert no forces on the other objects.
class WorldStatics : Statics
{
public:
  /// The objects must outlive the statics.
  explicit WorldStatics(WorldObjects& objects);
  void setThreads(int threads) { island_.setThreads(threads); }
  ObjectIsland& island() { return island_; }
  /// The objects of the statics, to which the contacts of its island refer.
  const WorldObjects& objects() const { return objects_; }

  /// Solves under the inputs. Velocities become zero, and what is driven is where its inputs put it. The wrenches of
  /// the objects, and the contacts of the island, become those of the equilibrium. On failure the state is untouched
  /// and the report says why.
  StepReport solve(WorldState& state, const WorldInputs& inputs);

private:
  void loadParts() override;
  void takeTrial() override;
  std::function<void()> wayBack() override;
  bool settleFrom(double lowest) override;

  void begin(double duration);
  void takeParts();
  StepReport step(double h);
  bool settle(double h);
  double unbalanced(double h, double& farthest) const;
  void copy(const WorldState& from, WorldState& to) const;

  WorldObjects& origin_;
  const TimeConfig time_;
  WorldObjects objects_;
  ObjectIsland island_;
  const WorldInputs* inputs_ = nullptr;
  WorldState work_, before_;   ///< rods and bodies of the island, and all obstacles
  double force_scale_ = 0.0;   ///< largest force so far [N]
  double lever_;               ///< divides moments to compare them with forces: the shortest edge [m]
};

/// The stable equilibrium of all rods and bodies: rods that meet nothing each on its own, the others as one island,
/// which becomes `together`. On failure the rods that were solved before have moved.
StepReport solveStatics(WorldObjects& objects, int threads, WorldState& state, const WorldInputs& inputs,
                        std::unique_ptr<WorldStatics>& together);

}   // namespace slender
