// Compiled once per instruction set (SLENDER_ISA). Plain arrays only; nothing here may be emitted under a shared name.
#include "pack.h"
#include "slender_sim/energy/membrane_kernel.h"

namespace slender {
namespace SLENDER_ISA {
namespace {

struct Triangle
{
  Pack b[3][2];         ///< rows: F_k = sum_p x_p b[p][k]
  Vec3<Pack> f1, f2;    ///< columns of F
  Pack g11, g22, g12;   ///< Green's strain; g12 is that of shear, 2 G12
};

SLENDER_INLINE Triangle triangleAt(const MembraneArrays& m, const double* x, int i)
{
  Triangle t;
  for (int p = 0; p < 2; ++p)
    for (int k = 0; k < 2; ++k)
      t.b[p + 1][k] = load(m.inverse[2 * p + k] + i);
  for (int k = 0; k < 2; ++k)
    t.b[0][k] = -(t.b[1][k] + t.b[2][k]);
  const Vec3<Pack> x0 = gatherPoints(x, m.points[0] + i), e1 = gatherPoints(x, m.points[1] + i) - x0,
                   e2 = gatherPoints(x, m.points[2] + i) - x0;
  t.f1 = e1 * t.b[1][0] + e2 * t.b[2][0];
  t.f2 = e1 * t.b[1][1] + e2 * t.b[2][1];
  t.g11 = 0.5 * (dot(t.f1, t.f1) - 1.0);
  t.g22 = 0.5 * (dot(t.f2, t.f2) - 1.0);
  t.g12 = dot(t.f1, t.f2);
  return t;
}

struct Stress
{
  Pack s11, s22, s12;   ///< second Piola-Kirchhoff times area [J]
};

struct Totals
{
  Pack energy = {}, most = {}, least = {};
};

/// Sums the energy and the stretches, and gives the stress. The padding counts for nothing, having no area.
template <bool Viscous>
SLENDER_INLINE Stress stressOf(const MembraneArrays& m, int i, const Triangle& t, Totals& totals)
{
  const Pack area = load(m.area + i);
  Pack g11 = t.g11, g22 = t.g22, g12 = t.g12;
  if (Viscous)
  {
    g11 -= load(m.rest_strain[0] + i);
    g22 -= load(m.rest_strain[1] + i);
    g12 -= load(m.rest_strain[2] + i);
  }
  const Stress s = {area * (m.c11 * g11 + m.c12 * g22), area * (m.c12 * g11 + m.c22 * g22), area * m.c33 * g12};
  totals.energy += 0.5 * (s.s11 * g11 + s.s22 * g22 + s.s12 * g12);
  const Pack mean = 0.5 * (t.g11 + t.g22), difference = 0.5 * (t.g11 - t.g22);
  const Pack radius = squareRoot(difference * difference + 0.25 * t.g12 * t.g12);
  totals.most = maximum(mean + radius, totals.most);
  totals.least = minimum(mean - radius, totals.least);
  return s;
}

void close(const Totals& totals, MembraneSums& sums)
{
  sums.energy += sum(totals.energy);
  for (int k = 0; k < W; ++k)   // principal stretch^2 = 1 + 2 G
  {
    const double most = __builtin_sqrt(1.0 + 2.0 * totals.most[k]) - 1.0, below = 1.0 + 2.0 * totals.least[k];
    const double least = __builtin_sqrt(below > 0.0 ? below : 0.0) - 1.0;
    sums.max_strain = most > sums.max_strain ? most : sums.max_strain;
    sums.min_strain = least < sums.min_strain ? least : sums.min_strain;
  }
}

void strains(const MembraneArrays& m, const double* x, double* const* out)
{
  for (int i = 0; i < m.count; i += W)
  {
    const Triangle t = triangleAt(m, x, i);
    store(out[0] + i, t.g11);
    store(out[1] + i, t.g22);
    store(out[2] + i, t.g12);
  }
}

template <bool Viscous>
void energyOf(const MembraneArrays& m, const double* x, MembraneSums& sums)
{
  Totals totals;
  for (int i = 0; i < m.count; i += W)
    stressOf<Viscous>(m, i, triangleAt(m, x, i), totals);
  close(totals, sums);
}

SLENDER_INLINE void addForces(const MembraneArrays& m, int i, const Triangle& t, const Stress& s, double* out)
{
  const Vec3<Pack> p1 = t.f1 * s.s11 + t.f2 * s.s12, p2 = t.f1 * s.s12 + t.f2 * s.s22;
  const Vec3<Pack> g1 = p1 * t.b[1][0] + p2 * t.b[1][1], g2 = p1 * t.b[2][0] + p2 * t.b[2][1];
  scatterPoints(out, m.points[0] + i, -(g1 + g2));
  scatterPoints(out, m.points[1] + i, g1);
  scatterPoints(out, m.points[2] + i, g2);
}

template <bool Viscous>
void gradientOf(const MembraneArrays& m, const double* x, double* out, MembraneSums& sums)
{
  Totals totals;
  for (int i = 0; i < m.count; i += W)
  {
    const Triangle t = triangleAt(m, x, i);
    addForces(m, i, t, stressOf<Viscous>(m, i, t, totals), out);
  }
  close(totals, sums);
}

/// Without its negative eigenvalues.
SLENDER_INLINE Stress tensilePart(const Stress& s)
{
  const Pack mean = 0.5 * (s.s11 + s.s22), difference = 0.5 * (s.s11 - s.s22);
  const Pack radius = squareRoot(difference * difference + s.s12 * s.s12), zero = {};
  const Pack high = maximum(mean + radius, zero), low = maximum(mean - radius, zero);
  // projectors 1/2 +- (S - mean) / (2 radius)
  const Pack split = 0.5 * (high - low) / (radius + 1e-300), middle = 0.5 * (high + low);
  return {middle + split * difference, middle - split * difference, split * s.s12};
}

/// Replaces the stress at x by that of a strain that is extrapolated linearly from other points. The difference is the
/// response to 1/2 D^T D, the part of the strain that is of second order in the displacement with the gradient D.
SLENDER_INLINE void extrapolate(const MembraneArrays& m, int i, const Triangle& t, const double* x, const double* from,
                                Stress& s)
{
  const auto moved = [&](int k) { return gatherPoints(x, m.points[k] + i) - gatherPoints(from, m.points[k] + i); };
  const Vec3<Pack> d0 = moved(0), e1 = moved(1) - d0, e2 = moved(2) - d0;
  const Vec3<Pack> d1 = e1 * t.b[1][0] + e2 * t.b[2][0], d2 = e1 * t.b[1][1] + e2 * t.b[2][1];
  const Pack area = load(m.area + i), g11 = 0.5 * dot(d1, d1), g22 = 0.5 * dot(d2, d2), g12 = dot(d1, d2);
  s.s11 -= area * (m.c11 * g11 + m.c12 * g22);
  s.s22 -= area * (m.c12 * g11 + m.c22 * g22);
  s.s12 -= area * m.c33 * g12;
}

template <bool Viscous, bool Semidefinite>
void hessianOf(const MembraneArrays& m, const double* x, const double* from, const int* slots, double* out,
               double* values, MembraneSums& sums)
{
  Totals totals;
  for (int i = 0; i < m.count; i += W)
  {
    const Triangle t = triangleAt(m, x, i);
    Stress s = stressOf<Viscous>(m, i, t, totals);
    addForces(m, i, t, s, out);
    if (from)
      extrapolate(m, i, t, x, from, s);
    if (Semidefinite)
      s = tensilePart(s);
    // d2E/dx_p dx_q = (b_p S b_q) 1 + sum of c_ij times products of the strains' derivatives: b_p1 f1, b_p2 f2, b_p2 f1
    // + b_p1 f2
    const Pack area = load(m.area + i);
    const Vec3<Pack> f1 = t.f1, f2 = t.f2;
    const int* slot = slots + 6 * i;
    for (int p = 0; p < 3; ++p)
      for (int q = 0; q <= p; ++q, ++slot)
      {
        const Pack p1 = t.b[p][0], p2 = t.b[p][1], q1 = t.b[q][0], q2 = t.b[q][1];
        const Pack b11 = area * p1 * q1, b12 = area * p1 * q2, b21 = area * p2 * q1, b22 = area * p2 * q2;
        const Pack k11 = m.c11 * b11 + m.c33 * b22, k12 = m.c12 * b12 + m.c33 * b21, k21 = m.c12 * b21 + m.c33 * b12,
                   k22 = m.c22 * b22 + m.c33 * b11;
        const Pack spread = p1 * q1 * s.s11 + (p1 * q2 + p2 * q1) * s.s12 + p2 * q2 * s.s22;
        const Vec3<Pack> r1 = f1 * k11 + f2 * k12, r2 = f1 * k21 + f2 * k22;   // block = f1 r1^T + f2 r2^T
        const Pack block[9] = {
            f1.x * r1.x + f2.x * r2.x + spread, f1.y * r1.x + f2.y * r2.x,          f1.z * r1.x + f2.z * r2.x,
            f1.x * r1.y + f2.x * r2.y,          f1.y * r1.y + f2.y * r2.y + spread, f1.z * r1.y + f2.z * r2.y,
            f1.x * r1.z + f2.x * r2.z,          f1.y * r1.z + f2.y * r2.z,          f1.z * r1.z + f2.z * r2.z + spread};
        scatterBlocks(values, slot, 6, block);
      }
  }
  close(totals, sums);
}

void energy(const MembraneArrays& m, const double* x, MembraneSums& sums)
{
  m.rest_strain[0] ? energyOf<true>(m, x, sums) : energyOf<false>(m, x, sums);
}
void gradient(const MembraneArrays& m, const double* x, double* out, MembraneSums& sums)
{
  m.rest_strain[0] ? gradientOf<true>(m, x, out, sums) : gradientOf<false>(m, x, out, sums);
}
void hessian(const MembraneArrays& m, const double* x, const double* from, const int* slots, double* out,
             double* values, MembraneSums& sums)
{
  m.rest_strain[0] ? hessianOf<true, false>(m, x, from, slots, out, values, sums)
                   : hessianOf<false, false>(m, x, from, slots, out, values, sums);
}
void semidefiniteHessian(const MembraneArrays& m, const double* x, const double* from, const int* slots, double* out,
                         double* values, MembraneSums& sums)
{
  m.rest_strain[0] ? hessianOf<true, true>(m, x, from, slots, out, values, sums)
                   : hessianOf<false, true>(m, x, from, slots, out, values, sums);
}

}   // namespace

extern const MembraneKernels kMembraneKernels;
const MembraneKernels kMembraneKernels = {strains, energy, gradient, hessian, semidefiniteHessian};

}   // namespace SLENDER_ISA
}   // namespace slender
