// Parts are divided into islands by joints and by boxes that overlap.
#include <limits>

#include <gtest/gtest.h>

#include "world/island_finder.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

/// A cube of edge length 1 around a place on the x axis.
IslandFinder::Reach at(double x)
{
  return {true, true, true, false, {Vector3d(x - 0.5, -0.5, -0.5), Vector3d(x + 0.5, 0.5, 0.5)}};
}

std::vector<std::vector<int>> islandsOf(IslandFinder& finder)
{
  std::vector<std::vector<int>> islands(static_cast<std::size_t>(finder.find()));
  for (std::size_t k = 0; k < islands.size(); ++k)
    finder.partsOf(static_cast<int>(k), islands[k]);
  return islands;
}

using Islands = std::vector<std::vector<int>>;

TEST(IslandFinder, OverlappingBoxesAndJointsConnect)
{
  IslandFinder finder;
  const std::vector<IslandFinder::Reach> parts = {at(9), at(0), at(4), at(1.05), at(8.2), at(20)};
  finder.begin(6);
  EXPECT_TRUE(finder.joinNear(parts, 0.0));
  EXPECT_EQ(islandsOf(finder), (Islands{{0, 4}, {1}, {2}, {3}, {5}}));
  EXPECT_TRUE(finder.joinNear(parts, 0.03));   // 0.05 apart
  EXPECT_FALSE(finder.joinNear(parts, 0.03));
  EXPECT_EQ(islandsOf(finder), (Islands{{0, 4}, {1, 3}, {2}, {5}}));
  finder.join(5, 1);
  EXPECT_EQ(islandsOf(finder), (Islands{{0, 4}, {1, 3, 5}, {2}}));
}

TEST(IslandFinder, WhatMayNotTouchStaysApart)
{
  IslandFinder finder;
  std::vector<IslandFinder::Reach> parts(5, at(0));
  parts[0].others = false;                                        // touches solids alone
  parts[1].solids = false;                                        // touches curves alone
  parts[3] = parts[4] = {false, false, false, true, at(0).box};   // bodies do not touch each other
  finder.begin(2);
  EXPECT_FALSE(finder.joinNear({parts[0], parts[1]}, 0.0));
  finder.begin(2);
  EXPECT_FALSE(finder.joinNear({parts[3], parts[4]}, 0.0));
  finder.begin(2);
  EXPECT_FALSE(finder.joinNear({parts[1], parts[3]}, 0.0));
  finder.begin(2);
  EXPECT_TRUE(finder.joinNear({parts[0], parts[3]}, 0.0));
  finder.begin(2);
  EXPECT_TRUE(finder.joinNear({parts[1], parts[2]}, 0.0));
}

TEST(IslandFinder, ABoxThatIsNotFiniteOverlapsAll)
{
  IslandFinder finder;
  std::vector<IslandFinder::Reach> parts = {at(0), at(100), at(-100)};
  parts[1].box.high.x() = std::numeric_limits<double>::quiet_NaN();
  finder.begin(3);
  EXPECT_TRUE(finder.joinNear(parts, 0.0));
  EXPECT_EQ(islandsOf(finder), (Islands{{0, 1, 2}}));
}

}   // namespace
}   // namespace slender::test
