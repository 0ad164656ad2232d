#include "slender_sim/node/bag_recorder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <rosbag/view.h>

#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

namespace fs = std::filesystem;

class BagFile : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = fs::canonical(testing::TempDir()) / ("slender_sim_bags_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  static void record(const std::string& file)
  {
    const Simulation simulation(parseScene("rods: [{name: r}]\n"));
    const auto recorder = makeBagRecorder(file);
    recorder->record(simulation, StepReport());
    recorder->finish();
  }
  static std::size_t messagesIn(const std::string& file)
  {
    rosbag::Bag bag(file);
    return rosbag::View(bag).size();
  }

  static std::string textOf(const std::string& file)
  {
    std::ifstream in(file);
    return std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }

  fs::path folder_;
};

TEST_F(BagFile, TakesThePlaceOfAnOlderOneWhichIsKept)
{
  std::ofstream(path("older.bag")) << "old";
  fs::create_symlink("older.bag", path("link.bag"));
  record(path("link.bag"));
  EXPECT_TRUE(fs::is_symlink(path("link.bag")));
  EXPECT_EQ(messagesIn(path("older.bag")), 2u);   // scene, state
  EXPECT_FALSE(fs::exists(path("older.bag.active")));
  EXPECT_EQ(textOf(path("older.previous.bag")), "old");
  record(path("older.bag"));
  EXPECT_EQ(messagesIn(path("older.bag")), 2u);
  EXPECT_EQ(messagesIn(path("older.previous.bag")), 2u);
}

// What a killed run has left is worth a look, too.
TEST_F(BagFile, KeepsAnUnfinishedOne)
{
  std::ofstream(path("run.bag.active")) << "killed";
  record(path("run.bag"));
  EXPECT_EQ(messagesIn(path("run.bag")), 2u);
  EXPECT_EQ(textOf(path("run.previous.bag.active")), "killed");
}

TEST_F(BagFile, SaysWhatBecomesOfOlderOnes)
{
  const Simulation simulation(parseScene("rods: [{name: r}]\n"));
  EXPECT_TRUE(BagRecorder(path("new.bag"), "/", simulation).notes().empty());
  std::ofstream(path("old.bag")) << "old";
  std::ofstream(path("old.previous.bag")) << "older";
  const BagRecorder recorder(path("old.bag"), "/", simulation);
  ASSERT_EQ(recorder.notes().size(), 1u);
  EXPECT_NE(recorder.notes()[0].find("old.previous.bag, in place of the one that is there"), std::string::npos)
      << recorder.notes()[0];
}

TEST_F(BagFile, IsNotReplacedWhileAGuideOfTheSceneReadsIt)
{
  std::ofstream(path("guide.bag")) << "guide";
  SceneConfig scene = parseScene("rods: [{name: r}]\n");
  scene.guide_bags = {path("guide.bag")};
  const Simulation simulation(std::move(scene));
  EXPECT_THROW(BagRecorder(path("guide.bag"), "/", simulation), std::runtime_error);
  EXPECT_EQ(textOf(path("guide.bag")), "guide");
  EXPECT_NO_THROW(BagRecorder(path("other.bag"), "/", simulation));
}

TEST_F(BagFile, LeavesFifosAndTheirLinksAlone)
{
  ASSERT_EQ(::mkfifo(path("fifo").c_str(), 0600), 0);
  fs::create_symlink("fifo", path("link.bag"));
  fs::create_symlink("fifo", path("other.bag.active"));
  for (const char* name : {"fifo", "link.bag", "other.bag"})
  {
    EXPECT_THROW(record(path(name)), std::runtime_error) << name;
    EXPECT_TRUE(fs::is_fifo(path("fifo"))) << name;
  }
  EXPECT_TRUE(fs::is_symlink(path("link.bag")));
  EXPECT_FALSE(fs::exists(path("fifo.active")));
}

}   // namespace
}   // namespace slender
