#pragma once

#include "slender_sim/energy/surface_tension.h"
#include "slender_sim/thread/thread_state.h"

namespace slender {

/// Returns the area [m^2] of the thread's surface: what surrounds its nodes, and the caps of its free ends. Times the
/// surface tension this is the thread's surface energy. Edges that lie on the floor count as well, but between a lying
/// edge and one that moves there is no cone: what moves ends there, as in the step's equations.
double surfaceArea(const ThreadState& state, SurfaceShape shape = SurfaceShape::cone);

}   // namespace slender
