#pragma once

#include "slender_sim/scene/config.h"
#include "slender_sim/scene/statics_run.h"

namespace slender {

/// Prints the critical load and the equilibria of `simulate --statics` to stdout, with units.
void printEquilibria(const SceneConfig& scene, const StaticsRun& found);

/// Prints to stderr why statics failed, and which equilibria are unstable. Returns false when the program has failed:
/// when an equilibrium was not found, or when one is unstable that the scene does not accept. On a path all are
/// accepted.
bool reportStatics(const SceneConfig& scene, const StaticsRun& found);

}   // namespace slender
