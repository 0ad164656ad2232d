#include <gtest/gtest.h>

#include "slender_sim/contact/distance.h"
#include "contact/soft_gap.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

using Vector = Eigen::Vector3d;

/// Pairs of segments `gap` apart: general, parallel, nearly parallel, and of very different lengths.
struct TwoSegments
{
  Vector a0, a1, b0, b1;
};
TwoSegments pairAt(Random& random, int kind, double thickness, double gap)
{
  const Vector e = random.direction(), n = e.cross(random.direction()).normalized(), side = n.cross(e);
  const double angle = kind == 0   ? random.uniform(-1.5, 1.5)
                       : kind == 1 ? 0.0
                       : kind == 2 ? 1e-5 * random.uniform()
                                   : random.uniform(-0.3, 0.3);
  const double length = kind == 3 ? 0.01 : 1.0, tilt = kind == 2 ? random.uniform() * gap : 0.0;
  const Vector f = length * (std::cos(angle) * e + std::sin(angle) * side) + tilt * n;
  const Vector middle = random.uniform(-0.7, 0.7) * e + random.uniform(0.0, 0.3) * side;
  TwoSegments p{-0.5 * e, 0.5 * e, middle - 0.5 * f, middle + 0.5 * f};
  // along n to the right distance, which rises with the height
  double low = 0.0, high = 2.0 * thickness + 2.0 * gap;
  for (int i = 0; i < 80; ++i)
  {
    const double z = 0.5 * (low + high);
    (segmentDistance(p.a0, p.a1, p.b0 + z * n, p.b1 + z * n) < thickness + gap ? low : high) = z;
  }
  p.b0 += high * n;
  p.b1 += high * n;
  return p;
}

TEST(SoftGap, IsTheOnlyMinimum)
{
  Random random(1);
  for (double thickness : {0.01, 0.1, 0.5})
    for (double gap : {1e-9, 1e-6, 1e-3, 0.05})
      for (int k = 0; k < 1000; ++k)
      {
        const TwoSegments p = pairAt(random, k % 4, thickness, gap);
        const SoftGap soft = softGap(p.a0, p.a1, p.b0, p.b1, thickness);
        const double sharp = segmentDistance(p.a0, p.a1, p.b0, p.b1) - thickness;
        const double noise = 1e-15;
        ASSERT_GE(soft.gap, sharp * (1 - 1e-12) - noise);
        ASSERT_LE(soft.gap, sharp / std::pow(1 - kSoftness, 2) * (1 + 1e-12) + noise)
            << "kind " << k % 4 << " gap " << gap;
        const auto value = [&](double s, double t) {
          const double q =
              1.0 / ((1.0 - kSoftness * std::pow(2 * s - 1, 2)) * (1.0 - kSoftness * std::pow(2 * t - 1, 2)));
          return q * ((p.a0 + s * (p.a1 - p.a0) - p.b0 - t * (p.b1 - p.b0)).norm() - thickness);
        };
        for (double reach : {1.0, 0.1, 1e-3})
          for (int i = 0; i <= 8; ++i)
            for (int j = 0; j <= 8; ++j)
            {
              const double s = soft.s + reach * (i / 8.0 - soft.s), t = soft.t + reach * (j / 8.0 - soft.t);
              ASSERT_GE(value(s, t), soft.gap - noise)
                  << "kind " << k % 4 << " gap " << gap << " at " << soft.s << " " << soft.t;
            }
        // the slopes vanish but for a last step of 1e-12 and the rounding of the normal
        const Vector u = p.a0 + soft.s * (p.a1 - p.a0) - p.b0 - soft.t * (p.b1 - p.b0);
        const double g = u.norm() - thickness;
        if (soft.s > 0 && soft.s < 1)
        {
          ASSERT_NEAR(soft.weight * soft.normal.dot(p.a1 - p.a0) + soft.weight_s * g, 0.0, 2e-12 * soft.hss + 1e-14)
              << "kind " << k % 4 << " gap " << gap;
        }
        if (soft.t > 0 && soft.t < 1)
        {
          ASSERT_NEAR(-soft.weight * soft.normal.dot(p.b1 - p.b0) + soft.weight_t * g, 0.0, 2e-12 * soft.htt + 1e-14)
              << "kind " << k % 4 << " gap " << gap;
        }
      }
}

TEST(SoftGap, OfSolidsIsTheOnlyMinimum)
{
  Random random(2);
  const Triangle triangle{Vector(-0.3, -0.2, 0.1), Vector(0.4, -0.1, 0.0), Vector(0.0, 0.5, -0.1)};
  const std::vector<ConvexPiece> pieces{
      Plane{}, Sphere{0.3}, Box{{0.4, 0.3, 0.6}}, Cylinder{0.3, 0.5}, Capsule{0.02, 0.5}, triangle};
  constexpr double kRadius = 0.03;
  int met = 0, free = 0;
  for (const ConvexPiece& piece : pieces)
    for (int k = 0; k < 3000; ++k)
    {
      Vector a = random.vector(0.7), b = random.vector(0.7);
      if (k % 3 == 0)   // parallel to an axis, so to faces and sides
        b = a + 0.4 * random.uniform() * Vector::Unit(k / 3 % 3);
      const SoftGap soft = softGap(a, b, kRadius, piece);
      const auto value = [&](double t) {
        return (pieceDistance(piece, a + t * (b - a)).distance - kRadius) / (1.0 - kSoftness * std::pow(2 * t - 1, 2));
      };
      double least = 1e9;
      for (int i = 0; i <= 400; ++i)
        least = std::min(least, value(i / 400.0));
      if (soft.gap <= 0.0)
      {
        ++met;
        ASSERT_LE(value(soft.t), 0.0);
        continue;
      }
      ASSERT_LE(soft.gap, least + 1e-15) << piece.index();
      ASSERT_NEAR(soft.gap, value(soft.t), 1e-15);
      ASSERT_GE(soft.gap, least - 2e-3);   // as fine as the samples
      free += soft.free_t;
    }
  EXPECT_GT(met, 1000);
  EXPECT_GT(free, 1000);
}

TEST(SoftGap, LeastDistanceIsBelowTheDistance)
{
  const Triangle triangle{Vector(-0.3, -0.2, 0.1), Vector(0.4, -0.1, 0.0), Vector(0.0, 0.5, -0.1)};
  const std::vector<ConvexPiece> pieces{
      Plane{}, Sphere{0.3}, Box{{0.4, 0.3, 0.6}}, Cylinder{0.3, 0.5}, Capsule{0.02, 0.5}, triangle};
  Random random(7);
  int close = 0;
  for (const ConvexPiece& piece : pieces)
    for (int k = 0; k < 1000; ++k)
    {
      const Vector a = random.uniform(0.0, 1.5) * random.direction(), b = a + 0.2 * random.direction();
      const double distance = segmentPieceDistance(piece, a, b).distance, least = leastDistance(piece, a, b);
      EXPECT_GE(least, 0.0);
      EXPECT_LE(least, std::max(0.0, distance) + 1e-12);
      close += distance > 0.0 && least > 0.8 * distance;
    }
  EXPECT_GT(close, 2500);   // of 6000: it is of use
}

}   // namespace
}   // namespace slender::test
