#pragma once

#include "slender_sim/world/world.h"

/// Weak constraints of tracked parts within a step of the world.
namespace slender {

/// Test functions in force of a tracked cloth.
const FunctionSet& functionsOf(const TrackedGuide& tracked, const ClothState& cloth);

/// The inputs of a cloth in the step: those of the world, and, if it tracks a guide, what its averages shall be at the
/// end of the step (3 x count [m]). A cloth that leads it has made its step before.
void takeClothInputs(const WorldModel& model, int cloth, const WorldState& state, const WorldInputs& inputs,
                     ClothInputs& to);

/// Distances of a tracked cloth from what its averages shall be.
TrackingError errorOf(const TrackedGuide& tracked, const ClothState& cloth, const GuideState& guide, double time,
                      const Eigen::Matrix3Xd& targets);

/// After a step: the guide of a cloth, if it tracks one, is where it was to go, and acted with these forces.
void takeClothGuide(const WorldModel& model, int cloth, const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& forces,
                    const WorldInputs& inputs, WorldState& state, StepReport& report);

/// Another set of test functions takes over, see World::setFunctions().
void takeOver(const TrackedGuide& tracked, std::size_t set, double blend, double time, ClothState& cloth,
              GuideState& guide);
/// Whether a set of test functions is due to take over in the step that begins now.
bool functionsDue(const WorldModel& model, const WorldState& state);
/// Has those sets take over that are due; of several that are due in the same step the latest.
void takeOverDue(const WorldModel& model, WorldState& state);

}   // namespace slender
