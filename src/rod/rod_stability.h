#pragma once

#include <Eigen/Core>

#include "rod_work.h"
#include "slender_sim/dynamics/equilibrium_search.h"

namespace slender {

/// What the second derivative of the energy says of an equilibrium of one rod. Held nodes and edges are fixed; material
/// frames are unknowns like the positions, with the sections' own (small) inertia about the tangent.
struct RodStability : EquilibriumStability
{
  double neutral = 0.0;   ///< half width of the band around zero in which round-off decides [1/s^2]
  /// of the lowest eigenvalue: four per node as RodSystem::direction(); no edge turns by more than 1 rad
  Eigen::VectorXd mode;
};

/// Of the configuration rod.work under its inputs. `spectrum` false: only the energy.
RodStability assessStability(RodWork& rod, bool spectrum);

}   // namespace slender
