// Every scene of the package, and signals that stop a run.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "study/framework/whole_file.h"
#include "test/support/shell.h"
#include "test/support/shipped_scenes.h"

namespace {

namespace fs = std::filesystem;

using slender::test::kSceneFolder;
using slender::test::Result;

class ShippedScene : public testing::TestWithParam<std::string>
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_repeatability_" + std::to_string(getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string folder_;
};

// Replays promise it. Fresh memory holds other bytes in the second process, and there are more threads.
TEST_P(ShippedScene, isTheSameTwiceToTheBit)
{
  const std::string file = kSceneFolder + GetParam() + ".yaml",
                    reduced = GetParam() == "hair" ? " --set generate.0.hair.strands=60" : "";
  std::ostringstream command;
  command << SLENDER_SIMULATE << " " << file << reduced << " --quiet --duration "
          << 3.0 * slender::readScene(file).time.step << " --state " << folder_ << "/";
  const Result first =
      slender::test::shell("MALLOC_PERTURB_=128 SLENDER_THREADS=1 " + command.str() + "first --threads 1");
  const Result second = slender::test::shell("MALLOC_PERTURB_=1 MALLOC_MMAP_THRESHOLD_=1073741824 SLENDER_THREADS=3 " +
                                             command.str() + "second --threads 3");
  ASSERT_EQ(first.status, 0) << first.output;
  EXPECT_EQ(second.status, 0) << second.output;
  EXPECT_EQ(first.output, second.output);
  const std::string state = slender::wholeFile(folder_ + "/first");
  EXPECT_GT(state.size(), 100u);
  EXPECT_TRUE(state == slender::wholeFile(folder_ + "/second"));
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScene, testing::ValuesIn(slender::test::shippedScenes()));

/// Runs `simulate` with the arguments, sends it the signal when it has recorded something, and returns its exit status,
/// 1000 and more: a signal ended it.
int statusAfter(int signal, const std::vector<std::string>& arguments, const std::string& shows_that_it_runs)
{
  std::vector<const char*> words = {SLENDER_SIMULATE};
  for (const std::string& argument : arguments)
    words.push_back(argument.c_str());
  words.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0)
  {
    execv(words[0], const_cast<char**>(words.data()));
    _exit(127);
  }
  while (!fs::exists(shows_that_it_runs) && kill(pid, 0) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  kill(pid, signal);
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

// Steps of this cloth take seconds. What was reached is saved, and is what a shorter run ends with.
TEST(Signals, endAStepAndSaveWhatWasReached)
{
  const std::string folder = testing::TempDir() + "/slender_sim_signals_" + std::to_string(getpid());
  fs::create_directories(folder);
  const std::string scene = folder + "/sheet.yaml";
  std::ofstream(scene)
      << "name: sheet\ntime: {step: 0.01, duration: 100}\ncloths:\n  - grid: {corner: [0, 0, 0], sides: [[1, 0, 0], "
         "[0, 1, 0]], cells: 100}\n"
         "    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6, poissons_ratio: 0.3}\n"
         "    grasps: {left: {corner: upper_left}}\n";
  for (const int signal : {SIGTERM, SIGINT})
  {
    fs::remove_all(folder + "/csv");
    fs::remove(folder + "/state");
    const int status = statusAfter(signal, {scene, "--quiet", "--csv", folder + "/csv", "--state", folder + "/state"},
                                   folder + "/csv/nodes.csv");
    EXPECT_EQ(status, 128 + signal);
    EXPECT_GT(slender::wholeFile(folder + "/state").size(), 100u);
  }
  fs::remove_all(folder);
}

}   // namespace
