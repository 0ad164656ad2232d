#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "study/framework/whole_file.h"
#include "test/support/shell.h"

/// The tutorials word by word: their scenes and their `simulate` commands are taken from the text, and what the text
/// says of the results is looked for in them. Their parts with ROS are not run here.
namespace {

namespace fs = std::filesystem;

std::vector<std::string> matches(const std::string& text, const std::string& pattern)
{
  std::vector<std::string> found;
  const std::regex expression(pattern);
  for (std::sregex_iterator match(text.begin(), text.end(), expression), end; match != end; ++match)
    found.push_back((*match)[1]);
  return found;
}

/// Numbers of the rows of a table whose column 2 (index of the node) is `index`.
std::vector<std::vector<double>> rowsOf(const std::string& path, int index)
{
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line))
  {
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');)
      row.push_back(std::strtod(cell.c_str(), nullptr));
    if (row.at(2) == index)
      rows.push_back(row);
  }
  return rows;
}

std::vector<std::array<double, 3>> verticesOf(const std::string& path)
{
  std::ifstream file(path);
  std::vector<std::array<double, 3>> out;
  for (std::string line; std::getline(file, line);)
    if (std::array<double, 3> v; std::sscanf(line.c_str(), "v %lf %lf %lf", &v[0], &v[1], &v[2]) == 3)
      out.push_back(v);
  return out;
}

std::vector<std::string> frames(const std::string& folder)
{
  std::vector<std::string> out;
  for (const auto& entry : fs::directory_iterator(folder))
    out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

class Tutorials : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_tutorials_" + std::to_string(getpid());
    fs::create_directories(folder_);
    text_ = slender::wholeFile(std::string(SLENDER_SOURCE_DIR) + "/docs/tutorials.md");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Writes the scene NAME.yaml of the text and runs the text's `simulate` commands that begin with it. They are
  /// indented, and continued where a line ends with a backslash. Those that record a bag need ROS and are left to
  /// test/nodes/tutorials_test.py.
  void follow(const std::string& name, std::size_t commands)
  {
    const std::vector<std::string> scenes = matches(text_, "`" + name + R"(\.yaml`[^\n]*:\n\n```yaml\n([^`]*)```)");
    ASSERT_EQ(scenes.size(), 1u);
    std::ofstream(folder_ + "/" + name + ".yaml") << scenes[0];
    std::vector<std::string> lines =
        matches(text_, "\n    rosrun slender_sim simulate (" + name + R"(\.yaml[^\n]*(?:\n      [^\n]*)*))");
    lines.erase(std::remove_if(lines.begin(), lines.end(),
                               [](const std::string& line) { return line.find("--bag") != std::string::npos; }),
                lines.end());
    ASSERT_EQ(lines.size(), commands);
    for (const std::string& line : lines)
    {
      const slender::test::Result result =
          slender::test::shell("cd " + folder_ + " && " + SLENDER_SIMULATE + " " + line);
      ASSERT_EQ(result.status, 0) << line << "\n" << result.output;
      output_ = result.output;
    }
  }

  std::string folder_, text_;
  std::string output_;   ///< of the last command
};

TEST_F(Tutorials, theRopeSwingsBelowAGripperThatStandsStill)
{
  follow("rope", 2);
  const auto held = rowsOf(folder_ + "/out/rope/nodes.csv", 0), tip = rowsOf(folder_ + "/out/rope/nodes.csv", 80);
  ASSERT_EQ(held.size(), 801u);
  double lowest = 1.0, left = 1.0;
  for (std::size_t k = 0; k < tip.size(); ++k)
  {
    for (int c = 3; c < 6; ++c)
      EXPECT_EQ(held[k][c], held[0][c]);
    lowest = std::min(lowest, tip[k][5]), left = std::min(left, tip[k][3]);
  }
  EXPECT_LT(lowest, 0.25);   // 0.8 m of rope below a gripper at 1 m, stretched a little
  EXPECT_LT(left, -0.1);     // it swings to the other side
  EXPECT_EQ(rowsOf(folder_ + "/out/loads/rod_fields.csv", 0).size(), 41u);
}

TEST_F(Tutorials, theCableKeepsSlackAndATautOneWarns)
{
  follow("cable", 2);
  const auto held = rowsOf(folder_ + "/out/cable/nodes.csv", 0), next = rowsOf(folder_ + "/out/cable/nodes.csv", 1),
             moved = rowsOf(folder_ + "/out/cable/nodes.csv", 60), taut = rowsOf(folder_ + "/out/taut/nodes.csv", 60);
  ASSERT_EQ(moved.size(), 1201u);
  EXPECT_NEAR(next[0][5], 1.0, 0.003);   // the left end is level, and edges are 20 mm long
  EXPECT_NEAR(moved.front()[3], 0.9, 1e-9);
  EXPECT_NEAR(moved.back()[3], 1.0, 1e-9);
  EXPECT_NEAR(moved.back()[5], 1.2, 1e-9);
  EXPECT_NEAR(taut.back()[3], 1.25, 1e-9);
  for (int c = 3; c < 6; ++c)
    EXPECT_EQ(held.back()[c], held.front()[c]);
  EXPECT_NE(output_.find("exceeds limits.strain = 0.01"), std::string::npos) << output_;
  EXPECT_NE(output_.find("largest strain    0.0417\n"), std::string::npos) << output_;
}

TEST_F(Tutorials, theHoneyCoils)
{
  follow("honey", 1);
  const std::vector<std::string> files = frames(folder_ + "/out/honey");
  ASSERT_EQ(files.size(), 601u);   // a line per instant
  const auto line = verticesOf(files.back());
  double turned = 0.0;
  for (std::size_t k = 2; k < line.size(); ++k)
  {
    const double ax = line[k - 1][0] - line[k - 2][0], ay = line[k - 1][1] - line[k - 2][1],
                 bx = line[k][0] - line[k - 1][0], by = line[k][1] - line[k - 1][1];
    turned += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
  }
  EXPECT_GT(std::abs(turned), 2 * M_PI);
}

TEST_F(Tutorials, theHandkerchiefLiesOnTheBall)
{
  follow("cloth", 1);
  const std::vector<std::string> files = frames(folder_ + "/out/cloth");
  ASSERT_EQ(files.size(), 301u);
  double lowest = 1.0, nearest = 1.0;
  for (const std::string& file : files)
    for (const auto& v : verticesOf(file))
      nearest = std::min(nearest, std::hypot(v[0], v[1], v[2] - 0.8)), lowest = std::min(lowest, v[2]);
  EXPECT_GT(nearest, 0.1);   // never through the ball
  EXPECT_LT(lowest, 0.8);    // its corners hang down
}

TEST_F(Tutorials, theTrackedSheetStaysFlat)
{
  follow("tracked", 1);
  const std::vector<std::string> files = frames(folder_ + "/out/tracked");
  ASSERT_EQ(files.size(), 301u);
  const auto sheet = verticesOf(files.back());
  ASSERT_EQ(sheet.size(), 289u);
  for (const auto& v : sheet)
    EXPECT_NEAR(v[2], 0.2, 1e-9);   // round-off of 300 steps
}

TEST_F(Tutorials, PosesArePublishedWithNewStamps)
{
  const std::vector<std::string> lines = matches(text_, "(rostopic pub -r [^\n]*)");
  ASSERT_FALSE(lines.empty());
  for (const std::string& line : lines)
    EXPECT_NE(line.find(" -s "), std::string::npos) << line;   // else `now` is substituted once only
}

}   // namespace
