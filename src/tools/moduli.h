#pragma once

#include "slender_sim/scene/simulation.h"

namespace slender {

/// Prints the moduli of the rods to stdout, whether the scene gives them or they follow from Young's modulus. Rods that
/// have the same moduli share a line.
void printModuli(const Simulation& simulation);

}   // namespace slender
