#pragma once

namespace slender {

/// Coulomb friction smoothed over slips up to e: the dissipated energy per normal force and coefficient
/// [Li et al., Incremental Potential Contact, 2020, (15)]. Once continuously differentiable at e, twice below and
/// above.
struct SmoothedCoulomb
{
  double e;   ///< slip [m] from which the full force acts

  double energy(double y) const { return y < e ? y * y / e * (1.0 - y / (3.0 * e)) + e / 3.0 : y; }   ///< [m]
  /// energy' / y [1/m]
  double forceOverSlip(double y) const { return y < e ? (2.0 - y / e) / e : 1.0 / y; }
  /// energy'' [1/m]
  double slope(double y) const { return y < e ? 2.0 * (1.0 - y / e) / e : 0.0; }
};

}   // namespace slender
