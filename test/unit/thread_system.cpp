// Surface tension and the whole energy of a thread's step against differences.
#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/energy/end_cap.h"
#include "slender_sim/thread/thread_system.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

TEST(SurfaceTension, AConeHasItsArea)
{
  // radii 1 and 2 over a height of 3 (half of each length)
  const double L1 = 2.5, L2 = 3.5;
  EXPECT_NEAR(surfaceArea(SurfaceShape::cone, L1, M_PI * L1, L2, 4 * M_PI * L2).value, M_PI * 3 * std::sqrt(9.0 + 1.0),
              1e-12);
  EXPECT_NEAR(surfaceArea(SurfaceShape::cylinder, L1, M_PI * L1, L2, 4 * M_PI * L2).value, M_PI * 3 * 3, 1e-12);
  EXPECT_NEAR(endArea(2.0, M_PI * 2.0).value, M_PI * 2.0, 1e-12);
}

TEST(SurfaceTension, AFreeEndHasACapWhereSlopesCount)
{
  const double L = 2.0, r = 0.5, V = M_PI * r * r * L;
  EXPECT_NEAR(freeEndArea(SurfaceShape::cone, L, V).value, M_PI * r * L + M_PI * r * r, 1e-12);
  EXPECT_NEAR(freeEndArea(SurfaceShape::cylinder, L, V).value, M_PI * r * L, 1e-12);
  EXPECT_NEAR(freeEndArea(SurfaceShape::cylinder, L, V).d1, endArea(L, V).d1, 1e-12);
  // the cone that narrows to nothing over no length has the area of the cap
  const double tip = 1e-9;
  EXPECT_NEAR(surfaceArea(SurfaceShape::cone, tip, M_PI * r * r * tip, tip, M_PI * 1e-18 * tip).value, M_PI * r * r,
              1e-7);
}

TEST(SurfaceTension, AnEdgeIsAtRestAsLongAsItIsWide)
{
  for (const double r : {0.1, 3.0})
  {
    const double L = 2 * r, V = M_PI * r * r * L;
    EXPECT_NEAR(freeEndArea(SurfaceShape::cone, L, V).d1, 0.0, 1e-14);
    EXPECT_GT(freeEndArea(SurfaceShape::cone, L, V).d11, 0.0);
  }
}

TEST(SurfaceTension, DerivativesMatchDifferences)
{
  Random random(3);
  for (int k = 0; k < 20; ++k)
  {
    const SurfaceShape shape = k % 2 ? SurfaceShape::cone : SurfaceShape::cylinder;
    const auto area = [&](double l1, double v1, double l2, double v2) { return surfaceArea(shape, l1, v1, l2, v2); };
    const double L1 = random.uniform(0.5, 2), L2 = random.uniform(0.5, 2), V1 = random.uniform(0.1, 3),
                 V2 = random.uniform(0.1, 3), d = 1e-5;
    const LengthFunction f = area(L1, V1, L2, V2), p1 = area(L1 + d, V1, L2, V2), m1 = area(L1 - d, V1, L2, V2),
                         p2 = area(L1, V1, L2 + d, V2), m2 = area(L1, V1, L2 - d, V2);
    EXPECT_NEAR(f.d1, (p1.value - m1.value) / (2 * d), 1e-8);
    EXPECT_NEAR(f.d2, (p2.value - m2.value) / (2 * d), 1e-8);
    EXPECT_NEAR(f.d11, (p1.d1 - m1.d1) / (2 * d), 1e-7);
    EXPECT_NEAR(f.d12, (p2.d1 - m2.d1) / (2 * d), 1e-7);
    EXPECT_NEAR(f.d12, (p1.d2 - m1.d2) / (2 * d), 1e-7);
    EXPECT_NEAR(f.d22, (p2.d2 - m2.d2) / (2 * d), 1e-7);
    const LengthFunction e = endArea(L1, V1), ep = endArea(L1 + d, V1), em = endArea(L1 - d, V1);
    EXPECT_NEAR(e.d1, (ep.value - em.value) / (2 * d), 1e-8);
    EXPECT_NEAR(e.d11, (ep.d1 - em.d1) / (2 * d), 1e-7);
    const auto free = [&](double l) { return freeEndArea(shape, l, V1); };
    EXPECT_NEAR(free(L1).d1, (free(L1 + d).value - free(L1 - d).value) / (2 * d), 1e-7);
    EXPECT_NEAR(free(L1).d11, (free(L1 + d).d1 - free(L1 - d).d1) / (2 * d), 1e-6);
  }
}

TEST(SurfaceTension, AUniformThreadPullsWithPiGammaRadius)
{
  // dE/dL of n equal edges that all lengthen alike
  const double r = 0.3, L = 0.7, V = M_PI * r * r * L;
  const LengthFunction cone = surfaceArea(SurfaceShape::cone, L, V, L, V);
  EXPECT_NEAR(cone.d1 + cone.d2, M_PI * r, 1e-12);
  EXPECT_NEAR(2 * endArea(L, V).d1, M_PI * r, 1e-12);
}

/// A straight thread of equal edges along x with surface tension alone. The first node is a free end. With `held` the
/// last edge is the inside of a holder.
void setUniform(ThreadSystem& system, int edges, double length, double radius, double gamma, bool held)
{
  system.resize(edges + 1);
  for (int i = 0; i <= edges; ++i)
    system.setPosition(i, {length * i, 0, 0});
  for (int j = 0; j < edges; ++j)
    system.setFrame(j, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
  system.takeRestStrains();
  system.setSurfaceTension(gamma, SurfaceShape::cone);
  for (int j = 0; j < edges - held; ++j)
    system.setEdge(j, 1.0, M_PI * radius * radius * length);
}

/// Contact takes a trial back towards the base, also when the mesh has changed since the last solution.
TEST(ThreadConfiguration, WhatIsSetUpIsTheBase)
{
  ThreadSystem system;
  setUniform(system, 4, 0.5, 0.1, 0.0, false);
  setUniform(system, 6, 0.2, 0.1, 0.0, false);
  for (int i = 0; i <= 6; ++i)
    EXPECT_EQ(system.basePosition(i), Eigen::Vector3d(0.2 * i, 0, 0)) << i;
}

/// At a cut the surface pulls with 2 pi r gamma and the pressure gamma / r pushes with pi r gamma: pi r gamma is left,
/// wherever the cut is. The cap only shares this force out between the nodes of the tip.
TEST(SurfaceTension, TheTipOfAThreadIsPulledWithPiGammaRadius)
{
  const double gamma = 0.7, r = 0.3, L = 0.5;
  ThreadSystem system;
  setUniform(system, 12, L, r, gamma, false);
  system.evaluate(false);
  double pull = 0.0;
  for (int i = 0; i < 11; ++i)
  {
    pull -= system.nodeGradient(i)[0];
    EXPECT_NEAR(pull, M_PI * gamma * r * (i == 0 ? 1.0 - r / L : 1.0), 1e-12) << i;
  }
}

TEST(SurfaceTension, AHeldEndHasNoCap)
{
  const double gamma = 0.7, r = 0.3, L = 0.5, side = 2.0 * M_PI * r * L, cap = M_PI * r * r;
  ThreadSystem system;
  setUniform(system, 5, L, r, gamma, false);
  EXPECT_NEAR(system.evaluate(false).energy(), gamma * (5 * side + 2 * cap), 1e-12);
  setUniform(system, 6, L, r, gamma, true);
  EXPECT_NEAR(system.evaluate(false).energy(), gamma * (5 * side + cap), 1e-12);
}

/// A thread's step with every part of its energy at work, at a strained base. The last edge is the inside of a holder.
struct Equations
{
  static constexpr int n = 14;
  ThreadSystem system;

  Equations(double gamma, unsigned seed)
  {
    Random random(seed);
    const ThreadState state = wigglyThread(n, random);
    system.resize(n);
    for (int i = 0; i < n; ++i)
    {
      system.setPosition(i, state.x[i]);
      system.setTwist(i, state.twist[i]);
    }
    for (int j = 0; j + 1 < n; ++j)
      system.setFrame(j, state.edge(j).normalized(), state.d1[j]);
    system.takeRestStrains();
    system.setSurfaceTension(gamma, SurfaceShape::cone);
    for (int i = 0; i < n; ++i)
    {
      // the forces differ from one Equations to the next, and with them the Newton direction
      system.setInertia(i, random.uniform(4, 6), state.x[i] + random.vector(0.2), random.vector(3.0));
      if (i > 0 && i + 1 < n)
        system.setJoint(i, random.uniform(0.5, 1.5), random.uniform(0.5, 1.5));
      if (i + 2 < n)
      {
        system.setEdge(i, random.uniform(1, 3), state.volume[i]);
        system.setSpin(i, random.uniform(4, 6), random.uniform());
      }
    }
    for (int i = 0; i < n; ++i)
      system.setPosition(i, state.x[i] + random.vector(0.1));
    system.evaluate(false);
    system.accept();
  }
  double energy(double alpha)
  {
    system.moveAlong(alpha);
    return system.evaluate(false).energy();
  }
};

class ThreadEquations : public ::testing::TestWithParam<double>
{};

/// K d = -g, so the energy along d begins with the slope g.d and the curvature -g.d; differences of the energy must say
/// the same.
TEST_P(ThreadEquations, GradientAndHessianMatchDifferences)
{
  for (unsigned seed = 1; seed <= 30; ++seed)
  {
    Equations e(GetParam(), seed);
    e.system.moveAlong(0.0);
    const RodEvaluation base = e.system.evaluate(true);
    ASSERT_TRUE(base.inertia.positiveDefinite());
    e.system.solve();
    const double slope = e.system.slope();
    double first = 1e9, second = 1e9;
    for (const double h : {3e-2, 1e-2, 3e-3, 1e-3})
    {
      const double p1 = e.energy(h), m1 = e.energy(-h), p2 = e.energy(2 * h), m2 = e.energy(-2 * h),
                   middle = base.energy();
      first = std::min(first, std::abs((8 * (p1 - m1) - (p2 - m2)) / (12 * h) / slope - 1));
      second =
          std::min(second, std::abs((16 * (p1 + m1 - 2 * middle) - (p2 + m2 - 2 * middle)) / (12 * h * h) / slope + 1));
    }
    EXPECT_LT(first, 1e-8) << "seed " << seed;
    EXPECT_LT(second, 1e-6) << "seed " << seed;
  }
}

TEST_P(ThreadEquations, HeldUnknownsStay)
{
  Equations e(GetParam(), 5);
  e.system.hold(3);
  e.system.holdTurn(6);
  e.system.moveAlong(0.0);
  e.system.evaluate(true);
  const Eigen::Vector3d before = e.system.position(3), other = e.system.position(4);
  const double turn = e.system.turn(6);
  e.system.solve();
  e.system.moveAlong(1.0);
  EXPECT_EQ(e.system.position(3), before);
  EXPECT_EQ(e.system.turn(6), turn);
  EXPECT_NE(e.system.position(4), other);
  e.system.evaluate(false);
  EXPECT_GT(e.system.nodeGradient(3).norm(), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(SurfaceTensions, ThreadEquations, ::testing::Values(0.0, 0.5));

}   // namespace
}   // namespace slender::test
