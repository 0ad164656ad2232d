#pragma once

#include <cmath>

namespace slender {

/// Coulomb friction as a spring that softens until it slips: the energy per normal force and coefficient, zero without
/// a stretch [Li et al., Incremental Potential Contact, 2020, (15)]. Once continuously differentiable at e, twice below
/// and above.
struct SmoothedCoulomb
{
  double e;   ///< stretch [m] from which the full force acts

  double energy(double y) const { return y < e ? y * y / e * (1.0 - y / (3.0 * e)) : y - e / 3.0; }   ///< [m]
  /// energy' / y [1/m]
  double forceOverSlip(double y) const { return y < e ? (2.0 - y / e) / e : 1.0 / y; }
  /// Stretch [m] at which the force is this share of the full one, in [0, 1].
  double stretchAt(double share) const { return e * (1.0 - std::sqrt(1.0 - share)); }
  /// energy'' [1/m]
  double slope(double y) const { return y < e ? 2.0 * (1.0 - y / e) / e : 0.0; }
};

}   // namespace slender
