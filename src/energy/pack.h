#pragma once

#include "slender_sim/energy/vec3.h"

/// Eight doubles side by side, for kernels that are compiled once per instruction set (SLENDER_ISA). In their unnamed namespaces, so that
/// nothing is emitted under a shared name.
namespace slender {
namespace SLENDER_ISA {
namespace {

using Pack = double __attribute__((vector_size(64)));
using PackU = double __attribute__((vector_size(64), aligned(8), may_alias));
using Lanes = long long __attribute__((vector_size(64)));
constexpr int W = 8;
constexpr double kTwoPi = 6.283185307179586476925286766559;

SLENDER_INLINE Pack load(const double* p) { return *reinterpret_cast<const PackU*>(p); }
SLENDER_INLINE void store(double* p, Pack v) { *reinterpret_cast<PackU*>(p) = v; }
SLENDER_INLINE Vec3<Pack> load3(double* const* p, int i) { return {load(p[0] + i), load(p[1] + i), load(p[2] + i)}; }
SLENDER_INLINE void store3(double* const* p, int i, const Vec3<Pack>& v)
{
  store(p[0] + i, v.x);
  store(p[1] + i, v.y);
  store(p[2] + i, v.z);
}
SLENDER_INLINE Pack squareRoot(Pack v)
{
  Pack r;
  for (int k = 0; k < W; ++k)
    r[k] = __builtin_sqrt(v[k]);
  return r;
}
SLENDER_INLINE Pack minimum(Pack a, Pack b) { return a < b ? a : b; }
SLENDER_INLINE Pack maximum(Pack a, Pack b) { return a > b ? a : b; }
SLENDER_INLINE Pack absolute(Pack a) { return a < 0.0 ? -a : a; }
SLENDER_INLINE double sum(Pack v) { return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7])); }
/// Nearest integer for |v| < 2^51.
SLENDER_INLINE Pack nearest(Pack v)
{
  const double magic = 6755399441055744.0;
  return (v + magic) - magic;
}

/// sin and cos to round-off for |a| <= pi: Taylor on a/8, then three doublings.
SLENDER_INLINE void sineCosine(Pack a, Pack& s, Pack& c)
{
  const Pack y = a * 0.125, z = y * y;
  s = y * (1.0 + z * (-1.0 / 6 + z * (1.0 / 120 + z * (-1.0 / 5040 + z * (1.0 / 362880 + z * (-1.0 / 39916800 + z * (1.0 / 6227020800.0)))))));
  Pack v = z * (0.5 + z * (-1.0 / 24 + z * (1.0 / 720 + z * (-1.0 / 40320 + z * (1.0 / 3628800 + z * (-1.0 / 479001600))))));   // 1 - cos
  for (int k = 0; k < 3; ++k)
  {
    s = 2.0 * s * (1.0 - v);
    v = 2.0 * v * (2.0 - v);   // 1 - cos 2y = 2 sin^2 y = 2 v (2 - v)
  }
  c = 1.0 - v;
}

}  // namespace
}  // namespace SLENDER_ISA
}  // namespace slender
