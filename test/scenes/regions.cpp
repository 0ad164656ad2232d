#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "test/support/shell.h"

#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"

/// The program itself: exit codes, messages, files.
namespace {

namespace fs = std::filesystem;

class Regions : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_regions_" + std::to_string(getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  int run(const std::string& arguments)
  {
    const slender::test::Result result =
        slender::test::shell("cd " + folder_ + " && " + SLENDER_REGIONS + " " + arguments);
    output_ = result.output;
    return result.status;
  }
  bool says(const std::string& words) const { return output_.find(words) != std::string::npos; }
  std::string read(const std::string& name) const
  {
    std::ifstream file(folder_ + "/" + name);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::string folder_, output_;
};

TEST_F(Regions, ColoursTheFunctionsOfAScene)
{
  const std::string box = std::string(SLENDER_SOURCE_DIR) + "/config/scenes/box.yaml";
  ASSERT_EQ(run(box + " out.ply"), 0) << output_;
  EXPECT_TRUE(says("test functions    8, over 481 to 601 vertices")) << output_;
  EXPECT_EQ(slender::readMesh(folder_ + "/out.ply").vertices.cols(), 1538);
  EXPECT_NE(read("out.ply").find("property uchar red"), std::string::npos);
  ASSERT_EQ(run(box + " out.obj --guide --quiet"), 0) << output_;
  EXPECT_TRUE(output_.empty());
  EXPECT_EQ(slender::readMesh(folder_ + "/out.obj").vertices.cols(), 8);
}

TEST_F(Regions, ClustersAMeshReproducibly)
{
  slender::writeObj(folder_ + "/ball.obj", slender::icosphere(1.0, 2));
  ASSERT_EQ(run("ball.obj a.ply --count 9 --seed 3"), 0) << output_;
  EXPECT_TRUE(says("test functions    9")) << output_;
  slender::writeObj(folder_ + "/ball_1.obj", slender::icosphere(1.0, 2));
  ASSERT_EQ(run("ball.obj b.ply --count 9 --seed 3 --frames 'ball_*.obj'"), 0) << output_;
  EXPECT_EQ(read("a.ply"), read("b.ply"));
}

TEST_F(Regions, SaysWhatIsWrong)
{
  slender::writeObj(folder_ + "/ball.obj", slender::icosphere(1.0, 0));
  const std::pair<const char*, const char*> cases[] = {
      {"ball.obj", "needs IN and OUT"},
      {"ball.obj a.stl --count 3", ".obj or .ply"},
      {"ball.obj a.ply --count 0", "must be a whole number in [1"},
      {"ball.obj a.ply", "ball.obj: is a mesh; say into how many regions"},
      {"ball.obj a.ply --seed 3", "--count"},
      {"none.obj a.ply --count 3", "none.obj"},
      {"ball.obj a.ply --count 30", "number of faces, 20"},
      {"ball.obj a.ply --count 3 --compactness 2", "[0, 1]"},
      {"ball.obj a.ply --count 3 --frames 'x*.obj'", "no such file"},
      {"ball.obj a.ply --colour", "no such option"},
  };
  for (const auto& [arguments, words] : cases)
  {
    EXPECT_EQ(run(arguments), 2) << arguments;
    EXPECT_TRUE(says(words)) << arguments << "\n" << output_;
  }
  EXPECT_FALSE(fs::exists(folder_ + "/a.ply"));
}

}   // namespace
