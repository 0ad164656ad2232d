#pragma once

#include <cmath>
#include <limits>

namespace slender {

/// The lowest eigenvalue of K v = lambda M v, K symmetric and M positive definite.
struct LowestEigenvalue
{
  double value = 0.0;   ///< to a thousandth; 0 when it lies within the neutral band
  double shift = 0.0;   ///< K + shift M is positive definite, and close to singular: what inverse iteration factors
};

/// Component k of the start of an inverse iteration, which has no symmetry that a mode could be orthogonal to.
inline double startOfMode(double k) { return std::sin(1.0 + 1.7 * k) + 0.5 * std::cos(0.3 * k); }

/// Finds the lowest eigenvalue by bisection. `definite(s)` factors K + s M and returns whether it is positive definite;
/// s may be negative. By Sylvester's law of inertia K + s M is definite exactly when the lowest eigenvalue is above -s,
/// so that no start vector can miss a mode. Eigenvalues of size `neutral` (> 0) or less count as zero. Returns minus
/// infinity when no shift makes the matrix definite.
template <class Definite>
LowestEigenvalue lowestEigenvalue(Definite&& definite, double neutral)
{
  constexpr double kGrowth = 8.0, kRelative = 1.001, kMost = 1e36;
  // sizes of the eigenvalue, of which the first is too small and the second too large
  double near = neutral, far = kGrowth * neutral;
  const bool negative = !definite(neutral);
  if (!negative && !definite(-neutral))
  {
    definite(neutral);   // the factor that `shift` belongs to
    return {0.0, neutral};
  }
  while (definite(negative ? far : -far) != negative)
  {
    near = far;
    far *= kGrowth;
    if (!(far < kMost * neutral))
      return negative ? LowestEigenvalue{-std::numeric_limits<double>::infinity(), 0.0} : LowestEigenvalue{near, -near};
  }
  while (far > kRelative * near)
  {
    const double middle = std::sqrt(near * far);
    (definite(negative ? middle : -middle) == negative ? far : near) = middle;
  }
  const double shift = negative ? far : -near;
  definite(shift);
  return {(negative ? -1.0 : 1.0) * std::sqrt(near * far), shift};
}

}   // namespace slender
