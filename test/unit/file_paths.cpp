#include "slender_sim/scene/file_paths.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

/// What may be overwritten, and read, and what not.
namespace slender {
namespace {

namespace fs = std::filesystem;

class FilePaths : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = fs::canonical(testing::TempDir()) / ("slender_sim_paths_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    ASSERT_EQ(::mkfifo(path("fifo").c_str(), 0600), 0);
    std::ofstream(path("file")) << "old";
    fs::create_directory(path("folder"));
    fs::create_symlink("file", path("link"));
    fs::create_symlink("fifo", path("link_to_fifo"));
    fs::create_symlink("nothing", path("link_to_nothing"));
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// Message of what it throws; empty when nothing.
  template <class Use>
  static std::string refusal(const Use& use)
  {
    try
    {
      use();
      return "";
    }
    catch (const std::runtime_error& error)
    {
      return error.what();
    }
  }

  fs::path folder_;
};

TEST_F(FilePaths, onlyRegularFilesAreReplaced)
{
  EXPECT_EQ(replaceablePath(path("new")), path("new"));
  EXPECT_EQ(replaceablePath("no/such/folder/file"), "no/such/folder/file");
  EXPECT_EQ(replaceablePath(path("file")), path("file"));
  EXPECT_EQ(replaceablePath(path("link")), path("file"));
  for (const auto& [name, says] : {std::pair("fifo", "no regular file"),
                                   {"link_to_fifo", "no regular file"},
                                   {"folder", "is a directory"},
                                   {"link_to_nothing", "leads nowhere"}})
  {
    const std::string file = path(name);
    const std::string text = refusal([&] { replaceablePath(file); });
    EXPECT_EQ(text.find(file + ": "), 0u) << text;
    EXPECT_NE(text.find(says), std::string::npos) << text;
  }
}

TEST_F(FilePaths, savedStatesLeaveOthersAlone)
{
  Simulation simulation(parseScene("rods: [{name: r}]\n"));
  for (const char* name : {"fifo", "link_to_fifo", "link_to_nothing", "folder"})
  {
    const std::string file = path(name);
    const fs::file_status before = fs::symlink_status(file);
    EXPECT_NE(refusal([&] { simulation.save(file); }), "") << name;
    EXPECT_EQ(fs::symlink_status(file).type(), before.type()) << name;
    // does not wait for somebody who writes into the FIFO
    EXPECT_NE(refusal([&] { simulation.load(file); }), "") << name;
  }
  simulation.save(path("link"));
  EXPECT_TRUE(fs::is_symlink(path("link")));
  simulation.load(path("file"));
  simulation.load(path("link"));
}

TEST_F(FilePaths, whatScenesNameIsReadFromRegularFilesOnly)   // others wait for ever, or have no end
{
  ASSERT_EQ(::mkfifo(path("mesh.obj").c_str(), 0600), 0);
  const auto says = [&](const std::string& scene) {
    return refusal([&] { parseScene(scene, "scene", {}, folder_.string()); });
  };
  for (const char* scene :
       {"rods: [{centerline: {file: {path: fifo}}}]\n",
        "rods: [{grasps: {left: {edges: [0], motion: {file: fifo, body: b}}}}]\n",
        "rods: [{name: r}]\nobstacles: [{shape: {mesh: {file: mesh.obj}}}]\n", "cloths: [{mesh: {file: mesh.obj}}]\n",
        "tracked: [{guide: {grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 2}, motion: {frames: \"me*.obj\", rate: 30}}, "
        "test_functions: {basis: subdivision}}]\n"})
  {
    if (fs::exists(path("mesh.obj")) && std::string(scene).find("frames") != std::string::npos)
      fs::rename(path("mesh.obj"), path("me1.obj"));
    EXPECT_NE(says(scene).find("no regular file"), std::string::npos) << scene << says(scene);
  }
}

}   // namespace
}   // namespace slender
