// Compiled once per instruction set (SLENDER_ISA). Plain arrays only; nothing here may be emitted under a shared name.
#include "pack.h"
#include "slender_sim/energy/hinge_kernel.h"

namespace slender {
namespace SLENDER_ISA {
namespace {

/// One face beside the edge: unit vectors along the edge, in the face and square to it, normal to the face (as both
/// faces' normals in the flat state), and where the third point lies.
struct Side
{
  Vec3<Pack> m, n;
  Pack inverse_height, foot;   ///< [1/m]; along the edge from its tail, in edge lengths
};

struct Flap
{
  Vec3<Pack> t;   ///< along the edge
  Pack inverse_length;
  Side left, right;
  Pack angle;
};

SLENDER_INLINE Vec3<Pack> scaled(const Vec3<Pack>& v, const Pack& s) { return v * s; }

SLENDER_INLINE Side sideOf(const Vec3<Pack>& e, const Vec3<Pack>& t, Pack inverse_length, const Vec3<Pack>& p,
                           double sign)
{
  Side s;
  const Vec3<Pack> area = cross(e, p);
  // a face without height has no normal: a floor far below anything resolved keeps the numbers finite
  const Pack floor = 1e-28 * dot(e, e) * (dot(e, e) + dot(p, p)) + 1e-290;
  const Pack inverse = 1.0 / squareRoot(dot(area, area) + floor);
  const Vec3<Pack> n = area * inverse;
  s.m = cross(n, t);
  s.n = sign > 0 ? n : -n;
  s.inverse_height = inverse / inverse_length;
  s.foot = dot(p, t) * inverse_length;
  return s;
}

SLENDER_INLINE Flap flapOf(const HingeArrays& h, const double* x, int i)
{
  const Vec3<Pack> origin = gatherPoints(x, h.points[0] + i);
  const Vec3<Pack> e = gatherPoints(x, h.points[1] + i) - origin;
  const Vec3<Pack> a = gatherPoints(x, h.points[2] + i) - origin, b = gatherPoints(x, h.points[3] + i) - origin;
  Flap f;
  f.inverse_length = 1.0 / squareRoot(dot(e, e) + 1e-290);
  f.t = e * f.inverse_length;
  f.left = sideOf(e, f.t, f.inverse_length, a, 1.0);
  f.right = sideOf(e, f.t, f.inverse_length, b, -1.0);
  // both normals are unit vectors square to the edge
  f.angle = angleOfUnit(dot(cross(f.left.n, f.right.n), f.t), dot(f.left.n, f.right.n));
  return f;
}

/// Derivatives of the angle by the four points [1/m]: those of the third points along the normals, the edge's by the
/// lever.
SLENDER_INLINE void angleGradient(const Flap& f, Vec3<Pack> (&g)[4])
{
  g[2] = f.left.n * -f.left.inverse_height;
  g[3] = f.right.n * -f.right.inverse_height;
  g[1] = -(g[2] * f.left.foot + g[3] * f.right.foot);
  g[0] = -(g[1] + g[2] + g[3]);
}

/// theta - rest, the way round that is shorter.
SLENDER_INLINE Pack deviation(const HingeArrays& h, int i, Pack angle)
{
  const Pack d = angle - load(h.rest_angle + i);
  return d - kTwoPi * nearest(d * (1.0 / kTwoPi));
}

void angles(const HingeArrays& h, const double* x, double* out)
{
  for (int i = 0; i < h.count; i += W)
    store(out + i, flapOf(h, x, i).angle);
}

double energy(const HingeArrays& h, const double* x)
{
  Pack total = {};
  for (int i = 0; i < h.count; i += W)
  {
    const Pack d = deviation(h, i, flapOf(h, x, i).angle);
    total += 0.5 * load(h.stiffness + i) * d * d;
  }
  return sum(total);
}

double gradient(const HingeArrays& h, const double* x, double* out)
{
  Pack total = {};
  for (int i = 0; i < h.count; i += W)
  {
    const Flap f = flapOf(h, x, i);
    const Pack d = deviation(h, i, f.angle), moment = load(h.stiffness + i) * d;
    total += 0.5 * moment * d;
    Vec3<Pack> g[4];
    angleGradient(f, g);
    for (int p = 0; p < 4; ++p)
      scatterPoints(out, h.points[p] + i, g[p] * moment);
  }
  return sum(total);
}

/// += u v^T in the layout of scatterBlocks (columns).
SLENDER_INLINE void addOuter(Pack (&m)[9], const Vec3<Pack>& u, const Vec3<Pack>& v)
{
  m[0] += u.x * v.x;
  m[1] += u.y * v.x;
  m[2] += u.z * v.x;
  m[3] += u.x * v.y;
  m[4] += u.y * v.y;
  m[5] += u.z * v.y;
  m[6] += u.x * v.z;
  m[7] += u.y * v.z;
  m[8] += u.z * v.z;
}

SLENDER_INLINE void addTransposed(Pack (&m)[9], const Pack (&a)[9], double sign)
{
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      m[3 * c + r] += sign * a[3 * r + c];
}

/// Second derivatives of the angle, weighted, for one side. With n, m, t the side's unit vectors, h its height, l the
/// edge's length, s the foot, S = n m^T + m n^T, by the third point p and the edge vector e:
///   pp: S / h^2;   pe: -s S / h^2 + t n^T / (l h);   ee: (s^2 / h^2 + 1 / (2 l^2)) S - s (n t^T + t n^T) / (l h)
/// (each side's ee has an antisymmetric part; the two cancel).
SLENDER_INLINE void sideHessian(const Side& side, const Flap& f, Pack weight, Pack (&pp)[9], Pack (&pe)[9],
                                Pack (&ee)[9])
{
  const Pack ih = side.inverse_height, il = f.inverse_length, s = side.foot;
  const Vec3<Pack> n = scaled(side.n, weight * ih * ih), tn = scaled(side.n, weight * ih * il);
  addOuter(pp, n, side.m);
  addOuter(pp, side.m, n);
  for (int k = 0; k < 9; ++k)
    pe[k] -= s * pp[k];
  addOuter(pe, f.t, tn);
  const Vec3<Pack> half = scaled(side.n, 0.5 * weight * il * il), lever = scaled(tn, -s);
  for (int k = 0; k < 9; ++k)
    ee[k] += s * s * pp[k];
  addOuter(ee, half, side.m);
  addOuter(ee, side.m, half);
  addOuter(ee, lever, f.t);
  addOuter(ee, f.t, lever);
}

double hessian(const HingeArrays& h, const double* x, const int* slots, double* out, double* values)
{
  Pack total = {};
  for (int i = 0; i < h.count; i += W)
  {
    const Flap f = flapOf(h, x, i);
    const Pack k = load(h.stiffness + i), d = deviation(h, i, f.angle), moment = k * d;
    total += 0.5 * moment * d;
    Vec3<Pack> g[4];
    angleGradient(f, g);

    // columns of the lower triangle as in BlockMatrix::slots: blocks[p (p + 1) / 2 + q]
    Pack b10[9] = {}, b11[9] = {}, b20[9] = {}, b21[9] = {}, b22[9] = {}, b30[9] = {}, b31[9] = {}, b33[9] = {};
    sideHessian(f.left, f, moment, b22, b21, b11);
    sideHessian(f.right, f, moment, b33, b31, b11);
    for (int c = 0; c < 9; ++c)
    {
      b20[c] = -(b22[c] + b21[c]);
      b30[c] = -(b33[c] + b31[c]);
      b10[c] = -b11[c];
    }
    addTransposed(b10, b21, -1.0);
    addTransposed(b10, b31, -1.0);
    Pack b00[9] = {}, b32[9] = {};
    for (int c = 0; c < 9; ++c)
      b00[c] = -(b10[c] + b20[c] + b30[c]);

    const int* s = slots + 10 * i;
    const auto put = [&](Pack(&block)[9], int p, int q, int at) __attribute__((always_inline))
    {
      addOuter(block, g[p] * k, g[q]);
      scatterBlocks(values, s + at, 10, block);
    };
    put(b00, 0, 0, 0);
    put(b10, 1, 0, 1);
    put(b11, 1, 1, 2);
    put(b20, 2, 0, 3);
    put(b21, 2, 1, 4);
    put(b22, 2, 2, 5);
    put(b30, 3, 0, 6);
    put(b31, 3, 1, 7);
    put(b32, 3, 2, 8);
    put(b33, 3, 3, 9);
    for (int p = 0; p < 4; ++p)
      scatterPoints(out, h.points[p] + i, g[p] * moment);
  }
  return sum(total);
}

/// A linear function of the four points; of one side, so that the third points of the other do not count.
struct Linear
{
  Vec3<Pack> tail, head, third;
};

/// The second derivative of the angle is a sum of two products x y of linear functions for each side,
///   2/h^2 (n . p')(m . p') + (n . e) (m . e / l^2 + 2 t . p' / (l h)),  p' = dp - s de.
/// With a weight w, w x y <= |w| / 4 (r x + sign(w) y / r)^2: semidefinite, not below, and equal along x r = sign(w) y
/// / r.
SLENDER_INLINE void positiveParts(const Side& side, const Flap& f, Pack weight, Linear (&out)[2])
{
  const Pack size = absolute(weight), one = Pack{} + 1.0, sign = weight < 0.0 ? -one : one;
  const Pack ih = side.inverse_height, il = f.inverse_length, s = side.foot;
  const Vec3<Pack> q = (side.n + side.m * sign) * (squareRoot(0.5 * size) * ih);
  out[0] = {q * (s - 1.0), q * -s, q};
  const Pack r = squareRoot(il * il + 2.0 * il * ih * (1.0 + absolute(s)));
  const Pack scale = 0.5 * squareRoot(size), down = scale * sign / r;
  const Vec3<Pack> third = f.t * (2.0 * il * ih * down);
  const Vec3<Pack> head = side.n * (scale * r) + side.m * (il * il * down) - third * s;
  out[1] = {-(head + third), head, third};
}

double semidefiniteHessian(const HingeArrays& h, const double* x, const int* slots, double* out, double* values)
{
  Pack total = {};
  for (int i = 0; i < h.count; i += W)
  {
    const Flap f = flapOf(h, x, i);
    const Pack k = load(h.stiffness + i), d = deviation(h, i, f.angle), moment = k * d;
    total += 0.5 * moment * d;
    Vec3<Pack> g[4];
    angleGradient(f, g);
    Linear left[2], right[2];
    positiveParts(f.left, f, moment, left);
    positiveParts(f.right, f, moment, right);

    const int* s = slots + 10 * i;
    const auto common = [&](int p, int q, int at, auto&& ofSide) __attribute__((always_inline))
    {
      Pack block[9] = {};
      addOuter(block, g[p] * k, g[q]);
      ofSide(block);
      scatterBlocks(values, s + at, 10, block);
    };
    const auto both = [&](Vec3<Pack> Linear::*p, Vec3<Pack> Linear::*q, bool on_left, bool on_right)
        __attribute__((always_inline))
    {
      return [&, p, q, on_left, on_right ](Pack(&block)[9]) __attribute__((always_inline))
      {
        for (int c = 0; c < 2; ++c)
        {
          if (on_left)
            addOuter(block, left[c].*p, left[c].*q);
          if (on_right)
            addOuter(block, right[c].*p, right[c].*q);
        }
      };
    };
    common(0, 0, 0, both(&Linear::tail, &Linear::tail, true, true));
    common(1, 0, 1, both(&Linear::head, &Linear::tail, true, true));
    common(1, 1, 2, both(&Linear::head, &Linear::head, true, true));
    common(2, 0, 3, both(&Linear::third, &Linear::tail, true, false));
    common(2, 1, 4, both(&Linear::third, &Linear::head, true, false));
    common(2, 2, 5, both(&Linear::third, &Linear::third, true, false));
    common(3, 0, 6, both(&Linear::third, &Linear::tail, false, true));
    common(3, 1, 7, both(&Linear::third, &Linear::head, false, true));
    common(3, 2, 8, both(&Linear::third, &Linear::third, false, false));
    common(3, 3, 9, both(&Linear::third, &Linear::third, false, true));
    for (int p = 0; p < 4; ++p)
      scatterPoints(out, h.points[p] + i, g[p] * moment);
  }
  return sum(total);
}

}   // namespace

extern const HingeKernels kHingeKernels;
const HingeKernels kHingeKernels = {angles, energy, gradient, hessian, semidefiniteHessian};

}   // namespace SLENDER_ISA
}   // namespace slender
