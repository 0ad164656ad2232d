#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/shell.h"
#include "test/support/shipped_scenes.h"

/// The program itself: exit codes, messages, files, and every scene of the package for a few steps.
namespace {

namespace fs = std::filesystem;

using slender::test::kSceneFolder;
using slender::test::Result;

Result simulate(const std::string& arguments)
{
  return slender::test::shell(std::string(SLENDER_SIMULATE) + " " + arguments);
}

const std::string cantilever = kSceneFolder + "cantilever.yaml";

class Simulate : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_simulate_" + std::to_string(getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string folder_;
};

class Scene : public testing::TestWithParam<std::string>
{};

/// A smaller scene of the same kind, where the whole one takes long.
std::string reduced(const std::string& name) { return name == "hair" ? " --set generate.0.hair.strands=60" : ""; }

TEST_P(Scene, runs)
{
  const Result result = simulate(kSceneFolder + GetParam() + ".yaml --duration 0.05" + reduced(GetParam()));
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_EQ(result.output.find("nan"), std::string::npos) << result.output;
}

INSTANTIATE_TEST_SUITE_P(All, Scene, testing::ValuesIn(slender::test::shippedScenes()));

/// What hangs from a nozzle whose flow stops becomes thinner and thinner, and parts.
TEST_F(Simulate, aThreadWhoseFlowStopsDrainsAndParts)
{
  const Result result =
      simulate(kSceneFolder +
               "honey_robot.yaml --duration 5.5 --set threads.0.nozzle.motion=fixed"
               " --set 'threads.0.nozzle.flow={table: [[0, 6e-7], [4, 6e-7], [4.000001, 0]]}'"
               " --set 'threads.0.floor.belt={x: {table: [[0, 0.03], [2, 0.03], [2.000001, -0.03]]}, y: 0}' --csv " +
               folder_);
  EXPECT_EQ(result.status, 0) << result.output;
  std::ifstream table(folder_ + "/threads.csv");
  std::string line, last;
  while (std::getline(table, line))
    last = line;
  EXPECT_NE(last.find(",honey,1,"), std::string::npos) << last;   // a second piece
}

TEST_F(Simulate, printsASummary)
{
  const Result result = simulate(cantilever + " --duration 0.1");
  EXPECT_EQ(result.status, 0);
  for (const char* word : {"steps             20\n", "simulated         0.1 s", "wall", "real-time factor",
                           "worst residual", "iterations", "cut steps", "moduli            rod beam: stretch "})
    EXPECT_NE(result.output.find(word), std::string::npos) << word << " not in\n" << result.output;
  EXPECT_EQ(simulate(cantilever + " --duration 0.1 --quiet").output, "");
}

TEST_F(Simulate, warnsEvenWhenItIsQuiet)
{
  const Result result = simulate(
      cantilever +
      " --duration 0.01 --quiet --set 'rods.0.cross_section={ellipse: [0.02, 0.01]}' --set 'rods.0.contact={}'");
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_EQ(result.output.rfind("simulate: warning: ", 0), 0u) << result.output;
  EXPECT_NE(result.output.find("half-axes 0.02 m and 0.01 m"), std::string::npos) << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;   // once
}

// A cable that is drawn out to 1.7 times its length within a second.
const std::string drawn =
    " --quiet --set 'rods.0.centerline={straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 20}}'"
    " --set 'rods.0.grasps={a: {edges: [0]}, b: {edges: [-1], attach: initial, motion: {table: [[0, 0, 0, 0, 0, 0, 0, "
    "1], [1, 0.7, 0, 0, 0, 0, 0, 1]]}}}' --duration 1";

TEST_F(Simulate, warnsOfLimitsOnce)
{
  const Result result = simulate(cantilever + drawn);
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_NE(result.output.find("simulate: warning: rod 'beam', edge "), std::string::npos) << result.output;
  EXPECT_NE(result.output.find(" exceeds limits.strain = 0.5 (t = "), std::string::npos) << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  EXPECT_EQ(simulate(cantilever + drawn + " --set 'limits={strain: none}'").output, "");
}

TEST_F(Simulate, tellsTheLargestStrainAndTheLoadsOfGrasps)
{
  std::string loud = drawn;
  loud.erase(loud.find(" --quiet"), 8);
  const std::string output = simulate(cantilever + loud).output;
  EXPECT_NE(output.find("largest strain    0.7"), std::string::npos) << output;
  for (const char* const grasp : {"grasp a: largest force ", "grasp b: largest force "})
    EXPECT_NE(output.find(grasp), std::string::npos) << output;
}

TEST_F(Simulate, notesWhatOnlyANodeMoves)
{
  const std::string moved = cantilever +
                            " --duration 0.02 --set 'rods.0.grasps={a: {edges: [0], motion: {tf: tool0}}, "
                            "b: {edges: [-1], motion: {topic: true}}}'";
  const std::string output = simulate(moved).output;
  EXPECT_NE(output.find("note: these stay in place"), std::string::npos) << output;
  EXPECT_NE(output.find("grasp 'a' (tf: tool0), grasp 'b' (topic)"), std::string::npos) << output;
  EXPECT_EQ(simulate(moved + " --quiet").output, "");
  EXPECT_EQ(simulate(cantilever + " --duration 0.02").output.find("stay in place"), std::string::npos);
}

TEST_F(Simulate, actsOnLimits)
{
  const Result stopped = simulate(cantilever + drawn + " --set limits.on_limit=stop");
  EXPECT_EQ(stopped.status, 3) << stopped.output;
  EXPECT_NE(stopped.output.find("simulate: stopped after step "), std::string::npos) << stopped.output;
  const Result held = simulate(cantilever + drawn + " --set limits.on_limit=hold");
  EXPECT_EQ(held.status, 0) << held.output;
  EXPECT_NE(held.output.find("all driven objects stay in place from now on"), std::string::npos) << held.output;
  const Result released = simulate(cantilever + drawn + " --set limits.on_limit=release");
  EXPECT_EQ(released.status, 0) << released.output;
  EXPECT_NE(released.output.find("' is released (on_limit: release)"), std::string::npos) << released.output;
}

TEST_F(Simulate, saysOfEachGraspWhyItIsReleased)
{
  const std::string output =
      simulate(cantilever + drawn + " --set 'limits={strain: none, force: 1.0e-3, on_limit: release}'").output;
  for (const std::string grasp : {"'a'", "'b'"})
    EXPECT_TRUE(std::regex_search(
        output, std::regex("warning: grasp " + grasp +
                           ": its force [0-9.]+ N exceeds limits.force = 0.001 N .*; grasp " + grasp + " is released")))
        << output;
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 2) << output;
}

TEST_F(Simulate, badInputIsStatus2)
{
  for (const char* arguments : {"", "--nonsense", "/nonexistent.yaml", "a.yaml b.yaml", "--duration"})
  {
    const Result result = simulate(arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    EXPECT_NE(result.output, "") << arguments;
  }
  for (const char* options :
       {"--duration 0", "--duration x", "--duration nan", "--duration 1e8", "--threads 0", "--threads 1.5", "--set",
        "--set time.step", "--set time.step=-1", "--set colour=red", "--csv /proc/nowhere", "--obj /proc/nowhere",
        "--duration 0.1 --bag /proc/nowhere/file.bag", "--csv a --csv b", "--quiet --quiet"})
  {
    const Result result = simulate(cantilever + " " + options);
    EXPECT_EQ(result.status, 2) << options << "\n" << result.output;
  }
}

TEST_F(Simulate, namesFileLineKeyValueAndRange)
{
  const std::string scene = folder_ + "/bad.yaml";
  std::ofstream(scene) << "rods:\n  - name: rope\n    cross_section: {radius: -1}\n";
  const Result result = simulate(scene);
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(
      result.output,
      "simulate: " + scene + ":3: rods.0.cross_section.radius = -1: is out of range; must be a number in (0, 10] m\n");
}

TEST_F(Simulate, refusesBadMeshesByName)
{
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  const std::pair<std::string, const char*> cases[] = {
      {square + "v 2 0 0\nf 1 2 3\nf 1 3 4\nf 1 2 5\n", "face 2 (vertices 0, 1 and 4, from 0) has (nearly) no area"},
      {square + "v 0.5 0.5 1\nf 1 2 3\nf 1 3 4\nf 1 3 5\n",
       "the edge between vertices 0 and 2 (from 0) has 3 faces: 0, 1 and 2"},
      {square + "v 1 1 0\nf 1 2 3\nf 1 5 4\n", "vertices 2 and 4 (from 0) lie at the same place"},
  };
  for (const auto& [obj, expected] : cases)
  {
    std::ofstream(folder_ + "/bad.obj") << obj;
    std::ofstream(folder_ + "/bad.yaml") << "name: bad\ncloths:\n  - mesh: {file: bad.obj}\n";
    const Result result = simulate(folder_ + "/bad.yaml");
    EXPECT_EQ(result.status, 2) << result.output;
    for (const std::string& word :
         {std::string("bad.yaml:3: cloths.0.mesh.file = bad.obj: bad.obj: "), std::string(expected)})
      EXPECT_NE(result.output.find(word), std::string::npos) << word << " not in\n" << result.output;
  }
}

/// A limit on the size of files acts like a full disk.
TEST_F(Simulate, aFullDiskIsStatus3AndNamesWhatIsLeft)
{
  std::vector<std::pair<std::string, std::string>> outputs = {{"--csv", "/csv are cut off"},
                                                              {"--obj", " whole files are before it"}};
  if (SLENDER_HAS_BAG)
    outputs.emplace_back("--bag", ".active (rosbag reindex reads it)");
  for (const auto& [option, says] : outputs)
  {
    const std::string out = folder_ + "/" + option.substr(2), blocks = option == "--obj" ? "1" : "64";
    const Result result =
        slender::test::shell("bash -c \"trap '' XFSZ; ulimit -f " + blocks + "; " SLENDER_SIMULATE " " + cantilever +
                             " --duration 2 --quiet " + option + " " + out + "\"");
    EXPECT_EQ(result.status, 3) << result.output;
    EXPECT_NE(result.output.find(says), std::string::npos) << result.output;
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  }
  EXPECT_TRUE(fs::is_empty(folder_ + "/obj"));   // no half file
}

TEST_F(Simulate, aFailingSimulationIsStatus3)
{
  // Explicit steps far above the stability limit, and no step cutting to save them.
  const Result result = simulate(
      cantilever + " --set time.integrator=symplectic_euler --set time.step=0.05 --set time.newton.max_cuts=0" +
      " --set time.min_step=0.05 --duration 100 --csv " + folder_ + "/csv");
  EXPECT_EQ(result.status, 3) << result.output;
  EXPECT_NE(result.output.find("step "), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("rod 'beam'"), std::string::npos) << result.output;
  EXPECT_TRUE(fs::exists(folder_ + "/csv/nodes.csv"));
}

TEST_F(Simulate, aTenLineSceneRuns)
{
  const std::string scene = folder_ + "/tiny.yaml";
  std::ofstream(scene) << "rods:\n  - grasps: {left: {edges: [0]}}\n";
  EXPECT_EQ(simulate(scene + " --duration 0.1").status, 0);
}

TEST_F(Simulate, writesTables)
{
  const Result result = simulate(
      cantilever + " --duration 0.1 --set record.every=5 --set rods.0.centerline.straight.edges=10 --csv " + folder_);
  ASSERT_EQ(result.status, 0) << result.output;
  std::ifstream nodes(folder_ + "/nodes.csv");
  std::string line;
  ASSERT_TRUE(std::getline(nodes, line));
  EXPECT_EQ(line.find("t [s],object,index,x [m],y [m],z [m],vx [m/s]"), 0u) << line;
  const auto columns = std::count(line.begin(), line.end(), ',');
  int rows = 0;
  while (std::getline(nodes, line))
  {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns);
    ++rows;
  }
  EXPECT_EQ(rows, 5 * 11);   // t = 0, and every fifth of 20 steps; 11 nodes
  EXPECT_EQ(line.find("0.1,beam,10,") == 0 || line.empty(), true) << line;
  std::ifstream grasps(folder_ + "/grasps.csv");
  rows = 0;
  while (std::getline(grasps, line))
    ++rows;
  EXPECT_EQ(rows, 1 + 5);
}

TEST_F(Simulate, writesTablesOfChosenNodes)
{
  const std::string run = cantilever +
                          " --duration 0.1 --set record.every=5 --set record.fields=[curvature]"
                          " --set rods.0.centerline.straight.edges=10 --csv " +
                          folder_;
  ASSERT_EQ(simulate(run + "/all").status, 0);
  const Result result = simulate(run + "/ends --set record.nodes=[0,-1]");
  ASSERT_EQ(result.status, 0) << result.output;
  const auto rows = [&](const std::string& table) {
    std::vector<std::string> lines;
    std::ifstream file(folder_ + table);
    for (std::string line; std::getline(file, line);)
      lines.push_back(line);
    return lines;
  };
  for (const char* table : {"/nodes.csv", "/rod_fields.csv"})
  {
    const std::vector<std::string> all = rows(std::string("/all") + table), ends = rows(std::string("/ends") + table);
    ASSERT_EQ(all.size(), 1u + 5 * 11) << table;
    ASSERT_EQ(ends.size(), 1u + 5 * 2) << table;
    EXPECT_EQ(ends[0], all[0]) << table;
    EXPECT_EQ(ends[3], all[1 + 11]) << table;        // the clamped end at the second instant
    EXPECT_EQ(ends[4], all[1 + 11 + 10]) << table;   // the free end
  }
  EXPECT_EQ(rows("/ends/grasps.csv"), rows("/all/grasps.csv"));
  const Result wrong = simulate(run + "/wrong --set record.nodes=[0,11]");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.output.find("record.nodes.1 = 11: is out of range; must be a whole number in [-11, 10]"),
            std::string::npos)
      << wrong.output;
  EXPECT_FALSE(fs::exists(folder_ + "/wrong"));
}

TEST_F(Simulate, writesATableOfBodies)
{
  const Result result =
      simulate(kSceneFolder + "torsional_pendulum.yaml --duration 0.1 --set record.every=10 --csv " + folder_ +
               " --set \"obstacles=[{name: floor, shape: {plane: {}}, pose: {position: [0, 0, -2]}}]\"");
  ASSERT_EQ(result.status, 0) << result.output;
  std::ifstream file(folder_ + "/bodies.csv");
  std::string header, line;
  ASSERT_TRUE(std::getline(file, header));
  EXPECT_EQ(header.find("t [s],object,x [m],y [m],z [m],qx,qy,qz,qw,vx [m/s]"), 0u) << header;
  std::vector<std::string> lines;
  while (std::getline(file, line))
  {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(header.begin(), header.end(), ','));
    lines.push_back(line);
  }
  ASSERT_EQ(lines.size(), 12u);   // t = 0, and every tenth of 50 steps
  EXPECT_EQ(lines[0], "0,disc,0,0,0,0,0,0,1,0,0,0,0,0,1");
  EXPECT_EQ(lines[1], "0,floor,0,0,-2,0,0,0,1,0,0,0,0,0,0");
  EXPECT_EQ(lines[10].find("0.1,disc,"), 0u) << lines[10];
  simulate(cantilever + " --duration 0.02 --csv " + folder_ + "/none");
  EXPECT_FALSE(fs::exists(folder_ + "/none/bodies.csv"));
}

TEST_F(Simulate, writesObjFiles)
{
  const Result result = simulate(kSceneFolder + "grass.yaml --duration 0.02 --obj " + folder_);
  ASSERT_EQ(result.status, 0) << result.output;
  std::ifstream file(folder_ + "/frame_000002.obj");
  ASSERT_TRUE(file);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("o blade2\nv "), std::string::npos);
  EXPECT_NE(text.str().find("l 63 64 65"), std::string::npos);   // 31 nodes per blade
  EXPECT_FALSE(fs::exists(folder_ + "/frame_000003.obj"));
}

TEST_F(Simulate, runsIntoOneFolderAreNotMixed)
{
  const std::string csv = " --csv " + folder_ + "/csv", obj = " --obj " + folder_ + "/obj";
  ASSERT_EQ(
      simulate(kSceneFolder + "torsional_pendulum.yaml --duration 0.1 --set record.fields=[energy]" + csv + obj).status,
      0);
  EXPECT_TRUE(fs::exists(folder_ + "/csv/bodies.csv"));
  EXPECT_TRUE(fs::exists(folder_ + "/csv/energies.csv"));
  EXPECT_TRUE(fs::exists(folder_ + "/obj/frame_000010.obj"));
  std::ofstream(folder_ + "/obj/notes.txt") << "mine";
  ASSERT_EQ(simulate(cantilever + " --duration 0.02" + csv + obj).status, 0);
  EXPECT_FALSE(fs::exists(folder_ + "/csv/bodies.csv"));
  EXPECT_FALSE(fs::exists(folder_ + "/csv/energies.csv"));
  EXPECT_FALSE(fs::exists(folder_ + "/obj/frame_000010.obj"));
  EXPECT_TRUE(fs::exists(folder_ + "/obj/notes.txt"));
  // what another program wrote under such a name is neither removed nor mixed with ours
  std::ofstream(folder_ + "/obj/frame_000099.obj") << "v 0 0 0\n";
  const Result result = simulate(cantilever + " --duration 0.02" + obj);
  EXPECT_EQ(result.status, 2) << result.output;
  EXPECT_NE(result.output.find("frame_000099.obj: was not written by slender_sim"), std::string::npos) << result.output;
  EXPECT_TRUE(fs::exists(folder_ + "/obj/frame_000000.obj"));
}

TEST_F(Simulate, threadsDoNotChangeTheTables)
{
  const auto table = [&](const std::string& threads) {
    EXPECT_EQ(
        simulate(kSceneFolder + "grass.yaml --duration 0.2 --csv " + folder_ + "/" + threads + " --threads " + threads)
            .status,
        0);
    std::ifstream file(folder_ + "/" + threads + "/nodes.csv");
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  };
  const std::string one = table("1");
  EXPECT_GT(one.size(), 10000u);
  EXPECT_TRUE(one == table("3"));
}

TEST_F(Simulate, bagsNeedRos)
{
  const Result result = simulate(cantilever + " --duration 0.02 --bag " + folder_ + "/out.bag");
  if (SLENDER_HAS_BAG)
  {
    EXPECT_EQ(result.status, 0) << result.output;
    EXPECT_TRUE(fs::exists(folder_ + "/out.bag"));
  }
  else
  {
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.output.find("has no ROS"), std::string::npos) << result.output;
  }
}

}   // namespace
