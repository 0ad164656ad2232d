#include <functional>

#include <gtest/gtest.h>

#include "slender_sim/geometry/rotation.h"
#include "contact/impulses/impact_zones.h"
#include "test/support/random.h"
#include "test/support/sheets.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

/// Steps that all succeed and leave no intersection.
void expectClean(
    Sheets& s, int steps, double h, const std::function<void(int)>& drive = [](int) {})
{
  SurfaceCollider collider(s.surface);
  ASSERT_EQ(s.intersectionCount(), 0u);
  int impulses = 0, repulsions = 0;
  for (int k = 0; k < steps; ++k)
  {
    drive(k);
    const CollisionReport report = s.step(collider, h);
    ASSERT_TRUE(report.ok) << "step " << k << ": " << report.reason;
    ASSERT_TRUE(s.x.allFinite());
    ASSERT_EQ(s.intersectionCount(), 0u) << "step " << k;
    impulses += report.impulses;
    repulsions += report.repulsions;
  }
  EXPECT_GT(repulsions, 0);
  EXPECT_GT(impulses, 0);
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
  }
}

TEST(ClothCollisions, HeapOfSheets)
{
  Sheets s;
  s.gravity = {0, 0, -9.81};
  for (int k = 0; k < 3; ++k)
  {
    const double a = 0.5 * k;
    s.add(8, 8, {-0.2 * k, -0.1 * k, 0.1 + 0.08 * k}, {std::cos(a), std::sin(a), 0.05},
          {-std::sin(a), std::cos(a), 0.02});
  }
  s.addSolid(Plane{}, {}, 0.5);
  s.addSolid(Sphere{0.15}, {{0.3, 0.3, -0.06}, Eigen::Quaterniond::Identity()});
  expectClean(s, 80, 0.01);
}

TEST(ClothCollisions, EdgesCornersAndNeedles)
{
  const Eigen::Quaterniond corner = rotationBetween(Vector3d(1, 1, 1), Vector3d::UnitZ());
  const auto cone = std::make_shared<TriangleMesh>();
  cone->vertices.resize(3, 4);
  cone->vertices << 0, 0.02, -0.02, 0, 0, 0.02, 0.02, -0.02, 0.3, 0, 0, 0;
  cone->triangles.resize(3, 4);
  cone->triangles << 0, 0, 0, 1, 1, 2, 3, 3, 2, 3, 1, 2;
  const std::vector<std::pair<Shape, Pose>> solids{
      {Box{{0.3, 0.3, 0.3}}, {{0.02, 0.01, 0}, corner}},
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
        const Vector3d to = Eigen::AngleAxisd(angle, Vector3d::UnitX()) * rest +
                            Vector3d(0.25 + side * 0.05 * (k + 1) / steps, 0.25, 0);
        s.v.col(i) = (to - s.x.col(i)) / h;
      }
  });
}

Eigen::Matrix3Xd stackedSheets(Sheets& s, int layers, int n)
{
  for (int k = 0; k < layers; ++k)
    s.add(n, n, {0.013 * k, 0.007 * k, 2e-3 + 4.5e-3 * k}, {0.3, 0, 0}, {0, 0.3, 0});
  return s.x;
}

TEST(ClothCollisions, ImpulsesConserveMomentum)
{
  Random random(5);
  Sheets s;
  stackedSheets(s, 5, 5);
  for (Eigen::Index i = 0; i < s.x.cols(); ++i)
  {
    s.v.col(i) = random.vector(i % 3 == 0 ? 30.0 : 3.0);
    s.inverse_mass[i] *= random.uniform(0.2, 3.0);
  }
  SurfaceCollider collider(s.surface);
  int impulses = 0;
  for (int k = 0; k < 20; ++k)
  {
    Eigen::Matrix3Xd y = s.candidate(0.005), w = (y - s.x) / 0.005;
    const Eigen::Matrix3Xd candidate = y, velocity = w;
    const CollisionReport report = collider.resolve({s.x, s.inverse_mass, {}, {}, 0.005}, y, w);
    ASSERT_TRUE(report.ok) << report.reason;
    impulses += report.impulses;
    Vector3d moved(0, 0, 0), pushed(0, 0, 0);
    double before = 0.0, after = 0.0;
    for (Eigen::Index i = 0; i < y.cols(); ++i)
    {
      moved += (y.col(i) - candidate.col(i)) / s.inverse_mass[i];
      pushed += (w.col(i) - velocity.col(i)) / s.inverse_mass[i];
      before += velocity.col(i).squaredNorm() / s.inverse_mass[i];
      after += w.col(i).squaredNorm() / s.inverse_mass[i];
    }
    EXPECT_LT(moved.norm(), 1e-12);
    EXPECT_LT(pushed.norm(), 1e-10);
    EXPECT_LT(after, before * (1 + 1e-9));
    s.x = y;
    s.v = w;
    ASSERT_EQ(s.intersectionCount(), 0u) << "step " << k;
  }
  EXPECT_GT(impulses, 100);
}

/// Layers of very different masses thrown together: impulses take too long, zones end it.
TEST(ClothCollisions, ZonesConserveMomentum)
{
  Random random(6);
  Sheets s;
  const int layers = 8, n = 4, points = (n + 1) * (n + 1);
  stackedSheets(s, layers, n);
  for (Eigen::Index i = 0; i < s.x.cols(); ++i)
  {
    const int layer = static_cast<int>(i) / points;
    s.inverse_mass[i] *= std::pow(10.0, layer % 2 ? random.uniform(2, 4) : 0.0);
    s.v.col(i) = random.vector(2.0) + Vector3d(0, 0, layer < layers / 2 ? 40.0 : -40.0);
  }
  const Vector3d momentum = s.momentum();
  const double energy = s.energy();
  SurfaceCollider collider(s.surface);
  int zones = 0;
  for (int k = 0; k < 10; ++k)
  {
    Eigen::Matrix3Xd y = s.x + 0.002 * s.v, w = s.v;
    const CollisionReport report = collider.resolve({s.x, s.inverse_mass, {}, {}, 0.002}, y, w);
    ASSERT_TRUE(report.ok) << report.reason;
    zones += report.zones;
    EXPECT_EQ(report.zones > 0, report.zone_points >= 4);
    s.x = y;
    s.v = w;
    ASSERT_EQ(s.intersectionCount(), 0u) << "step " << k;
    EXPECT_LT((s.momentum() - momentum).norm(), 1e-10 * momentum.norm());
  }
  EXPECT_GT(zones, 0);
  EXPECT_LT(s.energy(), energy);
}

TEST(ClothCollisions, RigidFitKeepsBothMomenta)
{
  Random random(7);
  for (const int count : {4, 7})
    for (const bool in_a_line : {false, true})
    {
      Eigen::Matrix3Xd x(3, 8), u(3, 8);
      Eigen::VectorXd inverse_mass(8);
      const Vector3d along = random.direction();
      std::vector<int> points;
      for (int i = 0; i < 8; ++i)
      {
        x.col(i) = in_a_line ? Vector3d(random.uniform() * along) : random.vector();
        u.col(i) = random.vector();
        inverse_mass[i] = random.uniform(0.1, 5.0);
        if (i < count)
          points.push_back(i);
      }
      const RigidFit fit = rigidFit(points.data(), count, inverse_mass, x, u);
      Vector3d linear(0, 0, 0), angular(0, 0, 0);
      for (const int i : points)
      {
        const Vector3d lost = (u.col(i) - fit.rate(x.col(i))) / inverse_mass[i];
        linear += lost;
        angular += (Vector3d(x.col(i)) - fit.center).cross(lost);
      }
      EXPECT_LT(linear.norm(), 1e-12);
      EXPECT_LT(angular.norm(), 1e-12);
    }
}

/// A sheet on an inclined plane sticks or slides as Coulomb says.
TEST(ClothCollisions, FrictionOnAnIncline)
{
  for (const double friction : {0.2, 0.4, 0.5, 0.7})
  {
    Sheets s;
    const double slope = std::atan(0.45), h = 0.005;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(slope, Vector3d::UnitY()));
    s.add(4, 4, turn * Vector3d(-0.2, -0.2, 1.9e-3), turn * Vector3d(0.4, 0, 0), turn * Vector3d(0, 0.4, 0), 4e-3,
          friction);
    s.addSolid(Plane{}, {{0, 0, 0}, turn});
    s.gravity = {0, 0, -9.81};
    SurfaceCollider collider(s.surface);
    for (int k = 0; k < 40; ++k)
      ASSERT_TRUE(s.step(collider, h).ok);
    const double speed = (s.v * Eigen::VectorXd::Ones(25) / 25).dot(turn * Vector3d::UnitX());
    const double exact = std::max(0.0, 9.81 * (std::sin(slope) - friction * std::cos(slope)) * 40 * h);
    EXPECT_NEAR(speed, exact, 0.01 * exact + 1e-6) << friction;
  }
}

/// Between sheets: the upper one is carried, or slips over the lower one at the speed that friction gives it.
TEST(ClothCollisions, FrictionBetweenSheets)
{
  const double friction = 0.3, h = 0.002, acceleration = 6.0;
  Sheets s;
  const int second = s.add(6, 6, {-0.3, -0.3, 0}, {0.6, 0, 0}, {0, 0.6, 0}, 4e-3, friction) + 49;
  s.add(5, 5, {-0.1, -0.1, 3.9e-3}, {0.21, 0, 0}, {0, 0.2, 0}, 4e-3, friction);
  s.inverse_mass.head(second).setZero();
  s.gravity = {0, 0, -9.81};
  SurfaceCollider collider(s.surface);
  for (int k = 0; k < 50; ++k)
  {
    s.v.leftCols(second).colwise() = Vector3d(acceleration * h * (k + 1), 0, 0);
    const CollisionReport report = s.step(collider, h);
    ASSERT_TRUE(report.ok) << report.reason;
  }
  EXPECT_NEAR(s.v.row(0).rightCols(36).mean(), friction * 9.81 * 50 * h, 0.01 * friction * 9.81 * 50 * h);
  EXPECT_NEAR(s.v.row(2).rightCols(36).cwiseAbs().maxCoeff(), 0.0, 1e-3);
}

TEST(ClothCollisions, FailuresSayWhyAndChangeNothing)
{
  Sheets s;
  s.add(4, 4, {-0.1, -0.1, 0}, {0.2, 0, 0}, {0, 0.2, 0});
  s.addSolid(Box{{0.1, 0.1, 0.1}}, {{0.01, 0, 0.06}, Eigen::Quaterniond::Identity()});
  s.addSolid(Box{{0.1, 0.1, 0.1}}, {{0, 0.01, -0.06}, Eigen::Quaterniond::Identity()});
  SurfaceCollider collider(s.surface);
  const auto close = [&](double gap) {
    s.solids[0].position.z() = 0.05 + 0.5 * gap;
    s.solids[1].position.z() = -0.05 - 0.5 * gap;
  };
  for (const double gap : {0.015, 0.01, 0.005, 0.003, 0.002, 0.001})   // down to a quarter of the thickness
  {
    close(gap);
    const CollisionReport report = s.step(collider, 0.01);
    ASSERT_TRUE(report.ok) << gap << ": " << report.reason;
    ASSERT_EQ(s.intersectionCount(), 0u) << gap;
  }
  close(-0.001);
  Eigen::Matrix3Xd x = s.candidate(0.01), v = s.v;
  const Eigen::Matrix3Xd x_before = x, v_before = v;
  CollisionReport report = collider.resolve({s.x, s.inverse_mass, s.solids_before, s.solids, 0.01}, x, v);
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.reason.find("prescribed"), std::string::npos) << report.reason;
  EXPECT_EQ(x, x_before);
  EXPECT_EQ(v, v_before);

  close(0.001);
  Eigen::Matrix3Xd bad = s.x;
  bad.col(12).z() = 0.02;   // inside a box
  report = collider.resolve({bad, s.inverse_mass, s.solids, s.solids, 0.01}, x, v);
  EXPECT_TRUE(report.ok) << "a point inside a solid is on one side of its surface: " << report.reason;
  x(1, 3) = std::nan("");
  EXPECT_FALSE(collider.resolve({s.x, s.inverse_mass, s.solids, s.solids, 0.01}, x, v).ok);
  EXPECT_THROW(collider.resolve({s.x, s.inverse_mass, {}, {}, 0.01}, x, v), std::invalid_argument);
}

TEST(ClothCollisions, PrescribedPointsMoveAsPrescribed)
{
  Sheets s;
  s.gravity = {0, 0, -9.81};
  s.add(8, 8, {-0.2, -0.2, 0.11}, {0.4, 0, 0}, {0, 0.4, 0});
  s.addSolid(Sphere{0.1});
  for (const int i : {0, 8, 72, 80})
    s.inverse_mass[i] = 0.0;
  SurfaceCollider collider(s.surface);
  for (int k = 0; k < 50; ++k)   // carried along, the sphere spins and comes up
  {
    for (const int i : {0, 8, 72, 80})
      s.v.col(i) << 0.5, 0, 0;
    s.solids[0].position += Vector3d(5e-3, 0, 1e-3);
    s.solids[0].orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * k, Vector3d::UnitZ()));
    ASSERT_TRUE(s.step(collider, 0.01).ok);
    ASSERT_EQ(s.intersectionCount(), 0u);
  }
  for (const int i : {0, 8, 72, 80})
    EXPECT_LT((s.x.col(i) - s.surface.rest.col(i) - Vector3d(0.25, 0, 0)).norm(), 1e-12);
}

TEST(ClothCollisions, NothingIsCarriedOver)
{
  Sheets s;
  s.gravity = {0, 0, -9.81};
  stackedSheets(s, 3, 6);
  s.addSolid(Plane{});
  SurfaceCollider warm(s.surface);
  for (int k = 0; k < 10; ++k)
  {
    SurfaceCollider fresh(s.surface);
    Eigen::Matrix3Xd y = s.candidate(0.01), w = (y - s.x) / 0.01;
    ASSERT_TRUE(fresh.resolve({s.x, s.inverse_mass, s.solids, s.solids, 0.01}, y, w).ok);
    ASSERT_TRUE(s.step(warm, 0.01).ok);
    EXPECT_EQ(s.x, y);
    EXPECT_EQ(s.v, w);
  }
}

TEST(ClothCollisions, RefusesBadSurfaces)
{
  Sheets good;
  good.add(2, 2, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const auto refused = [&](const std::function<void(CollisionSurface&)>& spoil, const std::string& says) {
    CollisionSurface surface = good.surface;
    spoil(surface);
    try
    {
      SurfaceCollider collider(surface);
      ADD_FAILURE() << says;
    }
    catch (const std::invalid_argument& e)
    {
      EXPECT_NE(std::string(e.what()).find(says), std::string::npos) << e.what();
    }
  };
  refused([](CollisionSurface& s) { s.sheets[0].thickness = 0.0; }, "thickness");
  refused([](CollisionSurface& s) { s.sheets[0].friction = -0.1; }, "friction");
  refused([](CollisionSurface& s) { s.sheets[0].triangles(1, 2) = 9; }, "outside 0 ... 8");
  refused([](CollisionSurface& s) { s.sheets[0].triangles(1, 2) = s.sheets[0].triangles(0, 2); }, "twice");
  refused([](CollisionSurface& s) { s.rest.col(1) = s.rest.col(0); }, "one place");
  refused([](CollisionSurface& s) { s.rest(0, 0) = std::nan(""); }, "not finite");
  refused([](CollisionSurface& s) { s.solids.push_back({Sphere{-1.0}, -1.0, {}}); }, "radius");
}

}   // namespace
}   // namespace slender::test
