#pragma once

#include <memory>

#include "step_group.h"

/// Groups of threads. All throw std::invalid_argument for models that are not valid.
namespace slender {

/// A thread that touches nothing but its floor, and what has broken off it. The model of the world outlives the group.
std::unique_ptr<StepGroup> makeLoneThread(const WorldModel& world, int thread);
}   // namespace slender
