#pragma once

#include "slender_sim/scene/limit_watch.h"
#include "slender_sim/scene/run_statistics.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Prints to stdout what `simulate` tells at the end of a run. `total` covers all steps, `wall` is the run time [s].
void printSummary(const Simulation& simulation, const RunStatistics& total, const LimitWatch& watch, double wall);

/// Returns true if the volume of the threads is accounted for. Otherwise prints the missing share to stderr.
bool checkVolumes(const Simulation& simulation);

/// Notes on stderr which objects stay in place without a node, because messages or tf move them.
void noteInputsOfNodes(const SceneConfig& scene);

}   // namespace slender
