#include "slender_sim/geometry/curves.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace slender {
namespace {

using Eigen::Vector3d;

TEST(Curves, straightHasEqualEdgesAndExactEnds)
{
  const auto nodes = straightCurve({0, 0, 1}, {0.7, 0.1, 1}, 7);
  ASSERT_EQ(nodes.cols(), 8);
  EXPECT_EQ(nodes.col(0), Vector3d(0, 0, 1));
  EXPECT_EQ(nodes.col(7), Vector3d(0.7, 0.1, 1));
  const auto lengths = edgeLengths(nodes, false);
  EXPECT_NEAR(lengths.maxCoeff(), lengths.minCoeff(), 1e-15);
}

TEST(Curves, arcStaysOnItsCircle)
{
  const auto nodes = arcCurve({1, 0, 0}, {1, 2, 0}, {0, 0, 3}, -M_PI, 40);
  for (int i = 0; i <= 40; ++i)
    EXPECT_NEAR((nodes.col(i) - Vector3d(1, 0, 0)).norm(), 2.0, 1e-14);
  EXPECT_LT((nodes.col(40) - Vector3d(1, -2, 0)).norm(), 1e-14);
  EXPECT_GT(nodes(0, 20), 2.9);   // negative about z: from +y over +x
}

TEST(Curves, helixHasItsRadiusPitchAndHand)
{
  const auto nodes = helixCurve({0, 0, 1}, {0, 0, 2}, 0.1, 0.05, 3, 300);
  EXPECT_LT((nodes.col(0) - Vector3d(0.1, 0, 1)).norm(), 1e-15);
  EXPECT_LT((nodes.col(300) - Vector3d(0.1, 0, 1.15)).norm(), 1e-14);
  EXPECT_LT((nodes.col(25) - Vector3d(0, 0.1, 1 + 0.05 / 4)).norm(), 1e-14);   // a quarter turn: right-handed
}

TEST(Curves, catenaryMeetsEndsLengthAndEquation)
{
  const Vector3d from(0, 0, 1), to(0.6, 0.8, 1.5);
  for (double length : {1.2, 1.5, 4.0, 60.0})
  {
    const int edges = 20000;
    const auto nodes = catenaryCurve(from, to, length, {0, 0, -9.81}, edges);
    EXPECT_EQ(nodes.col(0), from);
    // The closed form ends at `to` by itself: the last computed edge is as long as the others.
    const auto lengths = edgeLengths(nodes, false);
    EXPECT_NEAR(lengths.sum(), length, 1e-5 * length);   // chords are shorter by h^2 kappa^2 / 24
    EXPECT_NEAR(lengths[edges - 1], lengths[edges - 2], 1e-6 * length / edges);
    // Horizontal tension is constant: dx/ds / (1 / sqrt(1 + slope^2)) ... the slope grows linearly with arc length.
    const auto slope = [&](int j) {
      const Vector3d d = nodes.col(j + 1) - nodes.col(j);
      return d.z() / std::hypot(d.x(), d.y());
    };
    const double growth = slope(2 * edges / 3) - slope(edges / 3);
    EXPECT_NEAR(slope(edges / 3) - slope(1), growth, 1e-3 * growth);
  }
}

TEST(Curves, tautCatenaryIsStraight)
{
  const auto nodes = catenaryCurve({0, 0, 0}, {3, 0, 4}, 5.0, {0, 0, -1}, 10);
  EXPECT_LT((nodes.col(5) - Vector3d(1.5, 0, 2)).norm(), 1e-6);
}

TEST(Curves, resamplingKeepsEndsAndSpacing)
{
  Eigen::Matrix3Xd corner(3, 3);
  corner << 0, 1, 1, 0, 0, 3, 0, 0, 0;
  const auto nodes = resampleCurve(corner, false, 8);
  ASSERT_EQ(nodes.cols(), 9);
  EXPECT_LT((nodes.col(2) - Vector3d(1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((nodes.col(5) - Vector3d(1, 1.5, 0)).norm(), 1e-15);
  EXPECT_EQ(nodes.col(8), corner.col(2));
}

TEST(Curves, resamplingAClosedCurveLeavesTheJoiningEdge)
{
  Eigen::Matrix3Xd square(3, 4);
  square << 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0;
  const auto nodes = resampleCurve(square, true, 8);
  ASSERT_EQ(nodes.cols(), 8);
  EXPECT_LT((nodes.col(7) - Vector3d(0, 0.5, 0)).norm(), 1e-15);
  const auto lengths = edgeLengths(nodes, true);
  ASSERT_EQ(lengths.size(), 8);
  EXPECT_NEAR(lengths.maxCoeff(), 0.5, 1e-15);
  EXPECT_NEAR(lengths.minCoeff(), 0.5, 1e-15);
}

TEST(Curves, resamplingFollowsUnevenFractions)
{
  const auto fractions = lengthFractions(Eigen::Vector3d(1, 2, 1));
  const auto nodes = resampleCurve(straightCurve({0, 0, 0}, {8, 0, 0}, 5), false, fractions);
  ASSERT_EQ(nodes.cols(), 4);
  EXPECT_NEAR(nodes(0, 1), 2.0, 1e-14);
  EXPECT_NEAR(nodes(0, 2), 6.0, 1e-14);
}

TEST(Curves, refuseBadArguments)
{
  EXPECT_THROW(straightCurve({0, 0, 0}, {1, 0, 0}, 0), std::invalid_argument);
  EXPECT_THROW(arcCurve({0, 0, 0}, {1, 0, 0}, {0, 0, 0}, 1, 5), std::invalid_argument);
  EXPECT_THROW(arcCurve({0, 0, 0}, {0, 0, 1}, {0, 0, 1}, 1, 5), std::invalid_argument);
  EXPECT_THROW(helixCurve({0, 0, 0}, {0, 0, 1}, 0, 1, 1, 5), std::invalid_argument);
  EXPECT_THROW(helixCurve({0, 0, 0}, {0, 0, 0}, 1, 1, 1, 5), std::invalid_argument);
  EXPECT_THROW(catenaryCurve({0, 0, 0}, {1, 0, 0}, 0.99, {0, 0, -1}, 5), std::invalid_argument);
  EXPECT_THROW(catenaryCurve({0, 0, 0}, {0, 0, 1}, 2, {0, 0, -1}, 5), std::invalid_argument);
  EXPECT_THROW(catenaryCurve({0, 0, 0}, {1, 0, 0}, 2, {0, 0, 0}, 5), std::invalid_argument);
  EXPECT_THROW(resampleCurve(Eigen::Matrix3Xd::Zero(3, 1), false, 3), std::invalid_argument);
  EXPECT_THROW(resampleCurve(Eigen::Matrix3Xd::Zero(3, 4), false, 3), std::invalid_argument);
}

}   // namespace
}   // namespace slender
