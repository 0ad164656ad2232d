// The nodelets, loaded into this program: they come and go, say why they cannot, and hand over messages without copying
// them.
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <new>

#include <geometry_msgs/PoseArray.h>
#include <gtest/gtest.h>
#include <nodelet/loader.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include "slender_sim/ClothState.h"
#include "slender_sim/RodState.h"
#include "slender_sim/ThreadState.h"
#include "slender_sim/node/shared_message.h"

namespace {

std::atomic<std::uint64_t> allocated_by_all{0};   // bytes since the start
thread_local std::uint64_t allocated_here = 0;

}   // namespace

__attribute__((noinline)) void* operator new(std::size_t size)
{
  allocated_by_all += size;
  allocated_here += size;
  if (void* p = std::malloc(size))
    return p;
  throw std::bad_alloc();
}
__attribute__((noinline)) void operator delete(void* p) noexcept { std::free(p); }
__attribute__((noinline)) void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace slender {
namespace {

const char* kRod = R"(
name: long_rope
time: {step: 0.002, duration: 1}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 1000}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6}
    grasps: {left: {edges: [0], motion: fixed}}
)";
const char* kThread = R"(
name: drip
time: {step: 0.001, duration: 1}
threads:
  - {name: honey, centerline: {straight: {to: [0, 0, 0.1], edges: 30}}, radius: 0.002, ends: {oldest: held}}
)";
const char* kCloth = R"(
name: towel
time: {step: 0.01, duration: 1}
cloths:
  - name: towel
    grid: {corner: [0, 0, 1], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: 30}
    material: {area_density: 0.2, thickness: 0.0004, youngs_modulus: 2.0e5}
    solver: {one_newton_step: true}
)";

struct Kind
{
  const char* type;
  std::string scene;
};

class Nodelets : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = std::filesystem::temp_directory_path() / ("slender_sim_nodelets_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "guide.obj") << "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 1 2 3\nf 1 3 4\n";
  }
  void TearDown() override
  {
    loader_.clear();
    std::filesystem::remove_all(folder_);
  }

  std::vector<Kind> kinds() const
  {
    return {{"rod_node", kRod}, {"thread_node", kThread}, {"cloth_node", kCloth}, {"tracking_node", R"(
name: flap
time: {step: 0.01, duration: 1}
tracked:
  - name: flap
    guide: {mesh: {file: )" + (folder_ / "guide.obj").string() + R"(}, motion: {topic: points}}
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}
)"}};
  }

  bool load(const Kind& kind, const std::string& name, const std::string& pace = "wall", const std::string& bag = "")
  {
    ros::NodeHandle nh(name);
    nh.setParam("scene", kind.scene);
    nh.setParam("pace", pace);
    nh.setParam("record_bag", bag);
    // topics beside the private ones, or the nodelets would share theirs
    return loader_.load(name, std::string("slender_sim/") + kind.type,
                        {{ros::names::resolve("state"), name + "/state"},
                         {ros::names::resolve("points"), name + "/points"},
                         {ros::names::resolve("poses"), name + "/poses"},
                         {ros::names::resolve("markers"), name + "/markers"}},
                        {});
  }

  /// Calls what has come until `enough`; false when that takes more than 20 s.
  template <class Enough>
  bool serve(const Enough& enough)
  {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(20);
    while (!enough() && ros::WallTime::now() < end)
      queue_.callAvailable(ros::WallDuration(0.01));
    return enough();
  }

  template <class Message, class Take>
  ros::Subscriber listen(const std::string& topic, const Take& take)
  {
    ros::NodeHandle nh;
    nh.setCallbackQueue(&queue_);
    return nh.subscribe<Message>(topic, 2, boost::function<void(const boost::shared_ptr<const Message>&)>(take));
  }

  /// Neither is anything as large as the message allocated where it arrives, nor - `pooled` - anywhere in this process.
  template <class Message>
  void expectNoCopies(const std::string& topic, bool pooled)
  {
    std::uint64_t count = 0, bytes = 0, start_all = 0, start_here = 0, end_all = 0, end_here = 0;
    constexpr std::uint64_t kWarm = 40, kMessages = 40;
    const ros::Subscriber subscriber = listen<Message>(topic, [&](const boost::shared_ptr<const Message>& message) {
      bytes = ros::serialization::serializationLength(*message);
      ++count;
      if (count == kWarm)
        start_all = allocated_by_all, start_here = allocated_here;
      if (count == kWarm + kMessages)
        end_all = allocated_by_all, end_here = allocated_here;
    });
    ASSERT_TRUE(serve([&] { return count > kWarm + kMessages; })) << topic << ": " << count << " messages";
    const double here = static_cast<double>(end_here - start_here) / kMessages,
                 all = static_cast<double>(end_all - start_all) / kMessages;
    std::cout << topic << ": messages of " << bytes << " bytes, allocated per message where they arrive " << here
              << ", in the whole process " << all << " bytes" << std::endl;
    EXPECT_GT(bytes, 15000u);
    EXPECT_LT(here, 2000.0) << topic;
    if (pooled)
      EXPECT_LT(all, 0.5 * static_cast<double>(bytes)) << topic;
  }

  std::filesystem::path folder_;
  ros::CallbackQueue queue_;
  nodelet::Loader loader_{false};
};

TEST_F(Nodelets, comeAndGo)
{
  int n = 0;
  for (const Kind& kind : kinds())
    for (int round = 0; round < 2; ++round)
    {
      const std::string name = "/visitor" + std::to_string(n++),
                        bag = (folder_ / (std::to_string(n) + ".bag")).string();
      std::uint64_t first = 0, last = 0, count = 0;
      const auto take = [&](const auto& message) {
        first = count++ == 0 ? message->step : first;
        last = message->step;
      };
      const std::string type = kind.type;
      const ros::Subscriber subscriber = type == "rod_node" ? listen<slender_sim::RodState>(name + "/state", take)
                                         : type == "thread_node"
                                             ? listen<slender_sim::ThreadState>(name + "/state", take)
                                             : listen<slender_sim::ClothState>(name + "/state", take);
      ASSERT_TRUE(load(kind, name, "wall", bag)) << type;
      EXPECT_TRUE(serve([&] { return last > 5; })) << type;
      EXPECT_LT(first, 200u);
      EXPECT_TRUE(std::filesystem::exists(bag + ".active"));
      ASSERT_TRUE(loader_.unload(name));
      EXPECT_EQ(subscriber.getNumPublishers(), 0u);
      EXPECT_TRUE(std::filesystem::exists(bag)) << "the bag was not closed";
      EXPECT_FALSE(std::filesystem::exists(bag + ".active"));
      EXPECT_FALSE(ros::service::exists(name + "/pause", false));
    }
}

TEST_F(Nodelets, badScenesLeaveTheManagerAlone)
{
  const Kind good = kinds()[0];
  EXPECT_FALSE(load({"rod_node", "rods: [{material: {density: -3}}]\n"}, "/bad"));
  EXPECT_FALSE(load({"cloth_node", kRod}, "/wrong"));
  EXPECT_FALSE(load({"rod_node", "/no/such/file.yaml"}, "/missing"));
  EXPECT_FALSE(load(good, "/pace", "hasty"));
  EXPECT_FALSE(load(good, "/bag", "wall", "/dev/null/folder/x.bag"));
  EXPECT_TRUE(loader_.listLoadedNodelets().empty());
  EXPECT_TRUE(load(good, "/bad"));   // under the name that failed
  EXPECT_EQ(loader_.listLoadedNodelets().size(), 1u);
}

TEST_F(Nodelets, endAloneWithoutTheManager)
{
  ros::NodeHandle("/short").setParam("stop_after", 0.1);
  ASSERT_TRUE(load(kinds()[0], "/short", "fast"));
  EXPECT_TRUE(serve([] { return !ros::service::exists("/short/pause", false); }));
  EXPECT_TRUE(loader_.unload("/short"));
}

TEST_F(Nodelets, handOverWithoutCopies)
{
  ASSERT_TRUE(load(kinds()[0], "/ropes"));
  expectNoCopies<slender_sim::RodState>("/ropes/state", true);
  expectNoCopies<geometry_msgs::PoseArray>("/ropes/poses", true);
  expectNoCopies<visualization_msgs::MarkerArray>("/ropes/markers", false);
  ASSERT_TRUE(load(kinds()[2], "/cloths"));
  ASSERT_TRUE(loader_.unload("/ropes"));
  expectNoCopies<slender_sim::ClothState>("/cloths/state", true);
  expectNoCopies<sensor_msgs::PointCloud2>("/cloths/points", true);
}

TEST_F(Nodelets, whatIsHeldDoesNotChange)
{
  std::vector<boost::shared_ptr<const slender_sim::RodState>> held;
  std::vector<slender_sim::RodState> copies;
  std::uint64_t last = 0;
  const ros::Subscriber subscriber =
      listen<slender_sim::RodState>("/ropes/state", [&](const boost::shared_ptr<const slender_sim::RodState>& message) {
        last = message->step;
        if (held.size() < 20)
          held.push_back(message), copies.push_back(*message);
      });
  ASSERT_TRUE(load(kinds()[0], "/ropes"));
  ASSERT_TRUE(serve([&] { return held.size() == 20 && last > held.back()->step + 40; }));
  for (std::size_t k = 0; k < held.size(); ++k)
  {
    EXPECT_EQ(held[k]->step, copies[k].step);
    EXPECT_EQ(held[k]->nodes[700].z, copies[k].nodes[700].z);
    if (k > 0)
      EXPECT_NE(held[k].get(), held[k - 1].get());
  }
}

TEST(SharedMessage, isUsedAgainWhenNobodyHoldsIt)
{
  SharedMessage<sensor_msgs::PointCloud2> message;
  const auto* first = &message.renew();
  EXPECT_EQ(&message.renew(), first);
  const boost::shared_ptr<sensor_msgs::PointCloud2> held = message.pointer();
  EXPECT_NE(&message.renew(), first);
  std::vector<boost::shared_ptr<sensor_msgs::PointCloud2>> all;
  for (int k = 0; k < 30; ++k)
  {
    message.renew();
    for (const auto& other : all)
      ASSERT_NE(other, message.pointer());
    all.push_back(message.pointer());
  }
}

}   // namespace
}   // namespace slender

int main(int argc, char** argv)
{
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "nodelet_tests");
  ros::NodeHandle keep;   // roscpp stays up between the tests
  ros::AsyncSpinner spinner(1);
  spinner.start();
  return RUN_ALL_TESTS();
}
