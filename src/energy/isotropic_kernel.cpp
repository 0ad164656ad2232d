// Compiled once per instruction set (SLENDER_ISA). Plain arrays only; nothing here may be emitted under a shared name.
#include "pack.h"
#include "slender_sim/energy/isotropic_kernel.h"
#include "slender_sim/linalg/flush_denormals.h"

namespace slender {
namespace SLENDER_ISA {
namespace {

void tangents(const IsotropicArrays& r, IsotropicEnergy& sum)
{
  const int n = r.nodes;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < W + 1; ++i)
      r.x[k][n + i] = r.closed ? r.x[k][i % n] : r.x[k][n - 1] + (i + 1) * (r.x[k][n - 1] - r.x[k][n - 2]);
  Pack max_strain = {};
  for (int j = 0; j < r.edges; j += W)
  {
    const Vec3<Pack> e = load3(r.x, j + 1) - load3(r.x, j);
    const Pack length = squareRoot(dot(e, e)), inverse = 1.0 / length;
    store3(r.t, j, e * inverse);
    store(r.inverse_length + j, inverse);
    const Pack strain = length * load(r.inverse_rest_length + j) - 1.0;
    store(r.strain + j, strain);
    if (j + W <= r.edges)
      max_strain = maximum(absolute(strain), max_strain);
    else
      for (int k = 0; k < r.edges - j; ++k)
        max_strain[0] = maximum(absolute(Pack{strain[k]}), max_strain)[0];
  }
  const auto copy = [&](int to, int from) {
    for (int k = 0; k < 3; ++k)
      r.t[k][to] = r.t[k][from];
    r.inverse_length[to] = r.inverse_length[from];
    r.strain[to] = r.strain[from];
  };
  copy(-1, r.closed ? r.edges - 1 : 0);
  for (int i = 0; i < W + 1; ++i)
    copy(r.edges + i, r.closed ? i % r.edges : r.edges - 1);

  Pack min_chi = Pack{} + 2.0;
  for (int i = 0; i < n; i += W)
  {
    const Pack chi = 1.0 + dot(load3(r.t, i - 1), load3(r.t, i));
    min_chi = minimum(chi, min_chi);
    store(r.inverse_chi + i, 1.0 / chi);
  }
  for (int k = 0; k < W; ++k)
  {
    sum.min_chi = min_chi[k] < sum.min_chi ? min_chi[k] : sum.min_chi;
    sum.max_strain = max_strain[k] > sum.max_strain ? max_strain[k] : sum.max_strain;
  }
}

void forces(const IsotropicArrays& r, IsotropicEnergy& result)
{
  const FlushDenormals scope;
  const int n = r.nodes;
  // With c = t . t': |kappa b|^2 = 4 (1-c)/(1+c), dc/de = (t' - c t)/|e|: smooth, whereas the gradient of |kappa b|
  // divides by it.
  Pack bend = {}, stretch = {};
  for (int i = -1; i < n + 1; i += W)
  {
    const Vec3<Pack> te = load3(r.t, i - 1), tf = load3(r.t, i);
    const Pack c = dot(te, tf), inverse = load(r.inverse_chi + i), alpha = load(r.bend + i);
    const Vec3<Pack> b = cross(te, tf);
    const Pack moment = -4.0 * alpha * inverse * inverse, torque = load(r.torque + i) * inverse;
    bend += 2.0 * alpha * inverse * inverse * dot(b, b);
    store3(r.before, i, ((tf - te * c) * moment + b * torque) * load(r.inverse_length + i - 1));
    store3(r.after, i, ((te - tf * c) * moment + b * torque) * load(r.inverse_length + i));
  }
  if (r.closed)
    for (int k = 0; k < 3; ++k)
    {
      r.after[k][-1] = r.after[k][n - 1];
      r.before[k][n] = r.before[k][0];
    }
  for (int i = 0; i < n; i += W)
  {
    // dE/dx_i = dE/de_{i-1} - dE/de_i, with dE/de_j from the joints at both ends of the edge and its tension
    const Pack ks = load(r.stretch + i), strain = load(r.strain + i);
    const Pack tension = ks * strain, tension_before = load(r.stretch + i - 1) * load(r.strain + i - 1);
    stretch += 0.5 * tension * strain / load(r.inverse_rest_length + i);
    const Vec3<Pack> g = load3(r.after, i - 1) + load3(r.before, i) + load3(r.t, i - 1) * tension_before -
                         load3(r.after, i) - load3(r.before, i + 1) - load3(r.t, i) * tension;
    const int count = n - i < W ? n - i : W;
    for (int k = 0; k < count; ++k)
    {
      r.gradient[3 * (i + k)] = g.x[k];
      r.gradient[3 * (i + k) + 1] = g.y[k];
      r.gradient[3 * (i + k) + 2] = g.z[k];
    }
  }
  result.bend = sum(bend);
  result.stretch = sum(stretch);
}

/// d carried over the joint between edges e and f.
SLENDER_INLINE Vec3<double> carry(const IsotropicArrays& r, const Vec3<double>& d, int e, int f)
{
  const Vec3<double> te = {r.t[0][e], r.t[1][e], r.t[2][e]}, tf = {r.t[0][f], r.t[1][f], r.t[2][f]};
  return d - (te + tf) * (dot(d, tf) * r.inverse_chi[f]);
}

/// A parallel frame is one long chain of dependent products: four pieces at a time hide their latency.
void transport(const IsotropicArrays& r, int pieces, const int* first, const int* count)
{
  Vec3<double> d[4];
  int at[4], shortest = pieces == 4 ? count[0] : 0;
  for (int p = 0; p < pieces; ++p)
  {
    at[p] = first[p];
    d[p] = {r.u[0][at[p]], r.u[1][at[p]], r.u[2][at[p]]};
    shortest = count[p] < shortest ? count[p] : shortest;
  }
  const auto advance = [&](int p) __attribute__((always_inline))
  {
    const int next = at[p] + 1 < r.edges ? at[p] + 1 : 0;
    d[p] = carry(r, d[p], at[p], next);
    at[p] = next;
    r.u[0][next] = d[p].x;
    r.u[1][next] = d[p].y;
    r.u[2][next] = d[p].z;
  };
  for (int k = 1; k < shortest; ++k)
  {
    advance(0);
    advance(1);
    advance(2);
    advance(3);
  }
  for (int p = 0; p < pieces; ++p)
    for (int k = shortest > 1 ? shortest : 1; k < count[p]; ++k)
      advance(p);
}

void turn(const IsotropicArrays& r, int from, int to)
{
  for (int j = from; j < to; j += W)
  {
    const Vec3<Pack> t = load3(r.t, j);
    Vec3<Pack> d = load3(r.u, j);
    d = d - t * dot(d, t);
    d = d * (1.0 / squareRoot(dot(d, d)));
    Pack a = load(r.angle + j), s, c;
    a -= kTwoPi * nearest(a * (1.0 / kTwoPi));
    sineCosine(a, s, c);
    d = d * c + cross(t, d) * s;
    if (j + W <= to)
      store3(r.u, j, d);
    else
      for (int k = 0; k < to - j; ++k)
      {
        r.u[0][j + k] = d.x[k];
        r.u[1][j + k] = d.y[k];
        r.u[2][j + k] = d.z[k];
      }
  }
}

}   // namespace

extern const IsotropicKernels kIsotropicKernels;
const IsotropicKernels kIsotropicKernels = {tangents, forces, transport, turn};

}   // namespace SLENDER_ISA
}   // namespace slender
