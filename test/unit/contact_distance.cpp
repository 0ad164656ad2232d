#include <gtest/gtest.h>

#include "slender_sim/contact/barrier.h"
#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/friction.h"
#include "slender_sim/contact/solids.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

using Vector = Eigen::Vector3d;

/// Two segments in a position that a case number picks: general, parallel, nearly parallel, collinear, crossing,
/// without length.
struct Segments
{
  Vector a0, a1, b0, b1;
};
Segments segments(Random& random, int kind)
{
  const Vector a0 = random.vector(), e = random.vector();
  const Vector f = kind == 1   ? Vector(random.uniform() * e)
                   : kind == 2 ? Vector(e + 1e-7 * random.vector())
                   : kind == 3 ? Vector(2.0 * e)
                   : kind == 5 ? Vector(Vector::Zero())
                               : random.vector();
  const Vector b0 = kind == 3   ? Vector(a0 + random.uniform(-3, 3) * e)
                    : kind == 4 ? Vector(a0 + 0.3 * e - 0.6 * f)
                                : random.vector();
  return {a0, kind == 5 && random.uniform() > 0 ? a0 : Vector(a0 + e), b0, b0 + f};
}

/// Stationarity over a box of parameters is enough for a convex function: no small move in either parameter, nor in
/// both, comes nearer.
TEST(Distance, SegmentsAreNearestWhereTheySay)
{
  Random random(1);
  for (int k = 0; k < 20000; ++k)
  {
    const Segments p = segments(random, k % 6);
    const SegmentPair c = closestOfSegments(p.a0, p.a1, p.b0, p.b1);
    ASSERT_TRUE(c.s >= 0 && c.s <= 1 && c.t >= 0 && c.t <= 1);
    const double found = segmentDistance(p.a0, p.a1, p.b0, p.b1);
    for (int i = 0; i <= 12; ++i)
      for (int j = 0; j <= 12; ++j)
      {
        const double s = i / 12.0, t = j / 12.0;
        ASSERT_LE(found, (p.a0 + s * (p.a1 - p.a0) - p.b0 - t * (p.b1 - p.b0)).norm() + 1e-14) << "kind " << k % 6;
        const double ls = c.s + 1e-3 * (s - c.s), lt = c.t + 1e-3 * (t - c.t);
        ASSERT_LE(found, (p.a0 + ls * (p.a1 - p.a0) - p.b0 - lt * (p.b1 - p.b0)).norm() + 1e-14) << "kind " << k % 6;
      }
  }
}

TEST(Distance, PointsAreNearestToTrianglesWhereTheySay)
{
  Random random(2);
  for (int k = 0; k < 20000; ++k)
  {
    Vector t[3] = {random.vector(), random.vector(), random.vector()};
    if (k % 4 == 1)
      t[2] = t[0] + random.uniform(-1, 2) * (t[1] - t[0]);   // collinear
    if (k % 16 == 2)
      t[1] = t[2] = t[0];
    const Vector p = k % 4 == 3 ? Vector(0.2 * t[0] + 0.3 * t[1] + 0.5 * t[2]) : random.vector(2.0);
    const Vector w = closestOnTriangle(p, t[0], t[1], t[2]);
    ASSERT_NEAR(w.sum(), 1.0, 1e-14);
    ASSERT_GE(w.minCoeff(), 0.0);
    const double found = pointTriangleDistance(p, t[0], t[1], t[2]);
    for (int i = 0; i <= 12; ++i)
      for (int j = 0; i + j <= 12; ++j)
        for (double near : {1.0, 1e-3})
        {
          const Vector v = w + near * (Vector(i, j, 12 - i - j) / 12.0 - w);
          // squares: a distance of 1e-16 instead of zero is round-off
          ASSERT_LE(found * found, (v[0] * t[0] + v[1] * t[1] + v[2] * t[2] - p).squaredNorm() + 1e-14);
        }
    ASSERT_NEAR(pointSegmentDistance(p, t[0], t[1]), segmentDistance(p, p, t[0], t[1]), 1e-14);
  }
}

/// Distances from solids against their normals and curvatures by differences, and against points on the surface.
TEST(Distance, SolidsKnowTheirNormalsAndCurvatures)
{
  Random random(3);
  const Triangle triangle{Vector(-0.3, -0.2, 0.1), Vector(0.4, -0.1, 0.0), Vector(0.0, 0.5, -0.1)};
  const std::vector<ConvexPiece> pieces{Plane{},           Sphere{0.3}, Box{{0.4, 0.3, 0.6}}, Cylinder{0.3, 0.5},
                                        Capsule{0.2, 0.5}, triangle};
  for (const ConvexPiece& piece : pieces)
    for (int k = 0; k < 2000; ++k)
    {
      const Vector p = random.vector(0.8), e = random.vector();
      const PieceDistance at = pieceDistance(piece, p);
      if (at.distance < 0.02)
        continue;
      constexpr double kStep = 1e-5;
      const auto d = [&](double s) { return pieceDistance(piece, p + s * e); };
      EXPECT_NEAR((d(kStep).distance - d(-kStep).distance) / (2 * kStep), at.normal.dot(e), 1e-7) << piece.index();
      // skipped where features of the surface change within the step
      const double forward = (d(kStep).normal.dot(e) - at.normal.dot(e)) / kStep,
                   backward = (at.normal.dot(e) - d(-kStep).normal.dot(e)) / kStep, curvature = e.dot(at.curvature * e);
      if (std::abs(forward - backward) < 1e-2 * (1.0 + std::abs(forward)))
        EXPECT_NEAR(0.5 * (forward + backward), curvature, 1e-2 * (1.0 + curvature)) << piece.index();
      EXPECT_NEAR(pieceDistance(piece, p - at.distance * at.normal).distance, 0.0, 1e-14) << piece.index();
    }
}

TEST(Barrier, IsSmoothAndScaled)
{
  const Barrier b(0.01);
  EXPECT_NEAR(b.force(0.005), 1.0, 1e-14);
  EXPECT_EQ(b.energy(0.01), 0.0);
  EXPECT_NEAR(b.stiffness(0.01 * (1 - 1e-8)), 0.0, 1e-5 * b.stiffness(0.005));
  for (double g : {1e-6, 1e-4, 0.003, 0.009})
  {
    const double h = 1e-5 * g;
    EXPECT_NEAR((b.energy(g - h) - b.energy(g + h)) / (2 * h), b.force(g), 1e-8 * b.force(g));
    EXPECT_NEAR((b.force(g - h) - b.force(g + h)) / (2 * h), b.stiffness(g), 1e-8 * b.stiffness(g));
  }
}

TEST(Friction, IsSmooth)
{
  const SmoothedCoulomb law{0.1};
  for (double y : {0.01, 0.05, 0.0999999, 0.1000001, 0.3})
  {
    const double h = 1e-8;
    EXPECT_NEAR((law.energy(y + h) - law.energy(y - h)) / (2 * h), y * law.forceOverSlip(y), 1e-6);
    EXPECT_NEAR(((y + h) * law.forceOverSlip(y + h) - (y - h) * law.forceOverSlip(y - h)) / (2 * h), law.slope(y),
                1e-6);
  }
  EXPECT_EQ(law.forceOverSlip(0.3) * 0.3, 1.0);
}

}   // namespace
}   // namespace slender::test
