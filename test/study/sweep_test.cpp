#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/sweep_plan.h"
#include "study/thread/belt_pattern.h"

using namespace slender;
using namespace slender::study;
namespace fs = std::filesystem;

namespace {

/// Landing points of a curve that is drawn relative to the belt: (along, across) at time t.
template <class Curve>
BeltTrace traceOf(const Curve& curve, double belt)
{
  std::vector<Landings::Point> points;
  for (int k = 0; k < 2000; ++k)
  {
    const double t = 0.01 * k;
    const auto [along, across] = curve(t);
    // what lies at `along` on the belt was laid down under the nozzle, whose place moves against the belt
    points.push_back({t, belt * t - along, across});
  }
  return classifyBeltTrace(points, belt, 0.01);
}

TEST(BeltPattern, knowsDrawnCurves)
{
  const double belt = 1.0;
  const auto pair = [](double a, double b) { return std::make_pair(a, b); };
  EXPECT_EQ(traceOf([&](double t) { return pair(belt * t, 1e-3 * std::sin(3 * t)); }, belt).pattern, "straight");
  const BeltTrace meander =
      traceOf([&](double t) { return pair(belt * t + 0.05 * std::sin(6 * t), 0.2 * std::sin(3 * t)); }, belt);
  EXPECT_EQ(meander.pattern, "meanders");
  EXPECT_NEAR(meander.frequency_y, 3.0, 0.2);
  EXPECT_NEAR(meander.frequency_x, 6.0, 0.4);
  const BeltTrace coil = traceOf([&](double t) { return pair(belt * t + std::sin(3 * t), std::cos(3 * t)); }, belt);
  EXPECT_EQ(coil.pattern, "translated coiling");
  EXPECT_NEAR(std::abs(coil.windings), 3.0 * 20 / (2 * M_PI), 0.5);
  EXPECT_EQ(classifyBeltTrace({}, belt, 0.01).pattern, "none");
}

class Sweep : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_sweep_" + std::to_string(getpid());
    fs::create_directories(folder_);
    write("scene.yaml",
          "gravity: [0, 0, -9.81]\ntime: {step: 0.002, duration: 0.4}\nrods:\n  - centerline: {straight: {from: [0, 0, "
          "0], to: [1, 0, 0], edges: 30}}\n"
          "    grasps: {left: {edges: [0]}}\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ + "/" + name) << text; }
  std::string read(const std::string& name) const
  {
    std::ostringstream text;
    text << std::ifstream(folder_ + "/" + name).rdbuf();
    return text.str();
  }
  void writePlan(const std::string& axes) const
  {
    write("plan.yaml", "name: test\nscene: scene.yaml\nmeasures: [extents, loads]\naxes:\n" + axes);
  }

  pid_t start(const std::string& out, const std::string& engine = "local") const
  {
    const pid_t pid = fork();
    if (pid == 0)
    {
      setpgid(0, 0);
      freopen("/dev/null", "w", stderr);
      freopen("/dev/null", "w", stdout);
      execl(SLENDER_SWEEP, SLENDER_SWEEP, (folder_ + "/plan.yaml").c_str(), "--out", (folder_ + "/" + out).c_str(),
            "--jobs", "2", "--engine", engine.c_str(), nullptr);
      _exit(127);
    }
    return pid;
  }
  static int wait(pid_t pid)
  {
    int status = 0;
    waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + status;
  }
  long done(const std::string& out) const
  {
    std::error_code error;
    long n = 0;
    for (const auto& entry : fs::directory_iterator(folder_ + "/" + out + "/points", error))
      n += entry.path().extension() == ".csv";
    return n;
  }

  std::string folder_;
};

TEST_F(Sweep, combinesAxesTheLastOneFastest)
{
  writePlan(
      "  time.step: [0.001, 0.002]\n  rods.0.material.youngs_modulus: {from: 1.0e5, to: 1.0e7, count: 3, log: true}\n");
  const SweepPlan plan = readSweepPlan(folder_ + "/plan.yaml");
  ASSERT_EQ(plan.points(), 6);
  EXPECT_EQ(plan.overrides(4), (std::vector<std::string>{"time.step=0.002", "rods.0.material.youngs_modulus=1000000"}));
  EXPECT_DOUBLE_EQ(plan.sceneOf(4).time.step, 0.002);
}

TEST_F(Sweep, refusesValuesThatTheSceneRefuses)
{
  writePlan("  time.step: [0.001, -1]\n");
  EXPECT_THROW(readSweepPlan(folder_ + "/plan.yaml"), SceneError);
  writePlan("  time.stop: [0.001]\n");
  EXPECT_THROW(readSweepPlan(folder_ + "/plan.yaml"), SceneError);
}

TEST_F(Sweep, killedHalfWayAndResumedGivesTheSameTable)
{
  writePlan(
      "  gravity.2: {from: -12, to: -8, count: 5}\n  rods.0.material.youngs_modulus: [1.0e5, 1.0e6, 1.0e7, 1.0e8]\n");
  ASSERT_EQ(wait(start("whole")), 0);
  const pid_t pid = start("killed");
  while (done("killed") < 5)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  kill(-pid, SIGKILL);
  wait(pid);
  EXPECT_LT(done("killed"), 20);
  EXPECT_FALSE(fs::exists(folder_ + "/killed/results.csv"));
  ASSERT_EQ(wait(start("killed")), 0);
  EXPECT_EQ(read("killed/results.csv"), read("whole/results.csv"));
  const std::string table = read("whole/results.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 21);
}

TEST_F(Sweep, givesTheSameTableOnAnotherEngine)
{
  writePlan("  gravity.2: {from: -12, to: -8, count: 5}\n");
  ASSERT_EQ(wait(start("local")), 0);
  ASSERT_EQ(wait(start("parallel", "parallel")), 0);
  EXPECT_EQ(read("parallel/results.csv"), read("local/results.csv"));
  EXPECT_FALSE(fs::exists(folder_ + "/parallel/todo"));
  EXPECT_EQ(wait(start("other", "paralel")), 2);
}

TEST_F(Sweep, namesFailedRunsAndKeepsTheOthers)
{
  // one iteration is not enough
  writePlan("  time.newton: [\"{max_iterations: 50, max_cuts: 3}\", \"{max_iterations: 1, max_cuts: 0}\"]\n");
  ASSERT_EQ(wait(start("out")), 1);
  const std::string table = read("out/results.csv");
  EXPECT_NE(table.find(",done,,"), std::string::npos) << table;
  EXPECT_NE(table.find(",failed,"), std::string::npos) << table;
}

TEST_F(Sweep, doesNotMixPlans)
{
  writePlan("  time.duration: [0.01, 0.02]\n");
  ASSERT_EQ(wait(start("out")), 0);
  writePlan("  time.duration: [0.01, 0.03]\n");
  EXPECT_EQ(wait(start("out")), 2);
}

}   // namespace
