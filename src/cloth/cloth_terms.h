#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/energy/point_term.h"

namespace slender {

/// An energy in the list of a cloth.
struct ClothTerm
{
  std::unique_ptr<PointTerm> energy;
  /// Returns a constant matrix near the Hessian at rest that acts on each coordinate alike, for preconditioners. Empty:
  /// the constantMatrix() of the energy, or none.
  std::function<PointMatrix()> stand_in;
};

/// The energies that a cloth is made of, in the order in which they are summed. The model must outlive them. This is
/// where a new energy is listed.
std::vector<ClothTerm> clothTerms(const ClothModel& model);

/// The loads on a cloth that depend on velocities. The model must outlive them. Throws std::invalid_argument for
/// coefficients that are not valid.
std::vector<std::unique_ptr<PointLoad>> clothLoads(const ClothModel& model);

}   // namespace slender
