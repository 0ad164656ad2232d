#include <rosbag/bag.h>
#include <std_msgs/String.h>

#include "harness.h"
#include "slender_sim/RodState.h"

/// What users do wrong, and what goes wrong on their disks.
namespace slender {
namespace {

class ExportFaults : public Exports
{
protected:
  /// Nothing is left at or beside --out.
  void expectRefused(const std::string& bag, int status, const std::string& says)
  {
    for (const auto& [program, out] : {std::pair(csv, "tables"), {mesh, "meshes"}, {mesh, "x.glb"}, {video, "x.mp4"}})
    {
      const Result result = shell(program + " " + bag + " --quiet --out " + path(out));
      EXPECT_EQ(result.status, status) << program << "\n" << result.output;
      EXPECT_NE(result.output.find(says), std::string::npos) << program << "\n" << result.output;
      EXPECT_FALSE(fs::exists(path(out)) || fs::exists(path(out) + std::string(".part"))) << program;
    }
  }
};

TEST_F(ExportFaults, bagsThatCannotBeRead)
{
  expectRefused(path("none.bag"), 2, "there is no such file");
  expectRefused(folder_, 2, "is a directory");
  std::ofstream(path("text.bag")) << "no bag\n";
  expectRefused(path("text.bag"), 2, "is no ROS bag");
  std::ofstream(path("empty.bag"));
  expectRefused(path("empty.bag"), 2, "is no ROS bag");
  {
    rosbag::Bag other(path("other.bag"), rosbag::bagmode::Write);
    other.write("/chatter", ros::Time(1), std_msgs::String());
    other.close();
  }
  expectRefused(path("other.bag"), 2, "holds no states of slender_sim; record with");
}

TEST_F(ExportFaults, bagsThatWereNotFinished)
{
  const std::string bag = record("cantilever", "--duration 0.1"), whole = contentsOf(bag);
  std::ofstream(path("cut.bag"), std::ios::binary) << whole.substr(0, whole.size() * 2 / 3);
  expectRefused(path("cut.bag"), 2, "rosbag reindex");
  {
    rosbag::Bag writing(path("live.bag.active"), rosbag::bagmode::Write);
    writing.write("/state", ros::Time(1), slender_sim::RodState());
    expectRefused(path("live.bag"), 2, "is still being written to " + path("live.bag.active"));
    expectRefused(path("live.bag.active"), 2, "rosbag reindex");
    writing.close();
  }
  // bytes changed in the middle
  std::string damaged = whole;
  for (std::size_t k = whole.size() / 3; k < whole.size() / 3 + 3000; ++k)
    damaged[k] = '\xff';
  std::ofstream(path("damaged.bag"), std::ios::binary) << damaged;
  const Result result = shell(csv + " " + path("damaged.bag") + " --quiet --out " + path("tables"));
  EXPECT_EQ(result.status, 2) << result.output;
  EXPECT_NE(result.output.find("damaged"), std::string::npos) << result.output;
  EXPECT_FALSE(fs::exists(path("tables")) || fs::exists(path("tables.part")));
}

TEST_F(ExportFaults, messagesThatDoNotFit)
{
  slender_sim::RodState state;
  state.header.stamp = ros::Time(1);
  state.name = "rope";
  state.nodes.resize(5);
  rosbag::Bag bag(path("odd.bag"), rosbag::bagmode::Write);
  bag.write("/state", ros::Time(1), state);
  bag.close();
  expectRefused(path("odd.bag"), 2, "rod rope has arrays that do not fit each other");
}

TEST_F(ExportFaults, severalNodesInOneBag)
{
  slender_sim::RodState state;
  state.nodes.resize(2);
  state.nodes[1].x = 1;
  state.velocities.resize(2);
  state.twists.resize(2);
  state.frames.resize(1);
  state.frames[0].w = 1;
  state.radii = {0.1};
  rosbag::Bag bag(path("two.bag"), rosbag::bagmode::Write);
  for (const char* topic : {"/left/state", "/right/state"})
    for (int k = 0; k < 3; ++k)
    {
      state.name = topic;
      state.header.stamp = ros::Time(1.0 + 0.001 * k);
      state.step = 4 * k;
      bag.write(topic, ros::Time(2 + k), state);   // as rosbag record: at another time than the stamp
    }
  bag.close();
  expectRefused(path("two.bag"), 2, "holds the states of /left, /right; choose one with --namespace");
  expectExported(csv + " " + path("two.bag") + " --quiet --namespace /right --out " + path("right"));
  const std::string table = contentsOf(path("right/nodes.csv"));
  EXPECT_EQ(table.find("left"), std::string::npos);
  EXPECT_NE(table.find("\n0.002,/right/state,1,1,0,0,0,0,0,0,1,0,0\n"), std::string::npos) << table;
}

TEST_F(ExportFaults, optionsThatMakeNoSense)
{
  const std::string bag = record("cantilever", "--duration 0.1");
  for (const std::string& command :
       {csv, csv + " " + bag, csv + " " + bag + " --out", csv + " a b --out c",
        csv + " " + bag + " --fps 3 --out " + path("x"), mesh + " " + bag + " --format stl --out " + path("x"),
        mesh + " " + bag + " --sides 2 --out " + path("x"), mesh + " " + bag + " --fps 0 --out " + path("x"),
        mesh + " " + bag + " --out " + path("nowhere/x.glb"), video + " " + bag + " --out " + path("x.avi"),
        video + " " + bag + " --size 161x90 --out " + path("x.mp4"),
        video + " " + bag + " --from 0,0,0 --out " + path("x.mp4"), csv + " " + bag + " --out /proc/nowhere"})
  {
    const Result result = shell(command);
    EXPECT_EQ(result.status, 2) << command << "\n" << result.output;
    EXPECT_NE(result.output, "") << command;
  }
  fs::create_directories(path("full"));
  std::ofstream(path("full/mine.txt")) << "precious\n";
  const Result result = shell(csv + " " + bag + " --out " + path("full"));
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.output.find("not an empty folder"), std::string::npos) << result.output;
  EXPECT_EQ(contentsOf(path("full/mine.txt")), "precious\n");
  EXPECT_EQ(shell(csv + " --help").status, 0);
}

/// A limit on the size of files acts like a full disk: writing fails in the middle.
TEST_F(ExportFaults, fullDisksLeaveNothingBehind)
{
  const std::string bag = record("handkerchief", "--duration 0.2");
  for (const auto& [program, out] : {std::pair(csv, "tables"), {mesh, "meshes"}, {mesh, "x.glb"}, {video, "x.mp4"}})
  {
    const Result result =
        shell("bash -c \"trap '' XFSZ; ulimit -f 4; " + program + " " + bag + " --out " + path(out) + "\"");
    EXPECT_EQ(result.status, 3) << program << "\n" << result.output;
    EXPECT_FALSE(fs::exists(path(out)) || fs::exists(path(out) + std::string(".part"))) << program;
  }
}

}   // namespace
}   // namespace slender
