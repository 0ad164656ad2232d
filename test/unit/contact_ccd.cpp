#include <gtest/gtest.h>

#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/distance.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kApproachThickness = 0.1, kReach = 0.02, kKept = 0.2;
constexpr int kSamples = 2000;

/// Checks a share of a motion against distances sampled along it; returns the smallest gap up to the share, over what
/// had to be kept. `gap` gives the gap at a time.
template <class Gap>
double checkShare(double share, Gap gap)
{
  const double start = gap(0.0);
  if (start <= 0.0)
  {
    EXPECT_EQ(share, 0.0);
    return 1.0;
  }
  const double keep = kKept * std::min(start, kReach);
  double least = start;
  for (int i = 0; i <= kSamples; ++i)
    least = std::min(least, gap(share * i / kSamples));
  EXPECT_GE(least, keep * (1 - 1e-9) - 1e-14);
  // not timid: it ends at the end, or near the kept gap
  EXPECT_TRUE(share == 1.0 || gap(share) <= 1.2 * keep)
      << "share " << share << " leaves " << gap(share) << " of " << start;
  return least / keep;
}

/// Points and motions: general, without motion, common translation, grazing at about the thickness, parallel, starting
/// just outside it.
struct Draw
{
  Vector from[4], to[4];
  MovingPoint point(int i) const { return {from[i], to[i]}; }
  Vector at(int i, double t) const { return from[i] + t * (to[i] - from[i]); }
};
Draw drawMotion(Random& random, int kind)
{
  Draw d;
  for (int i = 0; i < 4; ++i)
  {
    d.from[i] = random.vector();
    d.to[i] = random.vector();
  }
  if (kind == 1)
    std::copy(d.from, d.from + 4, d.to);
  const Vector shift = random.vector(3.0);
  if (kind == 2)
    for (int i = 0; i < 4; ++i)
      d.to[i] = d.from[i] + shift;
  if (kind >= 3 && kind <= 5)   // two pieces one above the other, about a thickness apart, that slide past each other
  {
    const double angle = kind == 3 ? random.uniform(0.1, 3.0) : kind == 4 ? 0.0 : 1e-9;
    const double height = kApproachThickness + (random.uniform() > 0 ? 1e-6 : 1e-10) * random.uniform(0.1, 10);
    d.from[0] = {-1, 0, 0};
    d.from[1] = {1, 0, 0};
    d.from[2] = Vector(-std::cos(angle), -std::sin(angle), height);
    d.from[3] = Vector(std::cos(angle), std::sin(angle), height);
    const Vector slide(random.uniform(), random.uniform(), kind == 5 ? 0.0 : 1e-3 * random.uniform());
    for (int i = 0; i < 4; ++i)
      d.to[i] = d.from[i] + (i < 2 ? slide : Vector(Vector::Zero()));
  }
  if (kind == 6)   // starts closer than the thickness
    d.from[2] = 0.5 * (d.from[0] + d.from[1]) + random.vector(0.04);
  if (kind == 7)   // without length
    d.from[1] = d.from[0], d.to[1] = d.to[0];
  return d;
}
constexpr int kKinds = 8;
const ApproachLimit limit{kApproachThickness, kReach, kKept};

TEST(ContinuousCollision, SegmentsKeepTheirGap)
{
  Random random(1);
  int stopped = 0;
  for (int k = 0; k < 1600; ++k)
  {
    const Draw d = drawMotion(random, k % kKinds);
    const double share = segmentsLimit(d.point(0), d.point(1), d.point(2), d.point(3), limit);
    stopped += share < 1.0;
    checkShare(share, [&](double t) {
      return segmentDistance(d.at(0, t), d.at(1, t), d.at(2, t), d.at(3, t)) - kApproachThickness;
    });
    ASSERT_FALSE(HasFailure()) << "case " << k << " kind " << k % kKinds;
  }
  EXPECT_GT(stopped, 300);
}

TEST(ContinuousCollision, PointsKeepTheirGapFromTriangles)
{
  Random random(2);
  int stopped = 0;
  for (int k = 0; k < 1600; ++k)
  {
    const Draw d = drawMotion(random, k % kKinds);
    const double triangle = pointTriangleLimit(d.point(2), d.point(0), d.point(1), d.point(3), limit);
    checkShare(triangle, [&](double t) {
      return pointTriangleDistance(d.at(2, t), d.at(0, t), d.at(1, t), d.at(3, t)) - kApproachThickness;
    });
    ASSERT_FALSE(HasFailure()) << "case " << k << " kind " << k % kKinds;
    stopped += triangle < 1.0;
  }
  EXPECT_GT(stopped, 300);
}

/// Fast and thin: what crosses completely within one motion is still found.
TEST(ContinuousCollision, NothingTunnels)
{
  Random random(3);
  for (int k = 0; k < 2000; ++k)
  {
    // the two segments cross at the middle of the motion, at the points 0.5 a and 0.5 b of their middles
    const Vector e = random.direction(), f = random.direction(), v = 100.0 * random.direction(), w = random.vector();
    const double s = random.uniform(-0.45, 0.45), t = random.uniform(-0.45, 0.45), when = random.uniform(0.1, 0.9);
    const Vector a = -s * e - when * v, b = -t * f - when * w;
    const MovingPoint a0{a - 0.5 * e, a - 0.5 * e + v}, a1{a + 0.5 * e, a + 0.5 * e + v},
        b0{b - 0.5 * f, b - 0.5 * f + w}, b1{b + 0.5 * f, b + 0.5 * f + w};
    const ApproachLimit thin{1e-4, 1e-5, 0.2};
    if (segmentDistance(a0.from, a1.from, b0.from, b1.from) > 1e-3)
      EXPECT_LT(segmentsLimit(a0, a1, b0, b1, thin), when);
  }
}

TEST(ContinuousCollision, TurningSolidsKeepTheirGap)
{
  Random random(4);
  const Triangle triangle{Vector(-0.3, -0.2, 0.1), Vector(0.4, -0.1, 0.0), Vector(0.0, 0.5, -0.1)};
  const std::vector<ConvexPiece> pieces{
      Plane{}, Sphere{0.3}, Box{{0.4, 0.3, 0.6}}, Cylinder{0.3, 0.5}, Capsule{0.02, 0.5}, triangle};
  int stopped = 0;
  for (std::size_t shape = 0; shape < pieces.size(); ++shape)
    for (int k = 0; k < 300; ++k)
    {
      const Vector a = random.vector(1.5), b = random.vector(1.5);
      const bool still = k % 4 == 0, rigid = k % 4 == 1;
      const MovingPoint ma{a, rigid ? a : Vector(a + random.vector(2.0))},
          mb{b, rigid ? b : Vector(b + random.vector(2.0))};
      const Pose from{random.vector(0.3), random.rotation()};
      const Pose to = still ? from : Pose{random.vector(), random.rotation()};
      const RigidMotion motion(from, to);
      EXPECT_LT(
          (motion.at(1.0).position - to.position).norm() + motion.at(1.0).orientation.angularDistance(to.orientation),
          1e-7);
      const double share = segmentSolidLimit(ma, mb, pieces[shape], motion, limit);
      stopped += share > 0.0 && share < 1.0;
      const auto gap = [&](double t) {
        const Pose inverse = motion.at(t).inverse();
        const Vector p = inverse * Vector(a + t * (ma.to - a)), q = inverse * Vector(b + t * (mb.to - b));
        double low = 0.0, high = 1.0;   // ternary search of a convex function
        const auto d = [&](double s) { return pieceDistance(pieces[shape], p + s * (q - p)).distance; };
        for (int i = 0; i < 50; ++i)
        {
          const double u = low + (high - low) / 3, v = high - (high - low) / 3;
          (d(u) < d(v) ? high : low) = d(u) < d(v) ? v : u;
        }
        return std::min({d(0.5 * (low + high)), d(0.0), d(1.0)}) - kApproachThickness;
      };
      const double start = gap(0.0);
      if (start <= 0.0)
      {
        EXPECT_EQ(share, 0.0);
        continue;
      }
      const double keep = kKept * std::min(start, kReach);
      for (int i = 0; i <= 100; ++i)
        ASSERT_GE(gap(share * i / 100), keep * (1 - 1e-9) - 1e-12) << "shape " << shape << " case " << k;
      ASSERT_TRUE(share == 1.0 || gap(share) <= 1.2 * keep)
          << "shape " << shape << " case " << k << " share " << share << " leaves " << gap(share);
    }
  EXPECT_GT(stopped, 200);   // many draws start inside each other
}

}   // namespace
}   // namespace slender::test
