#pragma once

#include <string>

#include "slender_sim/dynamics/step_report.h"

namespace slender {

/// Share of the lowest bending stiffness (of a rod: bending modulus over mass and length cubed; of a cloth: over mass
/// and length squared) below which an eigenvalue counts as zero. Within this band the energies of the two branches
/// differ by its square, 1e-12 of the energy, which is lost in round-off: no computation tells them apart.
constexpr double kNeutralShare = 1e-6;

/// Why statics ended without an equilibrium, and what to change. Statics has no time step, so the advice never mentions
/// one. `objects`: "rods" or "cloth"; `start`: the key of their initial shape.
std::string explainStatics(StepFailure failure, const std::string& objects = "rods",
                           const std::string& start = "initial");

}   // namespace slender
