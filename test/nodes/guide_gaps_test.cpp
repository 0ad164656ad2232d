// What a guide's recording lacks. (Not in step_gaps_test.cpp: two headers of the package call different things
// BagReader.)
#include <filesystem>

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <unistd.h>

#include "slender_sim/BodyStates.h"
#include "slender_sim/node/guide_bag.h"

namespace slender {
namespace {

TEST(GuideBag, TellsOfGaps)
{
  for (const bool whole : {true, false})
  {
    const std::string path = testing::TempDir() + "slender_sim_guide_gaps_" + std::to_string(getpid()) + ".bag";
    {
      rosbag::Bag bag(path, rosbag::bagmode::Write);
      for (int k = 0; k < 50; ++k)
      {
        if (!whole && k >= 20 && k < 23)
          continue;
        slender_sim::BodyStates bodies;
        bodies.header.stamp = ros::Time(1.0 + 0.01 * k);
        bodies.header.frame_id = "world";
        bodies.name = {"hand"};
        bodies.pose.resize(1);
        bodies.pose[0].orientation.w = 1.0;
        bag.write("/bodies", bodies.header.stamp, bodies);
      }
    }
    BagSource source;
    source.file = path;
    source.bodies = true;
    const RecordedGuide guide = readGuideBag(source);
    EXPECT_EQ(guide.gaps.empty(), whole) << guide.gaps;
    EXPECT_EQ(guide.gaps.find("the first one 0.04 s after 0.19 s") != std::string::npos, !whole) << guide.gaps;
    std::filesystem::remove(path);
  }
}

}   // namespace
}   // namespace slender
