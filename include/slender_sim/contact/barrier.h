#pragma once

#include <cmath>

namespace slender {

/// Barrier energy -k (g - c)^2 ln(g/c) of a gap 0 < g < c [Li et al., Incremental Potential Contact, 2020, (6)], scaled
/// so that the force at half the cut-off c is 1: multiply by a force [N] to get joules. All are zero from c on and
/// twice continuously differentiable there.
struct Barrier
{
  explicit Barrier(double cutoff) : c(cutoff), scale(1.0 / (cutoff * (std::log(2.0) + 0.5))) {}

  double energy(double g) const { return g < c ? -scale * (g - c) * (g - c) * std::log(g / c) : 0.0; }   ///< [m]
  /// -energy' [-]
  double force(double g) const
  {
    return g < c ? scale * (2.0 * (g - c) * std::log(g / c) + (g - c) * (g - c) / g) : 0.0;
  }
  /// energy'' [1/m]
  double stiffness(double g) const
  {
    const double y = (g - c) / g;
    return g < c ? scale * (y * (y - 4.0) - 2.0 * std::log(g / c)) : 0.0;
  }

  double c;   ///< [m]
  double scale;
};

}   // namespace slender
