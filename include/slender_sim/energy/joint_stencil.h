#pragma once

#include "slender_sim/energy/vec3.h"

/// Bending and twisting of one joint of a discrete rod, between edges e and f (thesis 3.3.4, 4.2.2, 4.2.3, 4.4.3).
///
///   U = 1/2 (kappa - kappaBar)^T B/l (kappa - kappaBar) + 1/2 beta/l (m - mBar)^2                [J]
///
/// Derivatives are taken with respect to the edge vectors e, f and the edge angles theta_e, theta_f, with material
/// frames that move by parallel transport from the point of evaluation, so the Hessian is exact there. T is double or a
/// SIMD pack.
namespace slender {

template <class T>
struct JointFrames
{
  Vec3<T> te, d1e, d2e, tf, d1f, d2f;   ///< tangents and material directors
  T inverse_e, inverse_f;               ///< 1 / current edge length [1/m]
};

/// Stiffnesses are already divided by the rest Voronoi length: b = B / l [N m], twist = beta / l [N m].
template <class T>
struct JointMaterial
{
  T b11, b12, b22, twist;
  T rest_kappa1, rest_kappa2, rest_twist;
};

template <class T>
struct JointStrains
{
  T kappa1, kappa2;   ///< integrated material curvature (3.14)
  Vec3<T> kb;         ///< curvature binormal (3.13)
  T inverse_chi;      ///< 1 / (1 + te . tf)
};

template <class T>
struct JointGradient
{
  Vec3<T> e, f;         ///< dU/de, dU/df [N]
  T theta_e, theta_f;   ///< [N m]
};

template <class T>
struct JointHessian
{
  Sym3<T> ee, ff;
  Mat3<T> ef;                       ///< rows e, columns f
  Vec3<T> e_te, e_tf, f_te, f_tf;   ///< mixed with theta_e (te) and theta_f (tf)
  T te_te, te_tf, tf_tf;
};

template <class T>
SLENDER_INLINE JointStrains<T> jointStrains(const JointFrames<T>& s)
{
  const T inverse_chi = 1.0 / (1.0 + dot(s.te, s.tf));
  const Vec3<T> kb = cross(s.te, s.tf) * (2.0 * inverse_chi);
  return {0.5 * dot(s.d2e + s.d2f, kb), -0.5 * dot(s.d1e + s.d1f, kb), kb, inverse_chi};
}

/// Energy of a joint as a function of (kappa1, kappa2, m) with its derivatives: moments m_i and second derivatives
/// w_ij.
template <class T>
struct JointResponse
{
  T energy;       ///< [J]
  T m1, m2, m3;   ///< [N m]
  T w11, w12, w22, w33;
  T w13, w23;   ///< only of a response that couples bending and twisting
};

/// The thesis's energy (4.2.2, 4.2.3).
template <class T>
SLENDER_INLINE JointResponse<T> tangentResponse(const JointStrains<T>& k, const T& m, const JointMaterial<T>& p)
{
  const T q1 = k.kappa1 - p.rest_kappa1, q2 = k.kappa2 - p.rest_kappa2, q3 = m - p.rest_twist;
  const T m1 = p.b11 * q1 + p.b12 * q2, m2 = p.b12 * q1 + p.b22 * q2, m3 = p.twist * q3;
  return {0.5 * (m1 * q1 + m2 * q2 + m3 * q3), m1, m2, m3, p.b11, p.b12, p.b22, p.twist, T{}, T{}};
}

/// Gradient in `g` (overwritten) and, when WithHessian, the second derivatives in `h` of a joint with response `r`;
/// without them only the angles' block of `h`. Coupled: w13, w23 are not zero.
template <bool WithHessian, bool Coupled, class T>
SLENDER_INLINE void jointDerivatives(const JointFrames<T>& s, const JointStrains<T>& k, const JointResponse<T>& r,
                                     JointGradient<T>& g, JointHessian<T>& h)
{
  const T m1 = r.m1, m2 = r.m2, m3 = r.m3;
  const T ie = s.inverse_e, jf = s.inverse_f;
  const Vec3<T> tt = (s.te + s.tf) * k.inverse_chi;
  const Vec3<T> td1 = (s.d1e + s.d1f) * k.inverse_chi, td2 = (s.d2e + s.d2f) * k.inverse_chi;

  // strain gradients, thesis 4.4.3
  const Vec3<T> k1_e = (cross(s.tf, td2) - tt * k.kappa1) * ie, k1_f = (-cross(s.te, td2) - tt * k.kappa1) * jf;
  const Vec3<T> k2_e = (-cross(s.tf, td1) - tt * k.kappa2) * ie, k2_f = (cross(s.te, td1) - tt * k.kappa2) * jf;
  const Vec3<T> m_e = k.kb * (0.5 * ie), m_f = k.kb * (0.5 * jf);
  // (4.4)
  const T k1_te = -0.5 * dot(k.kb, s.d1e), k2_te = -0.5 * dot(k.kb, s.d2e);
  const T k1_tf = -0.5 * dot(k.kb, s.d1f), k2_tf = -0.5 * dot(k.kb, s.d2f);

  g.e = k1_e * m1 + k2_e * m2 + m_e * m3;
  g.f = k1_f * m1 + k2_f * m2 + m_f * m3;
  g.theta_e = m1 * k1_te + m2 * k2_te - m3;
  g.theta_f = m1 * k1_tf + m2 * k2_tf + m3;

  // angle-angle part: cheap, and enough for a quasistatic update of the frames
  T b1_te = r.w11 * k1_te + r.w12 * k2_te, b2_te = r.w12 * k1_te + r.w22 * k2_te, b3_te = -r.w33;
  T b1_tf = r.w11 * k1_tf + r.w12 * k2_tf, b2_tf = r.w12 * k1_tf + r.w22 * k2_tf, b3_tf = r.w33;
  if (Coupled)
  {
    b1_te -= r.w13;
    b2_te -= r.w23;
    b3_te += r.w13 * k1_te + r.w23 * k2_te;
    b1_tf += r.w13;
    b2_tf += r.w23;
    b3_tf += r.w13 * k1_tf + r.w23 * k2_tf;
  }
  // (4.5)
  h.te_te = b1_te * k1_te + b2_te * k2_te - b3_te - 0.5 * dot(k.kb, s.d2e * m1 - s.d1e * m2);
  h.tf_tf = b1_tf * k1_tf + b2_tf * k2_tf + b3_tf - 0.5 * dot(k.kb, s.d2f * m1 - s.d1f * m2);
  h.te_tf = b1_te * k1_tf + b2_te * k2_tf + b3_te;

  if (WithHessian)
  {
    // The strains' second derivatives are linear in the directors, so the two curvatures weighted by their moments
    // behave like one curvature K with the combined director D.
    const T K = m1 * k.kappa1 + m2 * k.kappa2;
    const Vec3<T> D = td2 * m1 - td1 * m2;
    const Vec3<T> De = s.d2e * m1 - s.d1e * m2, Df = s.d2f * m1 - s.d1f * m2;
    const Vec3<T> a = cross(s.tf, D), b = cross(s.te, D);
    const T ie2 = ie * ie, jf2 = jf * jf, ij = ie * jf;

    Vec3<T> b1_e = k1_e * r.w11 + k2_e * r.w12, b2_e = k1_e * r.w12 + k2_e * r.w22, b3_e = m_e * r.w33;
    Vec3<T> b1_f = k1_f * r.w11 + k2_f * r.w12, b2_f = k1_f * r.w12 + k2_f * r.w22, b3_f = m_f * r.w33;
    if (Coupled)
    {
      b1_e = b1_e + m_e * r.w13;
      b2_e = b2_e + m_e * r.w23;
      b3_e = b3_e + k1_e * r.w13 + k2_e * r.w23;
      b1_f = b1_f + m_f * r.w13;
      b2_f = b2_f + m_f * r.w23;
      b3_f = b3_f + k1_f * r.w13 + k2_f * r.w23;
    }

    const T half = T{} + 0.5;   // symmetricOuter counts u v^T and v u^T
    h.ee = symmetricOuter(b1_e * half, k1_e) + symmetricOuter(b2_e * half, k2_e) + symmetricOuter(b3_e * half, m_e) +
           symmetricOuter(tt * ie2, tt * K - a) + symmetricOuter(k.kb * (0.25 * ie2), De - (s.te + tt) * m3) +
           normalProjector(-K * k.inverse_chi * ie2, s.te);
    h.ff = symmetricOuter(b1_f * half, k1_f) + symmetricOuter(b2_f * half, k2_f) + symmetricOuter(b3_f * half, m_f) +
           symmetricOuter(tt * jf2, tt * K + b) + symmetricOuter(k.kb * (0.25 * jf2), Df - (s.tf + tt) * m3) +
           normalProjector(-K * k.inverse_chi * jf2, s.tf);

    // rows e, columns f: the transpose of the block printed in the thesis for the curvature, as printed for the twist
    const T diagonal = -K * k.inverse_chi * ij;
    h.ef = Mat3<T>{{{diagonal, T{}, T{}}, {T{}, diagonal, T{}}, {T{}, T{}, diagonal}}};
    addOuter(h.ef, b1_e, k1_f);
    addOuter(h.ef, b2_e, k2_f);
    addOuter(h.ef, s.te * diagonal, s.tf);
    addOuter(h.ef, tt * ij, tt * (2.0 * K) + b);
    addOuter(h.ef, a * (-ij), tt);
    addOuter(h.ef, k.kb * (-0.5 * ij * m3), tt);
    addOuter(h.ef, b3_e, m_f);
    addCross(h.ef, s.te * (m3 * k.inverse_chi * ij) - D * ij);

    // derivative of (4.4): kappa . M split into the shares of the two edges, each with its own director
    const Vec3<T> Fe = (s.d1e * m1 + s.d2e * m2) * (-k.inverse_chi), Ff = (s.d1f * m1 + s.d2f * m2) * (-k.inverse_chi);
    const T se = m1 * k1_te + m2 * k2_te, sf = m1 * k1_tf + m2 * k2_tf;
    h.e_te = k1_e * b1_te + k2_e * b2_te + m_e * b3_te + (cross(s.tf, Fe) - tt * se) * ie;
    h.f_te = k1_f * b1_te + k2_f * b2_te + m_f * b3_te + (-cross(s.te, Fe) - tt * se) * jf;
    h.e_tf = k1_e * b1_tf + k2_e * b2_tf + m_e * b3_tf + (cross(s.tf, Ff) - tt * sf) * ie;
    h.f_tf = k1_f * b1_tf + k2_f * b2_tf + m_f * b3_tf + (-cross(s.te, Ff) - tt * sf) * jf;
  }
}

}   // namespace slender
