#include <algorithm>
#include <iterator>

#include <gtest/gtest.h>

#include "slender_sim/contact/broad_phase.h"
#include "slender_sim/contact/ccd.h"
#include "test/support/contact.h"

namespace slender::test {
namespace {

std::vector<GridPairs::Pair> allPairs(const std::vector<BoundingBox>& boxes, const std::vector<int>& sets)
{
  std::vector<GridPairs::Pair> pairs;
  for (int i = 0; i < static_cast<int>(boxes.size()); ++i)
    for (int j = i + 1; j < static_cast<int>(boxes.size()); ++j)
      if (boxes[i].overlaps(boxes[j]) && (sets[i] != sets[j] || sets[i] == GridPairs::kNone))
        pairs.push_back({i, j});
  return pairs;
}

TEST(BroadPhase, FindsThePairsOfBruteForceInOrder)
{
  Random random(1);
  GridPairs grid;
  for (int k = 0; k < 60; ++k)
  {
    const int n = k < 3 ? k : k == 59 ? 6000 : 20 + 10 * k;   // The last one fills several ranges of buckets.
    const double spread = k % 3 == 0 ? 1e3 : 1.0;   // also far from the origin, and with a few huge or flat boxes
    std::vector<BoundingBox> boxes;
    for (int i = 0; i < n; ++i)
    {
      Eigen::Vector3d half = 0.05 * (random.vector().cwiseAbs());
      if (k % 4 == 1 && i % 50 == 0)
        half *= 100.0;
      if (k % 4 == 2)
        half.z() = 0.0;
      const Eigen::Vector3d middle = random.vector() + Eigen::Vector3d(spread, -spread, 0.0);
      boxes.push_back({middle - half, middle + half});
    }
    if (k == 40)
      std::fill(boxes.begin(), boxes.end(), boxes[0]);
    std::vector<int> sets(boxes.size(), GridPairs::kNone);
    for (std::size_t i = 0; i < sets.size() && k % 2 == 1; ++i)
      sets[i] = static_cast<int>(i) / 10 - 1;   // The first ten belong to none.
    const auto expected = allPairs(boxes, sets);
    const auto expectEqual = [k](const std::vector<GridPairs::Pair>& found, const std::vector<GridPairs::Pair>& pairs) {
      ASSERT_EQ(found.size(), pairs.size()) << k;
      for (std::size_t i = 0; i < found.size(); ++i)
        ASSERT_TRUE(found[i].first == pairs[i].first && found[i].second == pairs[i].second) << k;
    };
    std::vector<int> chosen;
    std::vector<GridPairs::Pair> of_chosen;
    const int every = 1 + k % 9;
    for (int i = 0; i < n; i += every)
      chosen.push_back(i);
    std::copy_if(expected.begin(), expected.end(), std::back_inserter(of_chosen),
                 [every](const GridPairs::Pair& p) { return p.first % every == 0 || p.second % every == 0; });
    for (const int threads : {1, 2})
    {
      expectEqual(grid.find(boxes, sets, threads), expected);
      expectEqual(grid.findWith(chosen, boxes, sets, threads), of_chosen);
    }
  }
}

TEST(BroadPhase, SharesAreMeasuredAlongTheCurve)
{
  ContactObject open, ring;
  open.curve_length = ring.curve_length = 1.0;
  ring.closed = true;
  const double reach = 0.5 * M_PI * 0.022;
  const auto share = [](double first, double second, const ContactObject& curve) {
    const auto segment = [](double start) { return ContactSegment{0, 1, 0.01, 0, start, 0.02}; };
    return contactShare(segment(first), segment(second), curve, 0.002);
  };
  EXPECT_EQ(share(0.5, 0.52, open), 0.0);
  EXPECT_NEAR(share(0.52 + 0.25 * reach, 0.5, open), 0.25, 1e-12);
  EXPECT_NEAR(share(0.5, 0.52 + 0.99 * reach, open), 0.99, 1e-12);
  EXPECT_EQ(share(0.5, 0.52 + 1.01 * reach, open), 1.0);
  EXPECT_EQ(share(0.0, 0.98, open), 1.0);
  EXPECT_EQ(share(0.0, 0.98, ring), 0.0);
  EXPECT_NEAR(share(0.0, 0.98 - 0.5 * reach, ring), 0.5, 1e-12);
  EXPECT_EQ(share(0.0, 0.98 - 1.01 * reach, ring), 1.0);
}

/// A bundle that is shaken, sometimes violently, as far as stepLimit() lets it: whatever the history of calls, energy
/// and terms depend on the configuration only, and nothing ever meets.
TEST(BroadPhase, CandidatesKeptFromEarlierCallsChangeNothing)
{
  Random random(2);
  ContactSurface surface;
  Eigen::Matrix3Xd x;
  for (int r = 0; r < 16; ++r)
  {
    Eigen::Matrix3Xd nodes(3, 12);
    for (int i = 0; i < 12; ++i)
      nodes.col(i) = Eigen::Vector3d(0.01 * (r / 4), 0.01 * (r % 4), 0.02 * i);
    addCurve(surface, x, nodes, 1e-3);
  }
  surface.solids.push_back({Sphere{0.03}, -1.0, {}});
  surface.solids.push_back({Box{{0.2, 0.1, 0.1}}, -1.0, {}});
  surface.solids.push_back({Capsule{5e-4, 0.3}, -1.0, {}});
  const auto mesh = std::make_shared<TriangleMesh>();   // a roof
  mesh->vertices.resize(3, 4);
  mesh->vertices << -0.05, 0.05, 0.05, -0.05, 0, 0.01, 0.08, 0.08, 0, 0, 0, 0.02;
  mesh->triangles.resize(3, 2);
  mesh->triangles << 0, 0, 1, 2, 2, 3;
  surface.solids.push_back({mesh, -1.0, {}});
  std::vector<Pose> poses(4);
  poses[3].position = {0, -0.02, -0.02};
  poses[0].position = {-0.05, 0.02, 0.1};
  poses[1].position = {0.0, 0.0, 0.3};
  poses[2].position = {0.015, 0.06, 0.1};
  poses[2].orientation = fromRotationVector({0, 1.5, 0});
  ContactOptions options;
  options.gap = 4e-3;
  ContactPotential kept(surface, options);
  ASSERT_GT(kept.clearance(x, poses), 0.0);
  int compared = 0, limited = 0;
  for (int k = 0; k < 400; ++k)
  {
    const double size = k % 17 == 0 ? 0.5 : k % 7 == 0 ? 0.02 : 1e-3;
    const bool one_curve = k % 3 != 0;   // Then candidates are sought for this curve alone.
    Eigen::Matrix3Xd end = x;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (!one_curve || i / 36 == k % 16)
        end(i) += random.uniform(-size, size);
    std::vector<Pose> poses_end = poses;
    if (!one_curve)
      for (Pose& pose : poses_end)
        pose = moved(pose, random.vector(size), random.vector(k % 5 == 0 ? 1.0 : 0.01));
    const double share = kept.stepLimit(x, end, poses, poses_end);
    ASSERT_EQ(share, ContactPotential(surface, options).stepLimit(x, end, poses, poses_end)) << k;
    ASSERT_GT(share, 0.0) << k;
    limited += share < 1.0;
    x += share * (end - x);
    for (std::size_t s = 0; s < poses.size(); ++s)
      poses[s] = RigidMotion(poses[s], poses_end[s]).at(share);
    ASSERT_GT(kept.clearance(x, poses), 0.0) << k;
    ContactPotential fresh(surface, options);
    const double expected = fresh.evaluate(x, poses, true), found = kept.evaluate(x, poses, true);
    ASSERT_TRUE(std::isfinite(expected));
    ASSERT_EQ(expected, found) << k;
    ASSERT_EQ(fresh.terms().size(), kept.terms().size());
    for (std::size_t i = 0; i < fresh.terms().size(); ++i)
    {
      ASSERT_EQ(fresh.terms()[i].force, kept.terms()[i].force);
      ASSERT_EQ(fresh.terms()[i].point[2], kept.terms()[i].point[2]);
      ASSERT_EQ(fresh.terms()[i].solid, kept.terms()[i].solid);
    }
    compared += !fresh.terms().empty();
    ASSERT_TRUE(kept.clearance(x, poses) >= 0.46 * options.gap || kept.smallestGap() < options.gap);
  }
  EXPECT_GT(compared, 300);
  EXPECT_GT(limited, 20);
  // pushed into each other, both say so
  x.col(20) = 0.5 * (x.col(2) + x.col(3));
  EXPECT_TRUE(std::isinf(kept.evaluate(x, poses, true)));
  EXPECT_TRUE(kept.terms().empty());
  EXPECT_LE(kept.clearance(x, poses), 0.0);
  EXPECT_EQ(kept.stepLimit(x, x, poses, poses), 0.0);
}

}   // namespace
}   // namespace slender::test
