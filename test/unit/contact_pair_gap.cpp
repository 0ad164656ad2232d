#include <gtest/gtest.h>

#include "slender_sim/contact/distance.h"
#include "contact/pair_gap.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

using Vector = Eigen::Vector3d;

const Triangle triangle{Vector(-0.3, -0.2, 0.1), Vector(0.4, -0.1, 0.0), Vector(0.0, 0.5, -0.1)};
const std::vector<ConvexPiece> pieces{
    Plane{}, Sphere{0.3}, Sphere{0.02}, Box{{0.4, 0.3, 0.6}}, Cylinder{0.3, 0.5}, Capsule{0.02, 0.5}, triangle};

/// A triangle of any kind: general, with an edge along an axis, flat along a side of a box, and a needle.
void drawTriangle(Random& random, int kind, Vector (&corner)[3])
{
  for (Vector& c : corner)
    c = random.vector(0.7);
  if (kind == 1)
    corner[1] = corner[0] + 0.4 * Vector::Unit(static_cast<int>(3.0 * random.uniform(0.0, 0.999)));
  if (kind == 2)
  {
    const int axis = static_cast<int>(3.0 * random.uniform(0.0, 0.999));
    corner[1][axis] = corner[2][axis] = corner[0][axis];
  }
  if (kind == 3)
    corner[2] = corner[0] + 0.6 * (corner[1] - corner[0]) + 1e-5 * random.vector();
}

constexpr double kPairGapSoftness = 0.5;   // of pair_gap.cpp

TEST(PairGap, OfATriangleAndASolidIsTheOnlyMinimum)
{
  constexpr double kThickness = 0.01;
  Random random(1);
  int met = 0, inner = 0, edge = 0, corners = 0;
  for (std::size_t shape = 0; shape < pieces.size(); ++shape)
    for (int k = 0; k < 1500; ++k)
    {
      Vector z[3];
      drawTriangle(random, k % 4, z);
      const PairGap soft = facePieceGap(z, 3, kThickness, pieces[shape]);
      const auto value = [&](const Vector& w) {
        const double g = pieceDistance(pieces[shape], w[0] * z[0] + w[1] * z[1] + w[2] * z[2]).distance - kThickness;
        return g / (1.0 - kPairGapSoftness * (1.5 * w.squaredNorm() - 0.5));
      };
      const Vector place = soft.place.head<3>();
      if (soft.gap <= 0.0)
      {
        ASSERT_LE(value(place), 1e-15);
        ++met;
        continue;
      }
      ASSERT_NEAR(soft.gap, value(place), 1e-14);
      ASSERT_GE(place.minCoeff(), 0.0);
      ASSERT_NEAR(place.sum(), 1.0, 1e-14);
      for (double reach : {1.0, 0.1, 1e-3})
        for (int i = 0; i <= 12; ++i)
          for (int j = 0; i + j <= 12; ++j)
          {
            const Vector w = place + reach * (Vector(12 - i - j, i, j) / 12.0 - place);
            // the place is known to 1e-8, and the value to its square
            ASSERT_GE(value(w), soft.gap - 1e-14) << "shape " << shape << " case " << k;
          }
      const int count = (place.array() > 0.0).count();
      ++(count == 3 ? inner : count == 2 ? edge : corners);
    }
  EXPECT_GT(met, 500);
  EXPECT_GT(inner, 300);
  EXPECT_GT(edge, 300);
  EXPECT_GT(corners, 50);
}

TEST(PairGap, PlanesSeparateTrianglesFromSolids)
{
  constexpr double kThickness = 0.01;
  Random random(2);
  for (std::size_t shape = 0; shape < pieces.size(); ++shape)
    for (int k = 0; k < 2000; ++k)
    {
      Vector z[3];
      drawTriangle(random, k % 4, z);
      double distance = 1e9;   // by places of the triangle
      for (int i = 0; i <= 40; ++i)
        for (int j = 0; i + j <= 40; ++j)
          distance = std::min(
              distance, pieceDistance(pieces[shape], z[0] + (i * (z[1] - z[0]) + j * (z[2] - z[0])) / 40).distance);
      const FacePlane plane = separatingPlane(pieces[shape], z, 3, kThickness);
      ASSERT_LE(leastFaceDistance(pieces[shape], z, 3), std::max(0.0, distance) + 1e-12);
      if (distance <= kThickness)
      {
        ASSERT_TRUE(plane.meets);
      }
      if (plane.meets)
        continue;
      ASSERT_LE(plane.distance, distance + 1e-12) << "shape " << shape << " case " << k;
      for (const Vector& c : z)
        ASSERT_GE(plane.normal.dot(c - plane.foot), -1e-12);
      const FacePlane exact = separatingPlane(pieces[shape], z, 3, 0.999 * plane.distance);
      ASSERT_FALSE(exact.meets);   // the bound is one: nothing is nearer
      // At most a tenth of what is beyond the thickness is lost; the samples are 0.02 apart.
      ASSERT_GE(plane.distance - kThickness, 0.9 * (distance - kThickness) - 0.03)
          << "shape " << shape << " case " << k;
    }
}

/// A plate that lies on a small box, and is hardly tilted.
TEST(PairGap, PlanesSeparateWideTrianglesFromSmallBoxes)
{
  const ConvexPiece box = Box{{0.1, 0.1, 0.1}};
  for (const double tilt : {1e-6, 1e-5, 1e-4, 1e-3})
    for (const double gap : {1e-6, 1e-5, 1e-4})
    {
      const auto at = [&](double x, double y) {   // Its lowest place is above the corner (-0.05, -0.05, 0.05).
        return Vector(x, y, 0.05 + gap + tilt * ((x + 0.05) + 0.7 * (y + 0.05)));
      };
      const Vector z[3] = {at(-0.35, -0.2), at(0.2, -0.2), at(-0.15, 0.4)};
      const FacePlane plane = separatingPlane(box, z, 3, 0.0);
      EXPECT_FALSE(plane.meets);
      EXPECT_GE(plane.distance, 0.9 * gap) << tilt << " " << gap;
      EXPECT_LE(plane.distance, gap * (1.0 + 1e-6)) << tilt << " " << gap;
    }
}

TEST(PairGap, OfAPointAndATriangleIsTheDistance)
{
  Random random(3);
  for (int k = 0; k < 4000; ++k)
  {
    Vector z[3];
    drawTriangle(random, k % 4, z);
    const Vector p = random.vector(0.7);
    const PairGap gap = pointTriangleGap(p, z[0], z[1], z[2], 0.01);
    const double distance = pointTriangleDistance(p, z[0], z[1], z[2]);
    ASSERT_NEAR(gap.gap, distance - 0.01, 1e-15);
    if (gap.gap <= 0.0)
      continue;
    ASSERT_NEAR(gap.place.sum(), 0.0, 1e-14);
    const Vector u = gap.place[0] * p + gap.place[1] * z[0] + gap.place[2] * z[1] + gap.place[3] * z[2];
    ASSERT_NEAR((u - distance * gap.normal).norm(), 0.0, 1e-13);
  }
}

}   // namespace
}   // namespace slender::test
