// Compiled once per instruction set (SLENDER_ISA). Plain arrays only; nothing here may be emitted under a shared name.
#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/linalg/banded_ldlt_kernel.h"
#include "slender_sim/linalg/flush_denormals.h"

namespace slender {
namespace SLENDER_ISA {
namespace {

using V4 = double __attribute__((vector_size(32), aligned(32), may_alias));
using V8 = double __attribute__((vector_size(64), aligned(64), may_alias));
using V4u __attribute__((aligned(8), may_alias)) = V4;
using V8u __attribute__((aligned(8), may_alias)) = V8;   // rows of right-hand sides, any alignment
// Clang overlooks aligned() beside vector_size()
static_assert(alignof(V4u) == 8 && alignof(V8u) == 8, "loads and stores may be anywhere");

inline __attribute__((always_inline)) V4 low(V8 v) { return V4{v[0], v[1], v[2], v[3]}; }
inline __attribute__((always_inline)) V4 high(V8 v) { return V4{v[4], v[5], v[6], v[7]}; }
inline __attribute__((always_inline)) V8 join(V4 a, V4 b) { return V8{a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]}; }

/// Past the cache when the factors are too many to stay in it: they are next read when all the others have been
/// written.
inline __attribute__((always_inline)) void storeFactor(double* p, V8 v, bool stream)
{
#if defined(__AVX512F__) && !defined(__clang__)   // whose builtins differ
  if (stream)
  {
    __builtin_ia32_movntpd512(p, v);
    return;
  }
#elif defined(__AVX__) && !defined(__clang__)   // whose builtins differ
  if (stream)
  {
    __builtin_ia32_movntpd256(p, low(v));
    __builtin_ia32_movntpd256(p + 4, high(v));
    return;
  }
#else
  (void)stream;
#endif
  *reinterpret_cast<V8*>(p) = v;
}

/// x := L^-1 x for one block; `ahead` is what is to be subtracted from the next two blocks.
inline __attribute__((always_inline)) void forwardBlock(const V4 (&d)[4], const V8 (&l)[4], double* x, V8& ahead)
{
  V4 y = *reinterpret_cast<V4u*>(x) - low(ahead);
  ahead = join(high(ahead), V4{});
  for (int c = 0; c < 4; ++c)
  {
    const double v = y[c];
    V4 column = d[c];
    for (int r = 0; r <= c; ++r)
      column[r] = 0.0;
    y -= column * v;
    ahead += l[c] * v;
  }
  *reinterpret_cast<V4u*>(x) = y;
}

/// Right-looking: each block column is factored, then subtracts L D L^T from the two blocks that it reaches.
/// What is still to be subtracted (window: rows of the next two blocks in the next block's columns, corner: the
/// diagonal block after that) travels in registers, so memory is touched once per panel. The forward substitution of
/// one right-hand side rides along: its chain of dependences hides behind the factorisation's.
void eliminateBand(RodPanel* panels, RodPanel* factors, int from, int to, double* x, BandCarry& carry)
{
  const FlushDenormals scope;
  V8 window[4];
  V4 corner[4];
  for (int c = 0; c < 4; ++c)
  {
    window[c] = *reinterpret_cast<V8*>(carry.window[c]);
    corner[c] = *reinterpret_cast<V4*>(carry.corner[c]);
  }
  V8 ahead = *reinterpret_cast<V8*>(carry.ahead);
  int negative = 0;
  const bool stream = factors != panels;
  for (int b = from; b < to; ++b)
  {
    RodPanel& p = panels[b - from];
    RodPanel& f = factors[b - from];
    V4 d[4];
    V8 l[4], u[4];
    for (int c = 0; c < 4; ++c)
    {
      d[c] = *reinterpret_cast<V4*>(p.diag[c]) - low(window[c]);
      l[c] = *reinterpret_cast<V8*>(p.below[c]);
      l[c] -= join(high(window[c]), V4{});
    }
    for (int c = 0; c < 4; ++c)
    {
      const double pivot = d[c][c];
      // also false for NaN
      if (!(pivot > 0 || pivot < 0) || pivot - pivot != 0)
      {
        ++carry.zero;
        return;
      }
      negative += pivot < 0;
      const double inverse = 1.0 / pivot;
      const V4 dl = d[c] * inverse;
      u[c] = l[c];
      l[c] = u[c] * inverse;
      for (int k = c + 1; k < 4; ++k)
      {
        const double entry = d[c][k];
        d[k] -= dl * entry;
        l[k] -= l[c] * entry;
      }
      d[c] = dl;
      d[c][c] = inverse;
    }
    for (int c = 0; c < 4; ++c)
      storeFactor(f.below[c], l[c], stream);
    for (int c = 0; c < 4; c += 2)
      storeFactor(f.diag[c], join(d[c], d[c + 1]), stream);
    for (int k = 0; k < 4; ++k)
    {
      V8 w = join(corner[k], V4{});
      for (int c = 0; c < 4; ++c)
        w += l[c] * u[c][k];
      window[k] = w;
    }
    // The last row of the reach (an edge angle) is structurally zero: three columns are enough.
    for (int k = 0; k < 3; ++k)
    {
      V4 w = {};
      for (int c = 0; c < 4; ++c)
        w += high(l[c]) * u[c][4 + k];
      corner[k] = w;
    }
    if (x)
      forwardBlock(d, l, x + 4 * b, ahead);
  }
  for (int c = 0; c < 4; ++c)
  {
    *reinterpret_cast<V8*>(carry.window[c]) = window[c];
    *reinterpret_cast<V4*>(carry.corner[c]) = corner[c];
  }
  *reinterpret_cast<V8*>(carry.ahead) = ahead;
  carry.negative += negative;
}

/// x := L^-T D^-1 x
void substituteBand(const RodPanel* panels, int blocks, double* x)
{
  const FlushDenormals scope;
  V8 ahead = {};   // solution of the two blocks below
  for (int b = blocks - 1; b >= 0; --b)
  {
    const RodPanel& p = panels[b];
    double* xb = x + 4 * b;
    double y[4];
    for (int c = 0; c < 4; ++c)
    {
      const V8 product = *reinterpret_cast<const V8*>(p.below[c]) * ahead;
      const V4 half = low(product) + high(product);
      y[c] = xb[c] * p.diag[c][c] - ((half[0] + half[1]) + (half[2] + half[3]));
    }
    for (int c = 3; c >= 0; --c)
      for (int r = c + 1; r < 4; ++r)
        y[c] -= p.diag[c][r] * y[r];
    for (int c = 0; c < 4; ++c)
      xb[c] = y[c];
    ahead = join(V4{y[0], y[1], y[2], y[3]}, low(ahead));
  }
}

void solveBand(const RodPanel* panels, int blocks, double* x)
{
  const FlushDenormals scope;
  V8 ahead = {};
  for (int b = 0; b < blocks; ++b)
  {
    const RodPanel& p = panels[b];
    V4 d[4];
    V8 l[4];
    for (int c = 0; c < 4; ++c)
    {
      d[c] = *reinterpret_cast<const V4*>(p.diag[c]);
      l[c] = *reinterpret_cast<const V8*>(p.below[c]);
    }
    forwardBlock(d, l, x + 4 * b, ahead);
  }
  substituteBand(panels, blocks, x);
}

void solveBand8(const RodPanel* panels, int blocks, double* x)
{
  const FlushDenormals scope;
  V8u* rows = reinterpret_cast<V8u*>(x);
  for (int b = 0; b < blocks; ++b)
  {
    const RodPanel& p = panels[b];
    V8u* y = rows + 4 * b;
    const int reach = blocks - b > 2 ? 7 : 4 * (blocks - b - 1);
    for (int c = 0; c < 4; ++c)
    {
      for (int r = c + 1; r < 4; ++r)
        y[r] -= p.diag[c][r] * y[c];
      for (int r = 0; r < reach; ++r)
        y[4 + r] -= p.below[c][r] * y[c];
    }
  }
  for (int b = blocks - 1; b >= 0; --b)
  {
    const RodPanel& p = panels[b];
    V8u* y = rows + 4 * b;
    const int reach = blocks - b > 2 ? 7 : 4 * (blocks - b - 1);
    for (int c = 3; c >= 0; --c)
    {
      V8 sum = y[c] * p.diag[c][c];
      for (int r = c + 1; r < 4; ++r)
        sum -= p.diag[c][r] * y[r];
      for (int r = 0; r < reach; ++r)
        sum -= p.below[c][r] * y[4 + r];
      y[c] = sum;
    }
  }
}

}   // namespace

extern const BandKernels kBandKernels;
const BandKernels kBandKernels = {eliminateBand, substituteBand, solveBand, solveBand8};

}   // namespace SLENDER_ISA
}   // namespace slender
