#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "slender_sim/geometry/number_table.h"

namespace slender::test {
namespace {

TEST(NumberTable, IsLinearBetweenEntriesAndConstantBeyond)
{
  const NumberTable table({{1, 2}, {3, 4}, {4, 0}});
  EXPECT_EQ(table.at(0), 2);
  EXPECT_EQ(table.at(1), 2);
  EXPECT_EQ(table.at(2), 3);
  EXPECT_EQ(table.at(3.5), 2);
  EXPECT_EQ(table.at(9), 0);
}

TEST(NumberTable, TheMeanCountsEveryEntryInTheStep)
{
  const NumberTable table({{1, 2}, {3, 4}, {4, 0}});
  EXPECT_NEAR(table.mean(0, 5), (2 + 6 + 2 + 0) / 5.0, 1e-15);
  EXPECT_NEAR(table.mean(1.5, 2), 2.75, 1e-15);
  // steps of any length add up
  double sum = 0.0;
  for (int k = 0; k < 70; ++k)
    sum += 0.07 * table.mean(0.07 * k, 0.07 * (k + 1));
  EXPECT_NEAR(sum, 4.9 * table.mean(0, 4.9), 1e-13);
}

TEST(NumberTable, BadTablesAreRefused)
{
  EXPECT_THROW(NumberTable({}), std::invalid_argument);
  EXPECT_THROW(NumberTable({{0, 1}, {0, 2}}), std::invalid_argument);
  EXPECT_THROW(NumberTable({{std::nan(""), 1}}), std::invalid_argument);
}

}   // namespace
}   // namespace slender::test
