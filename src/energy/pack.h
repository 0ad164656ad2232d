#pragma once

#include "slender_sim/energy/vec3.h"

/// Eight doubles side by side, for kernels that are compiled once per instruction set (SLENDER_ISA). In their unnamed
/// namespaces, so that nothing is emitted under a shared name.
namespace slender {
namespace SLENDER_ISA {
namespace {

using Pack = double __attribute__((vector_size(64)));
using PackU __attribute__((aligned(8), may_alias)) = Pack;
// Clang overlooks aligned() beside vector_size()
static_assert(alignof(PackU) == 8, "loads and stores may be anywhere");
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
  s = y * (1.0 + z * (-1.0 / 6 +
                      z * (1.0 / 120 +
                           z * (-1.0 / 5040 + z * (1.0 / 362880 + z * (-1.0 / 39916800 + z * (1.0 / 6227020800.0)))))));
  // 1 - cos
  Pack v =
      z * (0.5 + z * (-1.0 / 24 + z * (1.0 / 720 + z * (-1.0 / 40320 + z * (1.0 / 3628800 + z * (-1.0 / 479001600))))));
  for (int k = 0; k < 3; ++k)
  {
    s = 2.0 * s * (1.0 - v);
    v = 2.0 * v * (2.0 - v);   // 1 - cos 2y = 2 sin^2 y = 2 v (2 - v)
  }
  c = 1.0 - v;
}

/// atan2 in (-pi, pi] for arguments on the unit circle: three half-angle steps, then the Taylor series.
SLENDER_INLINE Pack angleOf(Pack s, Pack c)
{
  const Pack ca = absolute(c);
  Pack u = s / (ca + squareRoot(s * s + c * c));
  u = u / (1.0 + squareRoot(1.0 + u * u));
  u = u / (1.0 + squareRoot(1.0 + u * u));
  const Pack z = u * u;   // |u| <= tan(pi/16)
  Pack series = Pack{} + 1.0 / 23;
  for (int k = 21; k >= 1; k -= 2)
    series = 1.0 / k - z * series;
  const Pack a = 8.0 * u * series;
  const Pack pi = Pack{} + kTwoPi / 2;
  return c < 0.0 ? (s < 0.0 ? -pi - a : pi - a) : a;
}

/// atan2 in (-pi, pi] of unit vectors, to round-off: one half-angle step and one of division bring tan below
/// tan(pi/16).
SLENDER_INLINE Pack angleOfUnit(Pack s, Pack c)
{
  // tan(a/2) in [0, 1] of the acute angle a, less pi/8 where that leaves a smaller one
  const Pack y = absolute(s), x = absolute(c);
  const Pack norm = squareRoot(s * s + c * c);
  const Pack t = y / (x + norm + 1e-300);
  const double shift = 0.41421356237309504880;                                               // tan(pi/8)
  const Pack low = Pack{} + 0.19891236737965800691, mid = Pack{} + 0.66817863791929891999;   // tan(pi/16), tan(3 pi/16)
  const Pack zero = {}, one = zero + 1.0;
  const Pack centre = t > mid ? one : t > low ? zero + shift : zero;
  const Pack offset = t > mid ? zero + 0.78539816339744830962 : t > low ? zero + 0.39269908169872415481 : zero;
  const Pack u = (t - centre) / (1.0 + t * centre);
  const Pack z = u * u;
  Pack series = zero + 1.0 / 23;
  for (int k = 21; k >= 1; k -= 2)
    series = 1.0 / k - z * series;
  Pack a = 2.0 * (offset + u * series);
  const Pack pi = zero + kTwoPi / 2;
  a = c < 0.0 ? pi - a : a;
  return s < 0.0 ? -a : a;
}

/// In-register transposition of an 8 x 8 block.
SLENDER_INLINE void transpose(Pack (&m)[8])
{
  Pack u[8];
  for (int k = 0; k < 8; k += 2)
  {
    u[k] = __builtin_shufflevector(m[k], m[k + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    u[k + 1] = __builtin_shufflevector(m[k], m[k + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  Pack v[8];
  for (int k = 0; k < 8; k += 4)
    for (int a = 0; a < 2; ++a)
    {
      v[k + a] = __builtin_shufflevector(u[k + a], u[k + a + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      v[k + a + 2] = __builtin_shufflevector(u[k + a], u[k + a + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (int a = 0; a < 4; ++a)
  {
    m[a] = __builtin_shufflevector(v[a], v[a + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    m[a + 4] = __builtin_shufflevector(v[a], v[a + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

using Quad = double __attribute__((vector_size(32)));

/// Points ids[0..7] of an array with 4 doubles per point, aligned to 32 bytes.
SLENDER_INLINE Vec3<Pack> gatherPoints(const double* x, const int* ids)
{
  Pack v[4];   // point k and point k + 4
  for (int k = 0; k < 4; ++k)
  {
    const Quad low = *reinterpret_cast<const Quad*>(x + 4 * ids[k]),
               high = *reinterpret_cast<const Quad*>(x + 4 * ids[k + 4]);
    v[k] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
  }
  const Pack xz01 = __builtin_shufflevector(v[0], v[1], 0, 8, 2, 10, 4, 12, 6, 14),
             y01 = __builtin_shufflevector(v[0], v[1], 1, 9, 3, 11, 5, 13, 7, 15);
  const Pack xz23 = __builtin_shufflevector(v[2], v[3], 0, 8, 2, 10, 4, 12, 6, 14),
             y23 = __builtin_shufflevector(v[2], v[3], 1, 9, 3, 11, 5, 13, 7, 15);
  return {__builtin_shufflevector(xz01, xz23, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(y01, y23, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(xz01, xz23, 2, 3, 10, 11, 6, 7, 14, 15)};
}

/// Adds to them, one after another: ids may repeat.
SLENDER_INLINE void scatterPoints(double* x, const int* ids, const Vec3<Pack>& v)
{
  const Pack zero = {};
  const Pack even = __builtin_shufflevector(v.x, v.y, 0, 8, 2, 10, 4, 12, 6, 14),
             odd = __builtin_shufflevector(v.x, v.y, 1, 9, 3, 11, 5, 13, 7, 15);
  const Pack even_z = __builtin_shufflevector(v.z, zero, 0, 8, 2, 10, 4, 12, 6, 14),
             odd_z = __builtin_shufflevector(v.z, zero, 1, 9, 3, 11, 5, 13, 7, 15);
  const Pack quads[4] = {__builtin_shufflevector(even, even_z, 0, 1, 8, 9, 4, 5, 12, 13),
                         __builtin_shufflevector(odd, odd_z, 0, 1, 8, 9, 4, 5, 12, 13),
                         __builtin_shufflevector(even, even_z, 2, 3, 10, 11, 6, 7, 14, 15),
                         __builtin_shufflevector(odd, odd_z, 2, 3, 10, 11, 6, 7, 14, 15)};
  for (int k = 0; k < 4; ++k)
    *reinterpret_cast<Quad*>(x + 4 * ids[k]) += __builtin_shufflevector(quads[k], quads[k], 0, 1, 2, 3);
  for (int k = 0; k < 4; ++k)
    *reinterpret_cast<Quad*>(x + 4 * ids[k + 4]) += __builtin_shufflevector(quads[k], quads[k], 4, 5, 6, 7);
}

/// Adds 3 x 3 blocks (m[3 column + row] in packs, one block per lane) to the blocks of a matrix: slot 2 b adds lane k
/// to block b, slot 2 b + 1 its transpose. `slots` are those of lane 0; the next lane's follow `stride` later.
SLENDER_INLINE void scatterBlocks(double* values, const int* slots, int stride, const Pack (&m)[9])
{
  Pack t[8];
  for (int k = 0; k < 8; ++k)
    t[k] = m[k];
  transpose(t);
  for (int k = 0; k < W; ++k)
  {
    const int slot = slots[k * stride];
    double* block = values + 9 * static_cast<long>(slot >> 1);
    const Pack turned = __builtin_shufflevector(t[k], t[k], 0, 3, 6, 1, 4, 7, 2, 5);
    store(block, load(block) + (slot & 1 ? turned : t[k]));
    block[8] += m[8][k];
  }
}

}   // namespace
}   // namespace SLENDER_ISA
}   // namespace slender
