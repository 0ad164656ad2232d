#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/study/output.h"
#include "slender_sim/study/study.h"

using namespace slender::study;

namespace {

class QuickStudy : public testing::TestWithParam<const char*>
{};

/// Studies of shapes in contact: their checks hold in the short form too, and there is something to draw.
TEST_P(QuickStudy, checksHold)
{
  const Study* study = findStudy(GetParam());
  ASSERT_NE(study, nullptr);
  StudyContext context(study->name, true, false);
  study->run(context);
  context.finish();
  int checks = 0;
  for (const Row& row : context.rows())
  {
    const Row::Value *measured = row.find("measured"), *expected = row.find("expected"), *bound = row.find("bound");
    if (!measured || !expected || !bound)
      continue;
    ++checks;
    const Row::Value* quantity = row.find("quantity");
    EXPECT_NEAR(std::get<double>(*measured), std::get<double>(*expected), std::get<double>(*bound))
        << (quantity ? std::get<std::string>(*quantity) : "");
  }
  EXPECT_GT(checks, 1);
  ASSERT_FALSE(context.plots().empty());
  for (const Plot& plot : context.plots())
  {
    ASSERT_FALSE(plot.series.empty()) << plot.name;
    EXPECT_GT(plot.series.front().x.size(), 1u) << plot.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, QuickStudy, testing::Values("plectoneme", "chain", "tree", "hair"),
                         [](const auto& info) { return std::string(info.param); });

// Several curves of one series are one colour, but no line joins them.
TEST(StudyPlots, aPointThatIsNoNumberBreaksTheLine)
{
  const std::string folder = testing::TempDir() + "/slender_sim_plots_" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  StudyContext context("plots", true, false);
  Plot& plot = context.plot("broken", "title", "x", "y");
  plot.log_x = plot.log_y = false;
  const double none = std::numeric_limits<double>::quiet_NaN();
  plot.at("two curves").x = {0, 1, none, 2, 3};
  plot.at("two curves").y = {0, 1, none, 2, 3};
  writePlots(folder, context);
  std::ifstream file(folder + "/broken.gp");
  std::ostringstream text;
  text << file.rdbuf();
  std::filesystem::remove_all(folder);
  EXPECT_NE(text.str().find("0 0\n1 1\n\n2 2\n3 3\nEOD"), std::string::npos) << text.str();
}

}   // namespace
