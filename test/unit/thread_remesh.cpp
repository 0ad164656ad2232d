#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/geometry/rotation.h"
#include "slender_sim/thread/thread_remesh.h"
#include "src/thread/thread_guard.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

double twistSum(const ThreadState& s)
{
  double sum = 0.0;
  for (const double m : s.twist)
    sum += m;
  return sum;
}

/// The twist that the frames show at a joint, modulo whole turns.
double shownTwist(const ThreadState& s, int i)
{
  const Vector3d a = s.edge(i - 1).normalized(), b = s.edge(i).normalized();
  return signedAngle(parallelTransport(s.d1[i - 1], a, b), s.d1[i], b);
}

/// Of the edges' spins, over half the density.
double spinMomentum(const ThreadState& s)
{
  double sum = 0.0;
  for (int j = 0; j < s.edges(); ++j)
    sum += s.volume[j] * s.radius(j) * s.radius(j) * s.spin[j];
  return sum;
}

void spinUp(ThreadState& s, Random& random)
{
  for (double& spin : s.spin)
    spin = random.uniform(0.5, 1.5);
}

TEST(ThreadRemesh, SplittingConservesVolumeAndMomentum)
{
  Random random(1);
  for (int j = 0; j < 8; ++j)
  {
    ThreadState s = wigglyThread(9, random);
    const double volume = s.totalVolume();
    spinUp(s, random);
    const Vector3d momentum = momentumOf(s);
    const double spin = spinMomentum(s);
    splitEdge(s, j, 0.4);
    EXPECT_NEAR(spinMomentum(s), spin, 1e-14 * spin);
    EXPECT_EQ(s.nodes(), 10);
    EXPECT_EQ(s.edges(), 9);
    EXPECT_NEAR(s.totalVolume(), volume, 1e-15 * volume * 10);
    EXPECT_LT((momentumOf(s) - momentum).norm(), 1e-14);
    EXPECT_EQ(s.id[j + 1], 9u);
    EXPECT_EQ(s.next_id, 10u);
  }
}

TEST(ThreadRemesh, JoiningConservesVolumeAndMomentum)
{
  Random random(2);
  for (int i = 1; i < 8; ++i)
  {
    ThreadState s = wigglyThread(9, random);
    const double volume = s.totalVolume();
    spinUp(s, random);
    const Vector3d momentum = momentumOf(s);
    const double spin = spinMomentum(s);
    removeNode(s, i);
    EXPECT_NEAR(spinMomentum(s), spin, 1e-14 * spin);
    EXPECT_EQ(s.nodes(), 8);
    EXPECT_NEAR(s.totalVolume(), volume, 1e-15 * volume * 10);
    EXPECT_LT((momentumOf(s) - momentum).norm(), 1e-14);
    EXPECT_EQ(s.twist.front(), 0.0);
    EXPECT_EQ(s.twist.back(), 0.0);
  }
}

TEST(ThreadRemesh, SplitNodesLieOnTheCubicAndRadiiOnTheQuadratic)
{
  // a cubic curve whose chords are so short that arc length and parameter agree to the second order
  const int n = 8;
  double errors[2];
  for (int k = 0; k < 2; ++k)
  {
    const double d = k ? 0.05 : 0.1;
    Eigen::Matrix3Xd x(3, n);
    Eigen::VectorXd radii(n - 1);
    for (int i = 0; i < n; ++i)
      x.col(i) = Vector3d(std::cos(i * d), std::sin(i * d), 0);
    for (int j = 0; j + 1 < n; ++j)
      radii[j] = 0.01 * (1 + (j + 0.5) * d * (j + 0.5) * d);
    ThreadState s = makeThread(x, radii);
    splitEdge(s, 3, 0.5);
    errors[k] = std::abs(s.x[4].norm() - 1.0);
    EXPECT_NEAR(s.radius(3) / s.radius(4), (1 + 3.25 * d * 3.25 * d) / (1 + 3.75 * d * 3.75 * d), 1e-3);
    EXPECT_LT(s.radius(3), s.radius(4));
  }
  EXPECT_LT(errors[0], 1e-5);   // the chord's middle would be 1.2e-3 off
  EXPECT_LT(errors[1], errors[0] / 12);
}

TEST(ThreadRemesh, FramesAndTwistsStayTogether)
{
  Random random(4);
  ThreadState s = wigglyThread(12, random);
  const double sum = twistSum(s);
  // no turn is lost where the curve stays as it is
  Eigen::Matrix3Xd line(3, 6);
  for (int i = 0; i < 6; ++i)
    line.col(i) = Vector3d(i * (1 + 0.1 * i), 0, 0);
  ThreadState straight = makeThread(line, Eigen::VectorXd::Constant(5, 0.1));
  for (int i = 1; i < 5; ++i)
    straight.twist[i] = 2.5 * i;
  const double turns = twistSum(straight);
  for (int j = 0; j < 8; j += 2)
    splitEdge(straight, j, 0.3);
  removeNode(straight, 2);
  removeNode(straight, 5);
  EXPECT_NEAR(twistSum(straight), turns, 1e-12);

  for (int j = 1; j < 12; j += 3)
    splitEdge(s, j, 0.6);
  removeNode(s, 4);
  EXPECT_NEAR(twistSum(s), sum, 1e-12);
  for (int i = 1; i + 1 < s.nodes(); ++i)
    // up to the holonomy of the new corners
    EXPECT_NEAR(std::remainder(shownTwist(s, i) - s.twist[i], 2 * M_PI), 0.0, 0.12) << i;
}

TEST(ThreadRemesh, FoldsAreTakenOut)
{
  Eigen::Matrix3Xd x(3, 6);
  x << 0, 1, 2, 1.4, 1.3, 2.5, 0, 0, 0, 0.1, 1.0, 1.2, 0, 0, 0, 0, 0, 0;
  ThreadState s = makeThread(x, Eigen::VectorXd::Constant(5, 0.1)), on_floor = s, closed = s;
  const double volume = s.totalVolume();
  ASSERT_TRUE(mendFold(s, 2));
  EXPECT_EQ(s.nodes(), 5);
  EXPECT_NEAR(s.totalVolume(), volume, 1e-15);
  EXPECT_GT(s.edge(0).normalized().dot(s.edge(1).normalized()), 0.5);
  // what lies on the floor stays where it is
  on_floor.deposited = {1, 1, 1, 0, 0, 0};
  ASSERT_TRUE(mendFold(on_floor, 2));
  EXPECT_EQ(on_floor.nodes(), 6);
  EXPECT_EQ(on_floor.deposited[3], 1);
  // a free node between two on the floor that have come together is one of them
  on_floor.deposited = {1, 1, 0, 1, 0, 0};
  on_floor.x[3] = on_floor.x[1] + Vector3d(1e-3, 0, 0);
  ASSERT_TRUE(mendFold(on_floor, 2));
  EXPECT_EQ(on_floor.deposited[2], 1);
  // two edges that cover each other do not become one of no length
  closed.x[3] = closed.x[1] + Vector3d(1e-3, 0, 0);
  ASSERT_TRUE(mendFold(closed, 2));
  EXPECT_EQ(closed.nodes(), 5);
  for (int j = 0; j < 4; ++j)
    EXPECT_GT(closed.edge(j).norm(), 0.3);
}

TEST(ThreadRemesh, EndsAndSpreadFluidConserveVolumeAndMomentum)
{
  Random random(6);
  for (int k = 0; k < 10; ++k)
  {
    ThreadState s = wigglyThread(9, random);
    spinUp(s, random);
    const double volume = s.totalVolume(), spin = spinMomentum(s);
    const Vector3d momentum = momentumOf(s);
    if (k < 2)
      removeEnd(s, k);
    else
      spreadFluid(s, k - 2);
    EXPECT_EQ(s.nodes(), k < 2 ? 8 : 9);
    EXPECT_NEAR(s.totalVolume(), volume, 1e-14 * volume);
    EXPECT_LT((momentumOf(s) - momentum).norm(), 1e-14);
    EXPECT_NEAR(spinMomentum(s), spin, 1e-13 * spin);
  }
  // A wide edge gives fluid until it is as wide as its neighbours. They take none from a thin one.
  Eigen::Matrix3Xd x(3, 4);
  x << 0, 1, 1.2, 2.2, 0, 0, 0, 0, 0, 0, 0, 0;
  ThreadState s = makeThread(x, Vector3d(0.1, 0.5, 0.2));
  spreadFluid(s, 1);
  for (int j = 0; j < 3; ++j)
    EXPECT_NEAR(s.radius(j), std::sqrt((0.01 + 0.2 * 0.25 + 0.04) / 2.2), 1e-12);
  ThreadState thin = makeThread(x, Vector3d(0.3, 0.1, 0.2));
  spreadFluid(thin, 1);
  EXPECT_NEAR(thin.radius(1), 0.1, 1e-12);
}

/// A hairpin of two edges that cover each other becomes one edge.
TEST(ThreadRemesh, AHairpinLosesItsEnd)
{
  Eigen::Matrix3Xd x(3, 3);
  x << 0, 1, 0.02, 0, 0, 0.01, 0, 0, 0;
  ThreadState s = makeThread(x, Eigen::Vector2d(0.1, 0.1)), held = s;
  const double volume = s.totalVolume();
  ASSERT_TRUE(mendFold(s, 1));
  ASSERT_EQ(s.nodes(), 2);
  EXPECT_GT(s.edge(0).norm(), 0.9);
  EXPECT_NEAR(s.totalVolume(), volume, 1e-15);
  held.ends[0].held = held.ends[1].held = true;
  EXPECT_FALSE(mendFold(held, 1));
}

/// Where two edges lie on each other, their fluid does not become a disc.
TEST(ThreadRemesh, TheFluidOfAFoldFlowsOn)
{
  Eigen::Matrix3Xd x(3, 7);
  x << 0, 1, 2, 3, 2.15, 3.1, 4.1, 0, 0, 0, 0, 0.02, 0, 0, 0, 0, 0, 0, 0, 0, 0;
  ThreadState s = makeThread(x, Eigen::VectorXd::Constant(6, 0.1));
  ASSERT_TRUE(mendFold(s, 3));
  EXPECT_EQ(s.nodes(), 6);
  for (int j = 0; j < s.edges(); ++j)
    EXPECT_LT(s.radius(j), 0.15) << j;
  for (int i = 1; i + 1 < s.nodes(); ++i)
    EXPECT_GT(s.edge(i - 1).normalized().dot(s.edge(i).normalized()), -0.5) << i;
}

TEST(ThreadRemesh, DroppingCountsTheVolume)
{
  Random random(5);
  ThreadState s = wigglyThread(9, random);
  const double volume = s.totalVolume();
  dropOldest(s, 3, s.dropped_volume);
  EXPECT_EQ(s.nodes(), 6);
  EXPECT_EQ(s.id.front(), 3u);
  EXPECT_NEAR(s.totalVolume() + s.dropped_volume, volume, 1e-15);
  EXPECT_EQ(s.left_volume, 0.0);
  dropOldest(s, 100, s.left_volume);
  EXPECT_GT(s.left_volume, 0.0);
  EXPECT_NEAR(s.totalVolume() + s.dropped_volume + s.left_volume, volume, 1e-15);
  EXPECT_EQ(s.nodes(), 2);
}

/// Lets nothing sweep below a height.
struct Shelf : RemeshGuard
{
  double height;
  explicit Shelf(double h) : height(h) {}
  bool allows(const ThreadState&, int, int, const Eigen::Vector3d& from, const Eigen::Vector3d& to) const override
  {
    return std::min(from.z(), to.z()) > height;
  }
  bool hasRoom(const ThreadState&, const Edge&, const Room&) const override { return has_room; }
  bool has_room = true;
};

TEST(ThreadRemesh, AGuardKeepsNodes)
{
  Eigen::Matrix3Xd x(3, 5);
  for (int i = 0; i < 5; ++i)
    x.col(i) << i, 0, i == 2 ? 1.0 : 0.0;
  ThreadState s = makeThread(x, Eigen::VectorXd::Constant(4, 0.1));
  EXPECT_TRUE(mayRemove(s, 2, nullptr));
  const Shelf high(0.5), low(-0.5);
  EXPECT_FALSE(mayRemove(s, 2, &high));   // it would come down to the line between its neighbours
  EXPECT_TRUE(mayRemove(s, 2, &low));
  ThreadState folded = s;
  folded.x[3] << 1.2, 0, 0;
  folded.x[4] << 1.5, 0, -1.0;
  const int nodes = folded.nodes();
  Shelf full(-0.5);
  full.has_room = false;
  EXPECT_FALSE(mendFold(folded, 2, &high));
  EXPECT_FALSE(mendFold(folded, 2, &full));
  EXPECT_EQ(folded.nodes(), nodes);
  EXPECT_TRUE(mendFold(folded, 2, &low));
  EXPECT_EQ(folded.nodes(), nodes - 1);
}

/// A thread that is bent over the upper edge of a box, and lies on its sides.
TEST(ThreadRemesh, AnEdgeDoesNotCutThroughTheCornerOfASolid)
{
  const double half = 0.5, radius = 0.05;
  Eigen::Matrix3Xd x(3, 5);
  for (int i = 0; i < 5; ++i)   // up, over the corner at (half, 0, half), and on
    x.col(i) << (i < 2 ? half + 2 * radius : half - 0.3 * (i - 2)), 0, (i < 2 ? 0.3 * i : half + 2 * radius);
  const ThreadState s = makeThread(x, Eigen::VectorXd::Constant(4, radius));
  Equations island(false);
  ContactSurface surface;
  surface.solids.push_back({{Box{{2 * half, 2 * half, 2 * half}}, -1.0, "box"}});
  island.solids.emplace_back();
  island.setContact(surface, ContactOptions{0.01});
  ThreadGuard guard(0.01);
  guard.setIsland(&island);
  guard.setStrands({{&s, ContactProperties(), 0.0}});
  const auto placeBox = [&](double at) {
    island.solids[0].start.position.x() = island.solids[0].target.X_WG.position.x() = at;
    island.beginStep(1.0);
    island.beginSubstep(0.0);
  };
  placeBox(0.0);
  EXPECT_FALSE(mayRemove(s, 2, &guard));   // around the corner
  EXPECT_TRUE(mayRemove(s, 3, &guard));    // along the upper side
  placeBox(-1.0);
  EXPECT_TRUE(mayRemove(s, 2, &guard));
}

/// A thread that is folded above a box: the fluid of both edges needs more room than there is.
TEST(ThreadRemesh, AJoinedEdgeNeedsRoomAboveASolid)
{
  Eigen::Matrix3Xd x(3, 5);
  x << -1.0, 0.0, 0.3, 0.05, 1.0, 0, 0, 0.05, 0, 0, 0, 0, 0, 0, 0;
  ThreadState s = makeThread(x, Eigen::VectorXd::Constant(4, 0.05));
  Equations island(false);
  ContactSurface surface;
  surface.solids.push_back({{Box{{4.0, 4.0, 1.0}}, -1.0, "box"}});
  island.solids.emplace_back();
  island.setContact(surface, ContactOptions{0.01});
  ThreadGuard guard(0.01);
  guard.setIsland(&island);
  guard.setStrands({{&s, ContactProperties(), 0.0}});
  const auto placeBelow = [&](double distance) {
    island.solids[0].start.position.z() = island.solids[0].target.X_WG.position.z() = -0.5 - distance;
    island.beginStep(1.0);
    island.beginSubstep(0.0);
  };
  const double joined = 0.05 * std::sqrt((s.edge(1).norm() + s.edge(2).norm()) / 0.05);   // from node 1 to node 3
  placeBelow(0.06);
  EXPECT_FALSE(mayJoin(s, 2, &guard));
  EXPECT_TRUE(guard.hasRoom(s, {1, 2, s.x[1], s.x[3], 0.06}, {1.0, 1.0}));
  EXPECT_FALSE(guard.hasRoom(s, {1, 2, s.x[1], s.x[3], 0.061}, {1.0, 1.0}));
  EXPECT_TRUE(mayJoin(s, 1, &guard));   // of edges in line
  placeBelow(0.99 * kFirmShare * joined);
  EXPECT_FALSE(mayJoin(s, 2, &guard));
  placeBelow(1.01 * kFirmShare * joined);
  EXPECT_TRUE(mayJoin(s, 2, &guard));
}

TEST(ThreadRemesh, ADividedEdgeMayStayStraight)
{
  Random random(8);
  ThreadState s = wigglyThread(9, random), curved = s;
  const Eigen::Vector3d chord = s.x[4] + 0.5 * s.edge(4), point = splitPoint(s, 4, 0.5);
  EXPECT_GT((point - chord).norm(), 1e-3);
  const double volume = s.totalVolume();
  const Eigen::Vector3d momentum = momentumOf(s);
  splitEdge(s, 4, 0.5, chord);
  splitEdge(curved, 4, 0.5);
  EXPECT_EQ(s.x[5], chord);
  EXPECT_EQ(curved.x[5], point);
  EXPECT_NEAR(s.totalVolume(), volume, 1e-14);
  EXPECT_LT((momentumOf(s) - momentum).norm(), 1e-14);
}

}   // namespace
}   // namespace slender::test
