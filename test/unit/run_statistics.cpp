#include "slender_sim/scene/run_statistics.h"

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

TEST(Summary, NamesTheGraspsWithTheLargestForcesFirst)
{
  RunStatistics statistics;
  statistics.max_force = {1.0, 3.0, 2.0};
  statistics.max_torque = {0.1, 0.3, 0.2};
  EXPECT_EQ(graspLines(statistics, {"a", "b", "c"}),
            (std::vector<std::string>{"grasp b: largest force 3 N, torque 0.3 N m",
                                      "grasp c: largest force 2 N, torque 0.2 N m",
                                      "grasp a: largest force 1 N, torque 0.1 N m"}));
}

TEST(Summary, HasTenLinesOfGraspsAtMost)
{
  RunStatistics statistics;
  std::vector<std::string> names;
  for (int g = 0; g < 1080; ++g)
  {
    names.push_back("g" + std::to_string(g));
    statistics.max_force.push_back(g);
    statistics.max_torque.push_back(1080 - g);
  }
  const std::vector<std::string> lines = graspLines(statistics, names);
  ASSERT_EQ(lines.size(), 10u);
  EXPECT_EQ(lines[0], "grasp g1079: largest force 1079 N, torque 1 N m");
  EXPECT_EQ(lines[9], "the other 1071 grasps: largest force 1070 N, torque 1080 N m");
}

TEST(Summary, SaysThatOneNewtonStepLeavesForces)
{
  const std::string sheet =
      "cloths: [{name: c, grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 2}, solver: {";
  EXPECT_EQ(residualText(parseScene(sheet + "}}]\n"), 0.25), "0.25 of the largest force");
  EXPECT_EQ(residualText(parseScene(sheet + "one_newton_step: true}}]\n"), 1.05)
                .find("1.05 of the largest force (no "
                      "failure: "),
            0u);
}

}   // namespace
}   // namespace slender
