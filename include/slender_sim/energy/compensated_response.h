#pragma once

#include "slender_sim/energy/joint_stencil.h"

/// Response of a joint compensated for the leading errors of the discretisation, as a function of the same (kappa1,
/// kappa2, m) as the thesis's. With phi the turn from edge to edge:
///   - strains are the turn itself along the directors half way of the twist: phi / (2 tan(phi/2)) / cos(m/2) times
///   (3.14);
///   - the bending energy is divided by 1 + z + z^2, z = coupling (m - mBar)^2.
///
/// Why the second. Let a rod have the torsion tau and a twisting moment M. Per length, the turns of the polygon of its
/// tangents give the bending energy alpha/2 kappa^2 too small by alpha/2 kappa^2 tau^2 l^2/12, and the polygon encloses
/// too small an area on the sphere, so that the writhe is short of tau kappa^2 l^2/12 and M does that much less work.
/// In a naturally straight isotropic rod kappa^2 (2 alpha tau - M) is constant; where part of it is straight, as in
/// localised buckling, tau = M / (2 alpha), and both together stiffen bending by (M l / alpha)^2 / 16, where M l = beta
/// (m - mBar). In particular, a long straight polygon under M buckles at the tension M^2 / (4 alpha) of the smooth rod
/// if its bending modulus is alpha (1 - z) with just that z. Neither holds for other rods: their coupling is zero.
namespace slender {

/// (phi/2) / sin(phi/2) and its derivatives by y = 1 - cos(phi/2): the Pade approximant [4/4] of atan(x)/x in x^2 at x
/// = tan(phi/4). Within 4e-13 for turns up to 90 degrees and 2.1e-7 for all.
template <class T>
struct TurnOverSine
{
  T value, first, second;
};

template <class T>
SLENDER_INLINE TurnOverSine<T> turnOverSine(const T& y)
{
  const T P = 7657650.0 + y * (y * (3108105.0 + y * (14258.0 * y - 414810.0)) - 8483475.0);
  const T Q = 7657650.0 + y * (y * (5765760.0 + y * (y * (115920.0 - 2520.0 * y) - 1302840.0)) - 11036025.0);
  const T P1 = y * (6216210.0 + y * (57032.0 * y - 1244430.0)) - 8483475.0;
  const T Q1 = y * (11531520.0 + y * (y * (463680.0 - 12600.0 * y) - 3908520.0)) - 11036025.0;
  const T P2 = 6216210.0 + y * (171096.0 * y - 2488860.0),
          Q2 = 11531520.0 + y * (y * (1391040.0 - 50400.0 * y) - 7817040.0);
  const T inverse = 1.0 / Q, value = P * inverse, first = (P1 - value * Q1) * inverse;
  return {value, first, (P2 - 2.0 * first * Q1 - value * Q2) * inverse};
}

/// 1 / cos(m/2) for the sum of both edges' directors; finite where these are opposite and there is no direction half
/// way.
template <class T>
SLENDER_INLINE T regularInverse(const T& cosine)
{
  return cosine / (cosine * cosine + 1e-14);
}

/// What the compensated response needs beside the thesis's strains and moduli.
template <class T>
struct JointCompensation
{
  T coupling;           ///< (beta/alpha)^2 / 16 for a naturally straight isotropic rod, else 0 [-]
  T half_turn_cosine;   ///< cos(phi/2) = sqrt((1 + te . tf) / 2)
  T half_twist_sine, half_twist_cosine;
};

/// Writes the strains [-] that it compares with rest_kappa1, rest_kappa2 to `kappa1`, `kappa2`.
template <class T>
SLENDER_INLINE JointResponse<T> compensatedResponse(const JointStrains<T>& k, const T& m, const JointMaterial<T>& p,
                                                    const JointCompensation<T>& a, T& kappa1, T& kappa2)
{
  // S(w) = (phi/2) / tan(phi/2), w = |kappa b|^2
  const T c = a.half_turn_cosine, c2 = c * c;
  const T w = 8.0 * k.inverse_chi - 4.0;
  const TurnOverSine<T> turn = turnOverSine(1.0 - c);
  const T slope_c = turn.value - c * turn.first;
  const T S = c * turn.value, S1 = -0.125 * c * c2 * slope_c;
  const T S2 = c * c2 * c2 * ((3.0 / 64) * slope_c + (1.0 / 64) * c * (c * turn.second - 2.0 * turn.first));

  // r = 1 / cos(m/2) and its derivatives by m
  const T r = regularInverse(a.half_twist_cosine), tangent = r * a.half_twist_sine;
  const T r1 = 0.5 * r * tangent, r2 = 0.25 * r * (tangent * tangent + r * r);

  // strains g kappa with g = r S, and derivatives of g by kappa . kappa and m
  const T rr = r * r, u1 = S + 2.0 * w * S1, u2 = 3.0 * S1 + 2.0 * w * S2;
  const T g = r * S, gk = rr * r * S1, gm = r1 * u1, gkk = rr * rr * r * S2, gkm = rr * r1 * u2;
  const T gmm = r2 * u1 + 2.0 * r1 * r1 * r * (k.kappa1 * k.kappa1 + k.kappa2 * k.kappa2) * u2;
  kappa1 = g * k.kappa1;
  kappa2 = g * k.kappa2;

  const T q1 = kappa1 - p.rest_kappa1, q2 = kappa2 - p.rest_kappa2, q3 = m - p.rest_twist;
  const T z = a.coupling * q3 * q3, bow = 1.0 + 2.0 * z, G = 1.0 / (1.0 + z + z * z);
  const T ratio = -2.0 * a.coupling * q3 * bow * G, G1 = ratio * G;
  const T G2 = 2.0 * a.coupling * G * G * (4.0 * z * (bow * bow * G - 1.0) - bow);
  const T f1 = p.b11 * q1 + p.b12 * q2, f2 = p.b12 * q1 + p.b22 * q2;
  const T bending = 0.5 * (f1 * q1 + f2 * q2);
  const T b11 = G * p.b11, b12 = G * p.b12, b22 = G * p.b22, n1 = G * f1, n2 = G * f2;
  const T along = n1 * k.kappa1 + n2 * k.kappa2;

  // derivatives of the strains: J = g 1 + 2 gk kappa kappa^T, and gm kappa by the twist
  const T j11 = g + 2.0 * gk * k.kappa1 * k.kappa1, j12 = 2.0 * gk * k.kappa1 * k.kappa2,
          j22 = g + 2.0 * gk * k.kappa2 * k.kappa2;
  const T t1 = gm * k.kappa1, t2 = gm * k.kappa2;
  // B J
  const T e11 = b11 * j11 + b12 * j12, e12 = b11 * j12 + b12 * j22, e21 = b12 * j11 + b22 * j12,
          e22 = b12 * j12 + b22 * j22;
  const T m1 = j11 * n1 + j12 * n2, m2 = j12 * n1 + j22 * n2, nt = gm * along;
  const T slope = 2.0 * gkm * along, spread = 2.0 * gk * along, curl = 4.0 * gkk * along;
  return {
      bending * G + 0.5 * p.twist * q3 * q3,
      m1,
      m2,
      nt + G1 * bending + p.twist * q3,
      j11 * e11 + j12 * e21 + 4.0 * gk * k.kappa1 * n1 + spread + curl * k.kappa1 * k.kappa1,
      j11 * e12 + j12 * e22 + 2.0 * gk * (k.kappa1 * n2 + k.kappa2 * n1) + curl * k.kappa1 * k.kappa2,
      j12 * e12 + j22 * e22 + 4.0 * gk * k.kappa2 * n2 + spread + curl * k.kappa2 * k.kappa2,
      p.twist + t1 * (b11 * t1 + b12 * t2) + t2 * (b12 * t1 + b22 * t2) + gmm * along + 2.0 * ratio * nt + G2 * bending,
      e11 * t1 + e21 * t2 + gm * n1 + slope * k.kappa1 + ratio * m1,
      e12 * t1 + e22 * t2 + gm * n2 + slope * k.kappa2 + ratio * m2};
}

}   // namespace slender
