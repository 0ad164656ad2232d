#pragma once

#include <optional>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// Where something that moves as prescribed shall be at the end of the step. Without a velocity the motion inside the
/// step is uniform.
struct GraspTarget
{
  Pose X_WG;
  std::optional<Twist> velocity;
};

/// Pose (and velocity, may be null) at a fraction s of a motion of `duration` seconds from `start` to a target:
/// uniform, or a cubic through both ends' velocities.
Pose poseBetween(const Pose& start, const Twist& start_velocity, const GraspTarget& target, double duration, double s,
                 Twist* velocity);

}   // namespace slender
