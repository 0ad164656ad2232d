#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "test/support/contact.h"

namespace slender::test {
namespace {

Eigen::Matrix3Xd nodesBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int edges)
{
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
    nodes.col(i) = from + (to - from) * (static_cast<double>(i) / edges);
  return nodes;
}

ContactCase twoRods(const Eigen::Vector3d& offset, double angle, double tilt, double height)
{
  ContactCase c;
  addCurve(c.surface, c.x, nodesBetween({-0.5, 0, 0}, {0.5, 0, 0}, 3), kCurveRadius);
  const Eigen::Vector3d along(std::cos(angle), std::sin(angle), tilt),
      middle = offset + Eigen::Vector3d(0, 0, 2 * kCurveRadius + height);
  addCurve(c.surface, c.x, nodesBetween(middle - 0.5 * along, middle + 0.5 * along, 3), kCurveRadius);
  return c;
}

TEST(ContactPotential, ForceOfRodsIsTheGradient)
{
  for (double height : {0.002, 0.006, 0.009})
    for (double angle : {0.0, 1e-4, 0.01, 0.3, 1.3})
      for (double tilt : {0.0, 1e-3})
        for (double along : {0.0, 0.11, 1.0 / 6})
        {
          ContactCase c = twoRods({along, 0.003, 0}, angle, tilt, height);
          ContactPotential p = c.potential();
          EXPECT_LT(gradientError(p, c.x, c.solids), kDifferences)
              << height << " " << angle << " " << tilt << " " << along;
        }
}

/// A bend of three edges, the middle one of this length. The last edge comes back over the first one at this angle.
ContactCase bend(double length, double angle)
{
  ContactCase c;
  Eigen::Matrix3Xd nodes(3, 4);
  nodes << -1, 0, length * std::cos(angle), length * std::cos(angle) - 1,   //
      0, 0, length * std::sin(angle), length * std::sin(angle),             //
      0, 0, 0, 0;
  addCurve(c.surface, c.x, nodes, kCurveRadius);
  return c;
}

TEST(ContactPotential, ABendThatIsStretchedKeepsItsRoom)
{
  int with_room = 0, without = 0;
  for (double angle : {0.2, 0.5, 0.65, 0.8, 1.2})
  {
    bool had_room = false;
    for (double length = 1e-3; length < 1.0; length *= 1.1)
    {
      const ContactCase c = bend(length, angle);
      ContactPotential p = c.potential();
      const bool has_room = p.clearance(c.x, {}) > 0.0;
      EXPECT_EQ(std::isfinite(p.evaluate(c.x, {}, false)), has_room) << angle << " " << length;
      EXPECT_TRUE(has_room || !had_room) << angle << " " << length;
      had_room = has_room;
      (has_room ? with_room : without) += length < kCurveRadius;
    }
  }
  EXPECT_GT(with_room, 0);
  EXPECT_GT(without, 0);
}

TEST(ContactPotential, ABendNoTighterThanItsRadiusTouchesNothing)
{
  for (int edges : {4, 16, 64})
  {
    ContactCase c;
    Eigen::Matrix3Xd nodes(3, edges + 1);
    for (int i = 0; i <= edges; ++i)
      nodes.col(i) = (kCurveRadius + 0.5 * kContactGap) *
                     Eigen::Vector3d(std::cos(M_PI * i / edges), std::sin(M_PI * i / edges), 0.0);
    addCurve(c.surface, c.x, nodes, kCurveRadius);
    ContactPotential p = c.potential();
    EXPECT_EQ(p.evaluate(c.x, {}, false), 0.0) << edges;
  }
}

/// Edges of a curve that is compressed come near each other lengthwise.
TEST(ContactPotential, ACurveIsNotCompressedToHalfOfItsLength)
{
  for (double length : {0.02, 0.1, 0.18})
    for (const auto& [share, touches] : {std::make_pair(0.65, false), {0.56, true}, {0.5, true}})
    {
      ContactCase c;
      addCurve(c.surface, c.x, nodesBetween({0, 0, 0}, {3 * length, 0, 0}, 3), kCurveRadius);
      ContactPotential p = c.potential();
      const double energy = p.evaluate(share * c.x, {}, false);
      EXPECT_EQ(energy > 0.0, touches) << length << " " << share;
      EXPECT_EQ(std::isfinite(energy), share > 0.5) << length << " " << share;
    }
}

TEST(ContactPotential, ForceInABendIsTheGradient)
{
  for (double length : {0.1, 0.3, 1.0})   // of the curve's radius
    for (double angle : {0.57, 0.6, 0.65})
    {
      ContactCase c = bend(length * kCurveRadius, angle);
      ContactPotential p = c.potential();
      EXPECT_GT(p.evaluate(c.x, c.solids, false), 0.0) << length << " " << angle;
      EXPECT_LT(gradientError(p, c.x, c.solids), kDifferences) << length << " " << angle;
    }
}

TEST(ContactPotential, ForceOfSolidsIsTheGradient)
{
  const auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices.resize(3, 4);
  mesh->vertices << -0.3, 0.3, 0.0, 0.0, -0.2, -0.2, 0.4, 0.0, 0.0, 0.0, 0.0, 0.3;
  mesh->triangles.resize(3, 4);
  mesh->triangles << 0, 0, 1, 2, 2, 1, 2, 0, 1, 3, 3, 3;
  const std::vector<Shape> shapes{Plane{},           Sphere{0.2}, Box{{0.4, 0.3, 0.2}}, Cylinder{0.1, 0.5},
                                  Capsule{0.1, 0.3}, mesh};
  Random random(3);
  for (const Shape& shape : shapes)
  {
    int checked = 0;
    for (int k = 0; k < 40; ++k)
    {
      ContactCase c;
      const Eigen::Vector3d e = 0.4 * random.direction(), n = random.direction();
      addCurve(c.surface, c.x, nodesBetween(-0.5 * e, 0.5 * e, 2), kCurveRadius);
      c.surface.solids.push_back({shape, -1.0, {}});
      c.solids.push_back({Eigen::Vector3d::Zero(), random.rotation()});
      ContactPotential p = c.potential();
      // along n to a clearance of a third of the gap
      double low = -1.0, high = 2.0;
      for (int i = 0; i < 60; ++i)
      {
        const double s = 0.5 * (low + high);
        c.solids[0].position = s * n;
        const double clear = p.clearance(c.x, c.solids);
        (s > 0.0 && clear > kContactGap / 3 ? high : low) = s;
      }
      if (std::abs(p.clearance(c.x, c.solids) - kContactGap / 3) > 1e-6)
        continue;   // a plane that n does not leave
      EXPECT_LT(gradientError(p, c.x, c.solids), kDifferences) << shape.index() << " case " << k;
      ++checked;
    }
    EXPECT_GT(checked, 10);
  }
}

}   // namespace
}   // namespace slender::test
