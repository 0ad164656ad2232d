// How far parts of a surface may go that move independently of each other (ContactPotential::limitShares).
#include <gtest/gtest.h>

#include <set>

#include "test/support/contact.h"

namespace slender::test {
namespace {

Eigen::Matrix3Xd stick(const Eigen::Vector3d& from, const Eigen::Vector3d& along)
{
  Eigen::Matrix3Xd nodes(3, 4);
  for (int i = 0; i < 4; ++i)
    nodes.col(i) = from + 0.1 * i * along;
  return nodes;
}

/// Sticks, each a mover, that go along straight lines.
struct Sticks
{
  ContactSurface surface;
  Eigen::Matrix3Xd x, x_end;
  MotionShares shares;
  std::vector<std::array<int, 2>> united;
  bool prescribed_moves = false;

  void add(const Eigen::Matrix3Xd& nodes, const Eigen::Vector3d& way)
  {
    const int mover = static_cast<int>(surface.objects.size());
    addCurve(surface, x, nodes, 0.5 * kCurveRadius);
    x_end.conservativeResize(3, x.cols());
    x_end.rightCols(4) = nodes.colwise() + way;
    shares.of_point.insert(shares.of_point.end(), 4, mover);
  }
  /// The first nodes of the last stick are driven.
  void drive(int nodes)
  {
    prescribed_moves = true;
    for (int k = 0; k < 3; ++k)
    {
      ContactSegment& s = surface.segments[surface.segments.size() - 3 + static_cast<std::size_t>(k)];
      s.driven = static_cast<unsigned char>((k < nodes) + 2 * (k + 1 < nodes));
    }
  }
  bool isDriven(int point) const
  {
    for (const ContactSegment& s : surface.segments)
      if ((s.a == point && (s.driven & 1)) || (s.b == point && (s.driven & 2)))
        return true;
    return false;
  }
  ContactPotential limit()
  {
    ContactOptions options;
    options.gap = kContactGap;
    ContactPotential potential(surface, options);
    shares.begin(static_cast<int>(surface.objects.size()), prescribed_moves);
    for (const auto& [a, b] : united)
      shares.unite(a, b);
    potential.limitShares({x, x_end, {}, {}}, shares);
    return potential;
  }
  bool isStopped(int mover) const { return shares.of(mover) < 1.0; }
};

TEST(MotionShares, WhatIsBlockedDoesNotStopWhatIsFree)
{
  Sticks sticks;
  sticks.add(stick({0, 0, 0}, {1, 0, 0}), {0, 0, 0.2});   // towards the next one
  sticks.add(stick({0.1, -0.1, 0.2}, {0, 1, 0}), {0, 0, 0});
  sticks.add(stick({0, 0, 5}, {1, 0, 0}), {0, 0, 1});
  sticks.limit();
  EXPECT_TRUE(sticks.isStopped(0));
  EXPECT_TRUE(sticks.isStopped(1));
  EXPECT_FALSE(sticks.isStopped(2));
  EXPECT_EQ(sticks.shares.of(0), sticks.shares.of(1));
  EXPECT_NEAR(sticks.shares.least(), (0.15 - 0.4 * kContactGap) / 0.2, 0.01);   // nearly all of 0.15 m
}

/// A stick follows another one at its distance. If the first one is blocked, the second one must wait, too.
TEST(MotionShares, WhatFollowsABlockedMoverIsBlocked)
{
  Sticks sticks;
  sticks.add(stick({0, 0, 0}, {1, 0, 0}), {0, 0, 0.2});
  sticks.add(stick({0.1, -0.1, 0.2}, {0, 1, 0}), {0, 0, 0});
  sticks.add(stick({0, 0, -0.1}, {1, 0, 0}), {0, 0, 0.2});
  sticks.add(stick({0, 0, -0.2}, {1, 0, 0}), {0, 0, 0.2});
  sticks.limit();
  for (int mover = 0; mover < 4; ++mover)
    EXPECT_TRUE(sticks.isStopped(mover)) << mover;
}

/// Two sticks block each other. A driven stick, which is far from both, goes all of its way.
TEST(MotionShares, WhatIsPrescribedGoesOnUnlessItIsBlocked)
{
  Sticks sticks;
  sticks.add(stick({0, 0, 0}, {1, 0, 0}), {0, 0, 0.2});
  sticks.add(stick({0.1, -0.1, 0.2}, {0, 1, 0}), {0, 0, 0});
  sticks.add(stick({0, 0, 5}, {1, 0, 0}), {0, 0, 1});
  sticks.drive(2);
  sticks.limit();
  EXPECT_TRUE(sticks.isStopped(0));
  EXPECT_FALSE(sticks.isStopped(MotionShares::kPrescribed));
}

/// A driven stick follows another one that is blocked.
TEST(MotionShares, WhatIsPrescribedWaitsForWhatIsInItsWay)
{
  Sticks sticks;
  sticks.add(stick({0, 0, 0}, {1, 0, 0}), {0, 0, 0.2});
  sticks.add(stick({0.1, -0.1, 0.2}, {0, 1, 0}), {0, 0, 0});
  sticks.add(stick({0, 0, -0.1}, {1, 0, 0}), {0, 0, 0.2});
  sticks.drive(4);
  sticks.limit();
  EXPECT_TRUE(sticks.isStopped(MotionShares::kPrescribed));
}

/// A stick is held at one end, which moves, while the rest of it is blocked. The piece between them turns, so that
/// another stick comes into its way, be it free or blocked. It would meet neither the moved stick nor the blocked one.
TEST(MotionShares, APieceBetweenHeldAndFreeNodesIsExamined)
{
  Sticks held;
  held.add(stick({0, 0, 0}, {1, 0, 0}), {0, 0.2, 0});
  held.drive(1);
  held.add(stick({0.25, 0.08, -0.1}, {0, 0, 1}), {0, 0, 0});   // blocks the free end
  for (const bool blocked : {false, true})
  {
    Sticks sticks = held;
    sticks.limit();
    EXPECT_FALSE(sticks.isStopped(MotionShares::kPrescribed));
    sticks = held;
    if (blocked)
      sticks.add(stick({0.05, 0.113, -0.1}, {0, 0, 1}), {0, 0.2, 0});
    else
      sticks.add(stick({0.05, 0.113, 0.4}, {0, 0, 1}), {0, 0, -0.4});
    if (blocked)
      sticks.united.push_back({0, 2});
    sticks.limit();
    EXPECT_TRUE(sticks.isStopped(MotionShares::kPrescribed)) << blocked;
  }
}

/// Two pairs of sticks have shares of their own, unless something depends on both.
TEST(MotionShares, GroupsHaveTheirOwnShares)
{
  Sticks sticks;
  for (const double z : {0.0, 5.0})
  {
    sticks.add(stick({0, 0, z}, {1, 0, 0}), {0, 0, z == 0.0 ? 0.2 : 0.4});
    sticks.add(stick({0.1, -0.1, z + 0.2}, {0, 1, 0}), {0, 0, 0});
  }
  sticks.limit();
  EXPECT_GT(sticks.shares.of(0), 1.9 * sticks.shares.of(2));
  EXPECT_LT(sticks.shares.of(2), 1.0);
  sticks.united.push_back({1, 3});
  sticks.limit();
  EXPECT_EQ(sticks.shares.of(0), sticks.shares.of(2));
}

/// One stick follows another one at its distance. Both are stopped by others, the follower later, so that it would run
/// into the first one.
TEST(MotionShares, GroupsThatWouldMeetBecomeOne)
{
  Sticks sticks;
  sticks.add(stick({0, 0, 0}, {1, 0, 0}), {0, 0, 0.2});
  sticks.add(stick({0.25, -0.1, 0.12}, {0, 1, 0}), {0, 0, 0});
  sticks.add(stick({-0.2, 0, -0.1}, {1, 0, 0}), {0, 0, 0.2});
  sticks.add(stick({-0.15, -0.1, 0.12}, {0, 1, 0}), {0, 0, 0});
  sticks.limit();
  EXPECT_NEAR(sticks.shares.of(0), (0.07 - 0.4 * kContactGap) / 0.2, 0.01);
  EXPECT_EQ(sticks.shares.of(2), sticks.shares.of(0));
}

/// Heaps of sticks fly about, and some of the sticks are driven. No sticks meet if each goes its share. The least share
/// is the limit of the whole heap.
TEST(MotionShares, NothingMeetsInRandomHeaps)
{
  Random random(11);
  int partly = 0, several = 0, held = 0;
  for (int trial = 0; trial < 200; ++trial)
  {
    Sticks sticks;
    for (int k = 0; k < 12; ++k)
    {
      sticks.add(stick({0.12 * (k / 4), 0.12 * (k % 4), 0}, {0, 0, 1}), random.vector(0.05));
      if (k % 5 == 4)
        sticks.drive(k == 4 ? 2 : 4);
    }
    ContactPotential potential = sticks.limit();
    const double whole = potential.stepLimit(sticks.x, sticks.x_end, {}, {});
    ASSERT_EQ(sticks.shares.least(), whole) << trial;
    std::set<double> different;
    for (int mover = 0; mover < 12; ++mover)
      different.insert(sticks.shares.of(mover));
    partly += different.count(1.0) > 0 && different.size() > 1;
    several += different.size() > 2;
    held += sticks.isStopped(MotionShares::kPrescribed);
    for (int step = 1; step <= 10; ++step)   // places on the way
    {
      Eigen::Matrix3Xd at = sticks.x;
      for (Eigen::Index i = 0; i < at.cols(); ++i)
      {
        const int mover = sticks.isDriven(static_cast<int>(i)) ? MotionShares::kPrescribed : sticks.shares.of_point[i];
        at.col(i) += 0.1 * step * sticks.shares.of(mover) * (sticks.x_end.col(i) - at.col(i));
      }
      ASSERT_GT(potential.clearance(at, {}), 0.0) << trial;
    }
  }
  EXPECT_GT(partly, 50);
  EXPECT_GT(several, 10);
  EXPECT_GT(held, 20);
  EXPECT_LT(held, 180);
}

/// Motions that are not finite stop everything.
TEST(MotionShares, StopAtWhatIsNotFinite)
{
  Sticks sticks;
  sticks.add(stick({0, 0, 0}, {1, 0, 0}), {0, 0, std::nan("")});
  sticks.add(stick({0, 0, 5}, {1, 0, 0}), {0, 0, 0});
  sticks.limit();
  EXPECT_EQ(sticks.shares.least(), 0.0);
  EXPECT_TRUE(sticks.isStopped(1));
}

/// Energies, terms and limits of a large heap have the same bits on one thread and on several.
TEST(MotionShares, ThreadsDoNotChangeContact)
{
  Random random(12);
  ContactSurface surface;
  Eigen::Matrix3Xd x;
  for (int k = 0; k < 400; ++k)
    addCurve(surface, x, stick({0.06 * (k / 20), 0.06 * (k % 20), 0}, {0, 0, 1}), 0.5 * kCurveRadius, 0.3);
  ContactOptions options;
  options.gap = kContactGap;
  ContactPotential one(surface, options), many(surface, options);
  many.setThreads(3);
  Eigen::Matrix3Xd end = x;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    end(i) += random.uniform(-0.005, 0.005);
  for (ContactPotential* potential : {&one, &many})
  {
    potential->setStiffness(1.0);
    potential->begin(x, {}, 1e-3);
  }
  ASSERT_EQ(one.stepLimit(x, end, {}, {}), many.stepLimit(x, end, {}, {}));
  const Eigen::Matrix3Xd at = x + 0.5 * one.stepLimit(x, end, {}, {}) * (end - x);
  ASSERT_EQ(one.evaluate(at, {}, true), many.evaluate(at, {}, true));
  ASSERT_GT(one.terms().size(), 2000u);   // more than one batch, with friction
  ASSERT_EQ(one.terms().size(), many.terms().size());
  ASSERT_EQ(one.smallestGap(), many.smallestGap());
  ASSERT_TRUE(one.barrier(7) == many.barrier(7));
  for (std::size_t i = 0; i < one.terms().size(); ++i)
  {
    ASSERT_EQ(one.terms()[i].force, many.terms()[i].force) << i;
    ASSERT_EQ(one.terms()[i].stiffness, many.terms()[i].stiffness) << i;
    ASSERT_EQ(one.terms()[i].point[3], many.terms()[i].point[3]) << i;
  }
}

}   // namespace
}   // namespace slender::test
