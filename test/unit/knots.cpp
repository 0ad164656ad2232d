#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "slender_sim/geometry/curves.h"

namespace slender {
namespace {

using Eigen::Vector3d;

/// |Alexander polynomial at -1| of a closed polyline, by its crossings seen along a direction: 1 for the unknot, 3 for
/// the trefoil. Each stretch from one crossing under to the next is an arc; at a crossing twice the arc over it equals
/// the sum of the two arcs below it.
long knotDeterminant(const Eigen::Matrix3Xd& nodes, const Vector3d& view)
{
  const Vector3d e3 = view.normalized(), e1 = e3.unitOrthogonal(), e2 = e3.cross(e1);
  const int n = static_cast<int>(nodes.cols());
  const auto point = [&](int i) {
    return Vector3d(e1.dot(nodes.col(i % n)), e2.dot(nodes.col(i % n)), e3.dot(nodes.col(i % n)));
  };
  struct Crossing
  {
    double under, over;
  };   // positions along the curve
  std::vector<Crossing> crossings;
  for (int i = 0; i < n; ++i)
  {
    for (int j = i + 2; j < n; ++j)
    {
      const Vector3d a = point(i), b = point(i + 1) - a, c = point(j), d = point(j + 1) - c, r = c - a;
      const double w = b.x() * d.y() - b.y() * d.x();
      const double s = (r.x() * d.y() - r.y() * d.x()) / w, t = (r.x() * b.y() - r.y() * b.x()) / w;
      if ((i == 0 && j == n - 1) || !(s >= 0 && s < 1 && t >= 0 && t < 1))
        continue;
      const bool i_is_over = a.z() + s * b.z() > c.z() + t * d.z();
      crossings.push_back(i_is_over ? Crossing{j + t, i + s} : Crossing{i + s, j + t});
    }
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) { return a.under < b.under; });
  const int count = static_cast<int>(crossings.size());
  Eigen::MatrixXd equations = Eigen::MatrixXd::Zero(count, count);
  for (int k = 0; k < count; ++k)   // arc k ends at crossing k
  {
    int over = 0;
    while (over < count && crossings[over].under < crossings[k].over)
      ++over;
    equations(k, over % count) += 2;
    equations(k, k) -= 1;
    equations(k, (k + 1) % count) -= 1;
  }
  return count < 2 ? 1 : std::lround(std::abs(equations.topLeftCorner(count - 1, count - 1).determinant()));
}

/// Smallest distance between nodes that are more than `apart` of the curve's length from each other.
double ownDistance(const Eigen::Matrix3Xd& nodes, double apart)
{
  const double length = edgeLengths(nodes, false).sum(), edge = length / static_cast<double>(nodes.cols() - 1);
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < nodes.cols(); ++i)
    for (Eigen::Index j = i + static_cast<Eigen::Index>(apart / edge); j < nodes.cols(); ++j)
      least = std::min(least, (nodes.col(i) - nodes.col(j)).norm());
  return least;
}

Eigen::Matrix3Xd closedFarAway(const Eigen::Matrix3Xd& nodes, const Vector3d& up)
{
  Eigen::Matrix3Xd all(3, nodes.cols() + 2);
  all << nodes, nodes.rightCols<1>() + 10 * up, nodes.leftCols<1>() + 10 * up;
  return all;
}

TEST(Knots, determinantTellsKnotsApart)
{
  EXPECT_EQ(knotDeterminant(arcCurve({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 2 * M_PI, 30).leftCols(30), {0.1, 0.2, 1}), 1);
  EXPECT_EQ(knotDeterminant(torusKnotCurve({0, 0, 0}, {0, 0, 1}, 2, 0.7, 2, 5, 300).leftCols(300), {0.1, 0.2, 1}), 5);
}

TEST(Knots, torusKnotIsATrefoil)
{
  const auto nodes = torusKnotCurve({1, 2, 3}, {0, 1, 0}, 0.1, 0.04, 2, 3, 200);
  ASSERT_EQ(nodes.cols(), 201);
  EXPECT_EQ(nodes.col(0), nodes.col(200));
  EXPECT_EQ(knotDeterminant(nodes.leftCols(200), {0.1, 0.2, 1}), 3);
  for (int i = 0; i < 200; ++i)
  {
    const Vector3d p = nodes.col(i) - Vector3d(1, 2, 3);
    EXPECT_NEAR(std::hypot(std::hypot(p.x(), p.z()) - 0.1, p.y()), 0.04, 1e-14);
  }
  EXPECT_THROW(torusKnotCurve({0, 0, 0}, {0, 0, 1}, 0.1, 0.04, 2, 4, 200), std::invalid_argument);
  EXPECT_THROW(torusKnotCurve({0, 0, 0}, {0, 0, 1}, 0.1, 0.1, 2, 3, 200), std::invalid_argument);
  EXPECT_THROW(torusKnotCurve({0, 0, 0}, {0, 0, 0}, 0.1, 0.04, 2, 3, 200), std::invalid_argument);
}

TEST(Knots, trefoilIsKnottedBetweenStraightTails)
{
  const Vector3d center(1, 2, 3), axis(0, 1, 0), up(0, 0, 1);
  for (bool left : {false, true})
  {
    const auto nodes = trefoilCurve(center, axis, up, 0.1, 0.02, 1.5, left, 400);
    ASSERT_EQ(nodes.cols(), 401);
    EXPECT_EQ(knotDeterminant(closedFarAway(nodes, up), {1, 0.1, 0.05}), 3);
    // Tails of one line through the centre, the ends equally far from it.
    EXPECT_LT((nodes.col(0) + nodes.col(400) - 2 * center).norm(), 1e-12);
    for (int i : {0, 10, 400})
      EXPECT_LT((nodes.col(i) - center).cross(axis).norm(), 1e-12);
    const auto lengths = edgeLengths(nodes, false);
    EXPECT_NEAR(lengths.sum(), 1.5, 1e-3);   // chords
    EXPECT_GT(lengths.minCoeff(), 0.99 * lengths.maxCoeff());
    EXPECT_LT(nodes.row(2).minCoeff(), 3 - 0.1);   // the loop hangs
  }
  // The two hands are mirror images.
  Eigen::Matrix3Xd left = trefoilCurve({0, 0, 0}, axis, up, 0.1, 0.02, 1.5, true, 100);
  left.row(0) *= -1;
  EXPECT_LT((left - trefoilCurve({0, 0, 0}, axis, up, 0.1, 0.02, 1.5, false, 100)).norm(), 1e-12);
}

/// Room for a rod of 0.8 times the separation.
TEST(Knots, trefoilDoesNotTouchItself)
{
  for (double separation : {0.004, 0.0125, 0.025})
  {
    EXPECT_GT(ownDistance(trefoilCurve({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.1, separation, 1.5, false, 4000), 0.2),
              0.8 * separation);
  }
}

TEST(Knots, trefoilRefusesWhatCannotBe)
{
  const auto knot = [](double radius, double separation, double length, const Vector3d& up) {
    return trefoilCurve({0, 0, 0}, {1, 0, 0}, up, radius, separation, length, false, 100);
  };
  EXPECT_NO_THROW(knot(0.1, 0.01, 1.5, {0, 0, 1}));
  EXPECT_THROW(knot(0, 0.01, 1.5, {0, 0, 1}), std::invalid_argument);
  EXPECT_THROW(knot(0.1, 0.03, 1.5, {0, 0, 1}), std::invalid_argument);
  EXPECT_THROW(knot(0.1, 0.01, 0.9, {0, 0, 1}), std::invalid_argument);   // shorter than the knot itself
  EXPECT_THROW(knot(0.1, 0.01, 1.5, {1, 0, 0}), std::invalid_argument);
}

TEST(Knots, veeHasItsTipAndAngle)
{
  const auto nodes = veeCurve({1, 0, 0}, {0, 2, 0}, {0, 0, 3}, 0.5, 1.0, 20);
  ASSERT_EQ(nodes.cols(), 21);
  EXPECT_EQ(nodes.col(10), Vector3d(1, 0, 0));
  const Vector3d first = nodes.col(0) - nodes.col(10), last = nodes.col(20) - nodes.col(10);
  EXPECT_NEAR(first.norm(), 0.5, 1e-15);
  EXPECT_NEAR(last.norm(), 0.5, 1e-15);
  EXPECT_NEAR(std::acos(first.dot(last) / 0.25), 1.0, 1e-12);
  EXPECT_NEAR(first.y(), 0.5 * std::cos(0.5), 1e-15);
  EXPECT_GT(first.x(), 0);   // -(normal x direction) is +x
  EXPECT_THROW(veeCurve({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1, 1, 21), std::invalid_argument);
  EXPECT_THROW(veeCurve({0, 0, 0}, {1, 0, 0}, {1, 0, 0}, 1, 1, 20), std::invalid_argument);
}

}   // namespace
}   // namespace slender
