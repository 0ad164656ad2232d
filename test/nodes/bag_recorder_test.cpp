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

  fs::path folder_;
};

TEST_F(BagFile, TakesThePlaceOfAnOlderOneOnly)
{
  std::ofstream(path("older.bag")) << "old";
  fs::create_symlink("older.bag", path("link.bag"));
  record(path("link.bag"));
  EXPECT_TRUE(fs::is_symlink(path("link.bag")));
  EXPECT_EQ(messagesIn(path("older.bag")), 2u);   // scene, state
  EXPECT_FALSE(fs::exists(path("older.bag.active")));
  record(path("older.bag"));
  EXPECT_EQ(messagesIn(path("older.bag")), 2u);
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
