#include <gtest/gtest.h>

#include "test/support/random.h"
#include "test/support/sheets.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

/// Steps that all succeed and leave no intersection.
void expectClean(Sheets& s, int steps, double h, const std::function<void(int)>& drive = [](int) {})
{
  SurfaceCollider collider(s.surface);
  ASSERT_EQ(s.intersectionCount(), 0u);
  int impulses = 0, repulsions = 0, zones = 0, rounds = 0;
  for (int k = 0; k < steps; ++k)
  {
    drive(k);
    const CollisionReport report = s.step(collider, h);
    ASSERT_TRUE(report.ok) << "step " << k << ": " << report.reason;
    ASSERT_TRUE(s.x.allFinite());
    ASSERT_EQ(s.intersectionCount(), 0u) << "step " << k;
    impulses += report.impulses;
    repulsions += report.repulsions;
    zones += report.zones;
    rounds = std::max(rounds, report.rounds);
  }
  EXPECT_GT(impulses + repulsions, 0);
  std::printf("  impulses %d repulsions %d zones %d most rounds %d\n", impulses, repulsions, zones, rounds);
}

TEST(ClothCollisions, SheetsThrownAtEachOtherDoNotPass)
{
  for (const double speed : {1.0, 30.0})
  {
    Sheets s;
    const int n = 8;
    const int second = s.add(n, n, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}) + (n + 1) * (n + 1);
    ASSERT_EQ(s.add(n, n, {0.1, 0.05, 0.1}, {0.9, 0.3, 0.05}, {-0.3, 0.9, 0.0}), second);
    for (Eigen::Index i = 0; i < s.x.cols(); ++i)
      s.v.col(i) = Vector3d(0, 0, i < second ? speed : -speed);
    const Vector3d p = s.momentum();
    const double energy = s.energy();
    expectClean(s, 40, 0.01);
    EXPECT_LT((s.momentum() - p).norm(), 1e-9);
    EXPECT_LT(s.energy(), energy);
    EXPECT_GT((s.x.leftCols(second).row(2).array()).mean(), -100);
  }
}

TEST(ClothCollisions, HeapOfSheets)
{
  Sheets s;
  s.gravity = {0, 0, -9.81};
  for (int k = 0; k < 3; ++k)
  {
    const double a = 0.5 * k;
    s.add(8, 8, {-0.2 * k, -0.1 * k, 0.1 + 0.08 * k}, {std::cos(a), std::sin(a), 0.05}, {-std::sin(a), std::cos(a), 0.02});
  }
  s.addSolid(Plane{}, {}, 0.5);
  s.addSolid(Sphere{0.15}, {{0.3, 0.3, -0.06}, Eigen::Quaterniond::Identity()});
  expectClean(s, 80, 0.01);
}

TEST(ClothCollisions, EdgesCornersAndNeedles)
{
  const Eigen::Quaterniond corner = Eigen::Quaterniond::FromTwoVectors(Vector3d(1, 1, 1), Vector3d::UnitZ());
  const auto cone = std::make_shared<TriangleMesh>();
  cone->vertices.resize(3, 4);
  cone->vertices << 0, 0.02, -0.02, 0, 0, 0.02, 0.02, -0.02, 0.3, 0, 0, 0;
  cone->triangles.resize(3, 4);
  cone->triangles << 0, 0, 0, 1, 1, 2, 3, 3, 2, 3, 1, 2;
  const std::vector<std::pair<Shape, Pose>> solids{{Box{{0.3, 0.3, 0.3}}, {{0.02, 0.01, 0}, corner}},
                                                   {Capsule{0.003, 0.4}, {{0.01, 0.02, 0}, Eigen::Quaterniond::Identity()}},
                                                   {Cylinder{0.03, 0.4}, {{0.01, 0.02, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3d::UnitX()))}},
                                                   {cone, {{0.03, 0.02, 0}, Eigen::Quaterniond::Identity()}},
                                                   {Sphere{0.2}, {}}};
  for (const auto& [shape, pose] : solids)
  {
    Sheets s;
    s.gravity = {0, 0, -9.81};
    s.add(8, 8, {-0.4, -0.4, 0.35}, {0.8, 0, 0}, {0, 0.8, 0});
    s.addSolid(shape, pose);
    expectClean(s, 60, 0.01);
    ASSERT_FALSE(HasFailure()) << shape.index();
  }
}

TEST(ClothCollisions, TwistedSheet)
{
  Sheets s;
  const int n = 12;
  s.add(n, n, {0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0});
  const auto atEnds = [n](Eigen::Index i) { return i <= n || i >= n * (n + 1); };
  for (Eigen::Index i = 0; i < s.x.cols(); ++i)
    if (atEnds(i))
      s.inverse_mass[i] = 0.0;
  const double h = 0.01;
  const int steps = 200;
  expectClean(s, steps, h, [&](int k) {
    for (Eigen::Index i = 0; i < s.x.cols(); ++i)
      if (atEnds(i))
      {
        const double side = i <= n ? 1 : -1, angle = side * 2 * M_PI * (k + 1) / steps;
        const Vector3d rest = s.surface.rest.col(i) - Vector3d(0.25, 0.25, 0);
        const Vector3d to = Eigen::AngleAxisd(angle, Vector3d::UnitX()) * rest + Vector3d(0.25 + side * 0.05 * (k + 1) / steps, 0.25, 0);
        s.v.col(i) = (to - s.x.col(i)) / h;
      }
  });
}

}  // namespace
}  // namespace slender::test
