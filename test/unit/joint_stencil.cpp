// Gradient and Hessian of one joint against differences of its energy, in extended precision so that only the formulas
// are tested.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/energy/compensated_response.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

using Real = long double;
using V = Vec3<Real>;

V vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Real norm(const V& v) { return std::sqrt(dot(v, v)); }
V normalized(const V& v) { return v * (1 / norm(v)); }

/// Thesis (3.9).
V transport(const V& v, const V& a, const V& b)
{
  const V c = cross(a, b);
  return v * dot(a, b) + c * (dot(c, v) / (1 + dot(a, b))) + cross(c, v);
}

/// One joint, displaced by coordinates q = (de, df, dtheta_e, dtheta_f) from its base; frames are transported from
/// there.
struct Joint
{
  V e, f, d1e, d1f;
  JointMaterial<Real> material;
  Real twist;   ///< at the base, unwrapped
  bool compensated = false;
  Real coupling = 0;

  JointFrames<Real> frames(const std::array<Real, 8>& q) const
  {
    const V e1 = e + V{q[0], q[1], q[2]}, f1 = f + V{q[3], q[4], q[5]};
    const V te = normalized(e1), tf = normalized(f1);
    const V ue = transport(d1e, normalized(e), te), uf = transport(d1f, normalized(f), tf);
    const V de = ue * std::cos(q[6]) + cross(te, ue) * std::sin(q[6]),
            df = uf * std::cos(q[7]) + cross(tf, uf) * std::sin(q[7]);
    return {te, de, cross(te, de), tf, df, cross(tf, df), 1 / norm(e1), 1 / norm(f1)};
  }

  Real twistOf(const JointFrames<Real>& s, Real near) const
  {
    const V p = transport(s.d1e, s.te, s.tf);
    const Real pi = std::acos(Real(-1)), angle = std::atan2(dot(cross(p, s.d1f), s.tf), dot(p, s.d1f));
    return angle + 2 * pi * std::nearbyint((near - angle) / (2 * pi));
  }

  JointResponse<Real> response(const JointFrames<Real>& s, const JointStrains<Real>& k, Real m,
                               Real* kappa = nullptr) const
  {
    Real strain[2] = {k.kappa1, k.kappa2};
    const JointResponse<Real> r =
        compensated
            ? compensatedResponse(k, m, material,
                                  {coupling, std::sqrt((1 + dot(s.te, s.tf)) / 2), std::sin(m / 2), std::cos(m / 2)},
                                  strain[0], strain[1])
            : tangentResponse(k, m, material);
    if (kappa)
      std::copy_n(strain, 2, kappa);
    return r;
  }

  template <bool WithHessian = false>
  Real energy(const std::array<Real, 8>& q, JointGradient<Real>* gradient = nullptr,
              JointHessian<Real>* hessian = nullptr) const
  {
    const JointFrames<Real> s = frames(q);
    JointGradient<Real> g{};
    JointHessian<Real> h{};
    const JointStrains<Real> k = jointStrains(s);
    const JointResponse<Real> r = response(s, k, twistOf(s, twist + q[7] - q[6]));
    if (compensated)
      jointDerivatives<WithHessian, true>(s, k, r, g, h);
    else
      jointDerivatives<WithHessian, false>(s, k, r, g, h);
    if (gradient)
      *gradient = g;
    if (hessian)
      *hessian = h;
    return r.energy;
  }
};

/// What the tests vary: the turn, and how the curvature is measured (coupling < 0: the thesis's way).
struct Variant
{
  double turn, coupling;
};

Joint randomJoint(Random& random, const Variant& variant)
{
  const double turn = variant.turn;
  Joint joint;
  joint.compensated = variant.coupling >= 0;
  joint.coupling = std::max(variant.coupling, 0.0);
  joint.e = vec(random.direction() * random.uniform(0.5, 1.5));
  const V te = normalized(joint.e), across = normalized(cross(te, vec(random.direction())));
  joint.f = (te * std::cos(Real(turn)) + across * std::sin(Real(turn))) * Real(random.uniform(0.5, 1.5));
  const auto director = [&](const V& t) { return normalized(cross(t, vec(random.direction()))); };
  joint.d1e = director(te);
  joint.d1f = director(normalized(joint.f));
  joint.material = {1.3, 0.45, 0.8, 0.6, random.uniform(), random.uniform(), random.uniform()};
  joint.twist = 0;
  joint.twist = joint.twistOf(joint.frames({}), 4 * M_PI * random.uniform());   // some turns
  return joint;
}

using Dense = std::array<std::array<Real, 8>, 8>;

Dense dense(const JointHessian<Real>& h)
{
  const Real ee[3][3] = {{h.ee.xx, h.ee.xy, h.ee.xz}, {h.ee.xy, h.ee.yy, h.ee.yz}, {h.ee.xz, h.ee.yz, h.ee.zz}};
  const Real ff[3][3] = {{h.ff.xx, h.ff.xy, h.ff.xz}, {h.ff.xy, h.ff.yy, h.ff.yz}, {h.ff.xz, h.ff.yz, h.ff.zz}};
  const V mixed[4] = {h.e_te, h.e_tf, h.f_te, h.f_tf};
  Dense k{};
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
    {
      k[a][b] = ee[a][b];
      k[3 + a][3 + b] = ff[a][b];
      k[a][3 + b] = k[3 + b][a] = h.ef.m[a][b];
    }
  for (int edge = 0; edge < 2; ++edge)
    for (int angle = 0; angle < 2; ++angle)
    {
      const V& m = mixed[2 * edge + angle];
      const Real entries[3] = {m.x, m.y, m.z};
      for (int a = 0; a < 3; ++a)
        k[3 * edge + a][6 + angle] = k[6 + angle][3 * edge + a] = entries[a];
    }
  k[6][6] = h.te_te;
  k[6][7] = k[7][6] = h.te_tf;
  k[7][7] = h.tf_tf;
  return k;
}

class JointTurn : public ::testing::TestWithParam<Variant>
{};

TEST_P(JointTurn, GradientAndHessianAreDerivativesOfTheEnergy)
{
  Random random(31);
  for (int sample = 0; sample < 5; ++sample)
  {
    const Joint joint = randomJoint(random, GetParam());
    JointGradient<Real> g;
    JointHessian<Real> h;
    joint.energy<true>({}, &g, &h);
    const Real gradient[8] = {g.e.x, g.e.y, g.e.z, g.f.x, g.f.y, g.f.z, g.theta_e, g.theta_f};
    const Dense hessian = dense(h);
    Real scale = 0, smallest = 1e9;
    for (int a = 0; a < 8; ++a)
    {
      scale = std::max({scale, std::abs(gradient[a]), std::abs(hessian[a][a])});
      smallest = std::min(smallest, std::abs(hessian[a][a]));
    }
    ASSERT_GT(std::abs(g.theta_e), 1e-3);   // a zero must not pass
    ASSERT_GT(norm(g.e), 1e-3);
    ASSERT_GT(smallest, 1e-4);

    Real gradient_error[5], hessian_error[5];
    for (int k = 0; k < 5; ++k)
    {
      const Real step = std::pow(Real(10), -(1 + k));
      gradient_error[k] = hessian_error[k] = 0;
      for (int a = 0; a < 8; ++a)
      {
        std::array<Real, 8> up{}, down{};
        up[a] = step;
        down[a] = -step;
        const Real u = joint.energy(up), d = joint.energy(down), zero = joint.energy({});
        gradient_error[k] = std::max(gradient_error[k], std::abs((u - d) / (2 * step) - gradient[a]));
        hessian_error[k] = std::max(hessian_error[k], std::abs((u - 2 * zero + d) / (step * step) - hessian[a][a]));
        for (int b = 0; b < a; ++b)
        {
          std::array<Real, 8> pp = up, pm = up, mp = down, mm = down;
          pp[b] = mp[b] = step;
          pm[b] = mm[b] = -step;
          const Real second =
              (joint.energy(pp) - joint.energy(pm) - joint.energy(mp) + joint.energy(mm)) / (4 * step * step);
          hessian_error[k] = std::max(hessian_error[k], std::abs(second - hessian[a][b]));
        }
      }
    }
    // central differences: the error falls a hundredfold per decade of the step ...
    for (int k = 1; k + 1 < 4; ++k)
    {
      EXPECT_NEAR(std::log10(gradient_error[k] / gradient_error[k + 1]), 2.0, 0.2);
      EXPECT_NEAR(std::log10(hessian_error[k] / hessian_error[k + 1]), 2.0, 0.2);
    }
    // ... down to step^2 = 1e-10 times the fourth derivatives, which grow with the turn as 1 / (1 + cos)^2; round-off
    // 1e-19/step^2 is 1e-9
    EXPECT_LT(gradient_error[4], 1e-7 * scale);
    EXPECT_LT(hessian_error[4], 1e-6 * scale);
  }
}

TEST_P(JointTurn, EnergyAndGradientDoNotDependOnTheHessian)
{
  Random random(32);
  const Joint joint = randomJoint(random, GetParam());
  JointGradient<Real> with, without;
  EXPECT_EQ(joint.energy<true>({}, &with), joint.energy<false>({}, &without));
  EXPECT_EQ(norm(with.e - without.e) + norm(with.f - without.f), 0);
  EXPECT_EQ(with.theta_e, without.theta_e);
  EXPECT_EQ(with.theta_f, without.theta_f);
}

TEST_P(JointTurn, ForcesBalance)
{
  // A rigid rotation w changes nothing: sum of e x dU/de + f x dU/df + tangents times angle torques = 0.
  Random random(33);
  const Joint joint = randomJoint(random, GetParam());
  JointGradient<Real> g;
  joint.energy({}, &g);
  const V moment =
      cross(joint.e, g.e) + cross(joint.f, g.f) + normalized(joint.e) * g.theta_e + normalized(joint.f) * g.theta_f;
  EXPECT_LT(norm(moment), 1e-16L * (1 + norm(g.e)));
  // stretching an edge does not change bending or twist
  EXPECT_LT(std::abs(dot(joint.e, g.e)), 1e-16L * (1 + norm(g.e)));
  EXPECT_GT(norm(g.e), 1e-2L);
}

TEST_P(JointTurn, ZeroAtRest)
{
  Random random(34);
  Joint joint = randomJoint(random, GetParam());
  const JointFrames<Real> s = joint.frames({});
  Real kappa[2];
  joint.response(s, jointStrains(s), joint.twist, kappa);
  joint.material.rest_kappa1 = kappa[0];
  joint.material.rest_kappa2 = kappa[1];
  joint.material.rest_twist = joint.twist;
  JointGradient<Real> g;
  JointHessian<Real> h;
  EXPECT_EQ(joint.energy<true>({}, &g, &h), 0);
  EXPECT_EQ(norm(g.e) + norm(g.f) + std::abs(g.theta_e) + std::abs(g.theta_f), 0);
  // at rest the Hessian is a sum of squares: never negative
  const Dense k = dense(h);
  for (int sample = 0; sample < 50; ++sample)
  {
    const Eigen::VectorXd d = random.numbers(8);
    Real sum = 0;
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b)
        sum += d[a] * k[a][b] * d[b];
    EXPECT_GT(sum, 0);
  }
}

std::vector<Variant> variants()
{
  std::vector<Variant> all;
  for (const double turn : {1e-3, 0.3, 1.2, 2.2})
    for (const double coupling : {-1.0, 0.0, 0.2})   // tangent; compensated without and with the coupling
      all.push_back({turn, coupling});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Turns, JointTurn, ::testing::ValuesIn(variants()));

}   // namespace
}   // namespace slender::test
