#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/contact/intersection.h"
#include "contact/kdop_tree.h"
#include "test/support/random.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

int exactSign(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d)   // of whole numbers
{
  const auto difference = [&](const Vector3d& p, int k) {
    return static_cast<long long>(p[k]) - static_cast<long long>(d[k]);
  };
  __int128 volume = 0;
  for (int k = 0; k < 3; ++k)
  {
    const int l = (k + 1) % 3, m = (k + 2) % 3;
    volume += static_cast<__int128>(difference(a, k)) * (static_cast<__int128>(difference(b, l)) * difference(c, m) -
                                                         static_cast<__int128>(difference(b, m)) * difference(c, l));
  }
  return volume > 0 ? 1 : volume < 0 ? -1 : 0;
}

TEST(Intersections, OrientationIsExact)
{
  Random random(1);
  int flat = 0, close = 0;
  for (int k = 0; k < 20000; ++k)
  {
    // whole numbers of 40 bits, the fourth point in the plane of the others but for a little
    const auto whole = [&](double size) { return Vector3d(random.vector(size).array().round()); };
    const Vector3d a = whole(1e11), u = whole(1e5), v = whole(1e5), b = a + u, c = a + v;
    const int s = static_cast<int>(random.uniform(-9, 9)), t = static_cast<int>(random.uniform(-9, 9));
    const Vector3d d = a + s * u + t * v + (k % 2 ? whole(1.4) : Vector3d(0, 0, 0));
    const int sign = exactSign(a, b, c, d);
    flat += sign == 0;
    close += sign != 0;
    ASSERT_EQ(orientation(a, b, c, d), sign);
    ASSERT_EQ(orientation(b, a, c, d), -sign);
  }
  EXPECT_GT(flat, 5000);
  EXPECT_GT(close, 5000);
}

TEST(Intersections, SegmentsAndTriangles)
{
  const Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  const auto meets = [&](const Vector3d& p, const Vector3d& q) {
    const bool m = segmentMeetsTriangle(p, q, a, b, c);
    EXPECT_EQ(m, segmentMeetsTriangle(q, p, a, b, c));
    EXPECT_EQ(m, segmentMeetsTriangle(p, q, c, b, a));
    EXPECT_EQ(m, segmentMeetsTriangle(p, q, b, c, a));
    return m;
  };
  EXPECT_TRUE(meets({0.2, 0.2, 1}, {0.3, 0.3, -1}));
  EXPECT_FALSE(meets({0.2, 0.2, 1}, {0.3, 0.3, 1e-300}));
  EXPECT_TRUE(meets({0.2, 0.2, 1}, {0.3, 0.3, 0}));
  EXPECT_TRUE(meets({0.5, 0.5, 1}, {0.5, 0.5, -1}));   // through a side
  EXPECT_TRUE(meets({0, 0, 1}, {0, 0, -1}));           // through a corner
  EXPECT_FALSE(meets({0.6, 0.6, 1}, {0.6, 0.6, -1}));
  EXPECT_TRUE(meets({-1, 0.2, 0}, {2, 0.2, 0}));   // in its plane
  EXPECT_TRUE(meets({0.2, 0.2, 0}, {0.3, 0.2, 0}));
  EXPECT_FALSE(meets({-1, 1.5, 0}, {2, 1.2, 0}));
  EXPECT_FALSE(meets({2, 0, 0}, {3, 0, 0}));   // in the line of a side
  EXPECT_TRUE(meets({1, 0, 0}, {3, 0, 0}));
  EXPECT_FALSE(segmentMeetsTriangle({0, 0, 1}, {0, 0, 2}, {0, 0, 0}, {1, 1, 0}, {2, 2, 0}));   // without area
  EXPECT_TRUE(segmentMeetsTriangle({0.5, 0.5, 1}, {0.5, 0.5, -2}, {0, 0, 0}, {1, 1, 0}, {2, 2, 0}));
  EXPECT_FALSE(segmentMeetsTriangle({0.5, 0.6, 1}, {0.5, 0.6, -2}, {0, 0, 0}, {1, 1, 0}, {2, 2, 0}));
}

TEST(Intersections, SheetsAndSolids)
{
  CollisionSurface surface;
  surface.rest.resize(3, 6);
  surface.rest << 0, 1, 0, 0.2, 0.3, 5,   //
      0, 0, 1, 0.2, 0.3, 5,               //
      0, 0, 0, -1, 1, 5;
  CollisionSheet sheet;
  sheet.triangles.resize(3, 2);
  sheet.triangles << 0, 3, 1, 4, 2, 5;
  surface.sheets.push_back(sheet);
  EXPECT_GE(intersections(surface, surface.rest, {}).size(), 1u);
  surface.sheets[0].self = false;
  EXPECT_EQ(intersections(surface, surface.rest, {}).size(), 0u);
  // needles that pierce the middle of the first face, and the same beside it
  const auto pin = std::make_shared<TriangleMesh>();
  pin->vertices = 0.01 * Eigen::Matrix3d::Identity();
  pin->vertices.row(2) << -1, 1, 1;
  pin->triangles.resize(3, 1);
  pin->triangles << 0, 1, 2;
  for (const Shape& shape : {Shape(Capsule{0.01, 2}), Shape(Cylinder{0.01, 2}), Shape(Box{{0.01, 0.01, 2}}),
                             Shape(Sphere{0.05}), Shape(pin)})
  {
    surface.solids = {{shape, -1.0, {}}};
    Pose pose;
    pose.position << 0.4, 0.3, 0;
    EXPECT_GE(intersections(surface, surface.rest, {pose}).size(), 1u) << shape.index();
    pose.position << 0.7, 0.5, 0;
    EXPECT_EQ(intersections(surface, surface.rest, {pose}).size(), 0u) << shape.index();
    pose.position << 0.4, 0.3, 0;
    surface.solids[0].ignores = {0};
    EXPECT_EQ(intersections(surface, surface.rest, {pose}).size(), 0u) << shape.index();
  }
  surface.solids = {{Plane{}, -1.0, {}}};
  Pose pose;
  pose.position.z() = -0.5;
  EXPECT_EQ(intersections(surface, surface.rest, {pose}).size(), 1u);
}

/// Whatever the order of building, the tree finds the pairs that all pairs have, but those of groups that do not touch.
TEST(KdopTree, FindsAllPairs)
{
  Random random(3);
  const int n = 1000;
  for (const double size : {0.15, 0.5})
  {
    Eigen::Matrix3Xd centers(3, n);
    std::vector<int> groups(n);
    std::vector<Kdop> volumes(n);
    std::vector<char> active(n);
    Eigen::Matrix3Xd from(3, n), to(3, n);
    for (int i = 0; i < n; ++i)
    {
      centers.col(i) = random.vector();
      groups[i] = static_cast<int>(random.uniform(0, 3));
      from.col(i) = random.vector();
      to.col(i) = from.col(i) + random.vector(size);
      volumes[i] = Kdop::swept(from.col(i).data(), to.col(i).data(), 0.1 * size);
      active[i] = size > 0.2 || random.uniform() > 0;
    }
    KdopTree tree;
    const std::vector<char> touching =
        size > 0.2 ? std::vector<char>{1, 1, 1, 1, 1, 1, 1, 1, 1} : std::vector<char>{1, 0, 1, 0, 0, 1, 1, 1, 1};
    tree.build(centers, groups, touching, 3);
    tree.refit(volumes, active);
    std::vector<KdopTree::Pair> found;
    tree.selfPairs(found);
    std::vector<std::pair<int, int>> pairs, expected;
    for (const KdopTree::Pair& p : found)
      pairs.push_back(std::minmax(p.first, p.second));
    std::sort(pairs.begin(), pairs.end());
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j)
      {
        if (volumes[i].overlaps(volumes[j]) && (active[i] || active[j]) && touching[3 * groups[i] + groups[j]])
          expected.push_back({i, j});
        // and volumes hold what they should: balls that meet
        const auto at = [&](int k, double t) -> Vector3d { return from.col(k) + t * (to.col(k) - from.col(k)); };
        for (double t : {0.0, 0.3, 1.0})
          EXPECT_TRUE((at(i, t) - at(j, 1 - t)).norm() > 0.2 * size || volumes[i].overlaps(volumes[j]));
      }
    EXPECT_EQ(pairs, expected);
    EXPECT_GT(pairs.size(), 20u);
  }
}

}   // namespace
}   // namespace slender::test
