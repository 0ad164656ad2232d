#pragma once

#include "slender_sim/world/world.h"

/// Weak constraints of tracked rods and cloths within a step of the world.
namespace slender {

/// Test functions in force of a tracked part.
const FunctionSet& functionsOf(const WorldModel& model, const ObjectRef& part, const WorldState& state);

/// What the averages of a tracked part shall be at the end of the step (3 x count [m]). A cloth that leads it has made
/// its step before.
void takeTargets(const WorldModel& model, const ObjectRef& part, const WorldState& state, const WorldInputs& inputs,
                 Eigen::Matrix3Xd& targets);
/// The inputs of a cloth in the step: those of the world, and, if it tracks a guide, the targets of its averages.
void takeClothInputs(const WorldModel& model, int cloth, const WorldState& state, const WorldInputs& inputs,
                     ClothInputs& to);

/// Distances of a tracked part from what its averages shall be.
TrackingError errorOf(const WorldModel& model, const ObjectRef& part, const WorldState& state,
                      const Eigen::Matrix3Xd& targets);

/// After a step: the guide of a part, if it tracks one, is where it was to go, and acted with these forces.
void takeGuide(const WorldModel& model, const ObjectRef& part, const Eigen::Matrix3Xd& targets,
               const Eigen::Matrix3Xd& forces, const WorldInputs& inputs, WorldState& state, StepReport& report);

/// Another set of test functions takes over, see World::setFunctions().
void takeOver(const TrackedGuide& tracked, std::size_t set, double blend, double time, ClothState& cloth,
              GuideState& guide);
/// Whether a set of test functions is due to take over in the step that begins now.
bool functionsDue(const WorldModel& model, const WorldState& state);
/// Has those sets take over that are due; of several that are due in the same step the latest.
void takeOverDue(const WorldModel& model, WorldState& state);

}   // namespace slender
