#pragma once

#include <cmath>

/// Lateral surface of a thread whose edges are cylinders of fixed volume (thesis 5.4.2): radii follow the edge lengths,
/// r = sqrt(V / (pi |e|)), so the surface around a node is a function of the lengths of the two edges alone.
namespace slender {

/// A function of two edge lengths with its derivatives.
struct LengthFunction
{
  double value = 0, d1 = 0, d2 = 0, d11 = 0, d12 = 0, d22 = 0;
};

inline double edgeRadius(double volume, double length) { return std::sqrt(volume / (M_PI * length)); }

/// What lies between the middles of two consecutive edges.
enum class SurfaceShape
{
  cone,   ///< a truncated cone: pi (r1 + r2) sqrt(l^2 + (r2 - r1)^2) with l = (L1 + L2) / 2, as in the thesis
  /// pi (r1 + r2) l: leaves out the slope of the surface, so that the tension is pi gamma r as in slender theory
  cylinder,
};

/// Area [m^2] around a node. Lengths L1, L2 [m] and volumes V1, V2 [m^3] of its edges positive.
inline LengthFunction surfaceArea(SurfaceShape shape, double L1, double V1, double L2, double V2)
{
  const double a = edgeRadius(V1, L1), b = edgeRadius(V2, L2);
  const double a1 = -0.5 * a / L1, a11 = 0.75 * a / (L1 * L1), b2 = -0.5 * b / L2, b22 = 0.75 * b / (L2 * L2);
  const double slope = shape == SurfaceShape::cone ? 1.0 : 0.0;
  const double sum = a + b, d = slope * (b - a), d1 = -slope * a1, d2 = slope * b2, d11 = -slope * a11,
               d22 = slope * b22;
  const double l = 0.5 * (L1 + L2), s = std::sqrt(l * l + d * d);   // slant height
  const double s1 = (0.5 * l + d * d1) / s, s2 = (0.5 * l + d * d2) / s;
  const double s11 = (0.25 + d1 * d1 + d * d11 - s1 * s1) / s;
  const double s22 = (0.25 + d2 * d2 + d * d22 - s2 * s2) / s;
  const double s12 = (0.25 + d1 * d2 - s1 * s2) / s;
  return {M_PI * sum * s,
          M_PI * (a1 * s + sum * s1),
          M_PI * (b2 * s + sum * s2),
          M_PI * (a11 * s + 2 * a1 * s1 + sum * s11),
          M_PI * (a1 * s2 + b2 * s1 + sum * s12),
          M_PI * (b22 * s + 2 * b2 * s2 + sum * s22)};
}

/// Area [m^2] of the half of an end edge that no node's cone covers: a cylinder, pi r L. Without it the last edge would
/// bear half the tension pi gamma r of the others. The flat end of the thread is left out, as in slender theory.
inline LengthFunction endArea(double L, double V)
{
  const double r = edgeRadius(V, L);
  return {M_PI * r * L, 0.5 * M_PI * r, 0, -0.25 * M_PI * r / L, 0, 0};
}

}   // namespace slender
