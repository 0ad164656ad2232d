#include "slender_sim/node/step_gaps.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <unistd.h>

#include "slender_sim/RodState.h"
#include "slender_sim/node/bag_reader.h"

namespace slender {
namespace {

TEST(StepGaps, NothingIsMissing)
{
  StepGaps gaps;
  for (std::uint64_t step = 0; step < 200; step += 10)   // ~state_every: 10
    gaps.add(0, step, 0.005 * static_cast<double>(step));
  gaps.add(1, 0, 1.0);   // a reset
  gaps.add(1, 10, 1.05);
  EXPECT_EQ(gaps.text(0.005), "");
  EXPECT_EQ(StepGaps().text(0.0), "");
}

TEST(StepGaps, LostInstants)
{
  StepGaps gaps;
  for (std::uint64_t step = 0; step < 100; ++step)
    if (step != 20 && step != 50 && step != 51)
      gaps.add(0, step, 0.005 * static_cast<double>(step));
  EXPECT_EQ(
      gaps.text(0.005),
      "3 recorded instants are missing in 2 places, first after 0.095 s; a node's own bag (~record_bag) lacks none.");
}

TEST(StepGaps, SkippedTimeIsNoLostInstant)
{
  StepGaps gaps;
  for (std::uint64_t step = 0; step < 100; ++step)
    gaps.add(0, step, 0.005 * static_cast<double>(step) + (step > 40 ? 1.2 : 0.0));
  for (const double step_length : {0.005, 0.0})
    EXPECT_EQ(
        gaps.text(step_length),
        "The stamps skip up to 1.2 s between two steps, after 0.2 s: the node was paused, or fell behind (~max_lag).");
}

TEST(IntervalGaps, OnlyLongOnes)
{
  IntervalGaps steady, jittery, gappy;
  for (int k = 0; k < 100; ++k)
  {
    steady.add(0.01 * k);
    jittery.add(0.01 * k + 0.004 * std::sin(7.0 * k));
    if (k < 30 || k > 40)
      gappy.add(0.01 * k);
  }
  EXPECT_EQ(steady.text(), "");
  EXPECT_EQ(jittery.text(), "");
  EXPECT_EQ(gappy.text(),
            "1 intervals between its messages are longer than 2.5 times the usual 0.01 s, the first one 0.12 s after "
            "0.29 s; the motion "
            "is interpolated over them.");
}

/// A bag of 50 steps of a rod, some of them left out.
std::string writeBag(const std::vector<int>& without)
{
  const std::string path = testing::TempDir() + "slender_sim_gaps_" + std::to_string(getpid()) + ".bag";
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  for (int step = 0; step < 50; ++step)
  {
    if (std::find(without.begin(), without.end(), step) != without.end())
      continue;
    slender_sim::RodState rod;
    rod.header.stamp = ros::Time(1.0 + 0.01 * step);
    rod.step = static_cast<std::uint64_t>(step);
    rod.nodes.resize(2);
    rod.nodes[1].x = 1.0;
    rod.velocities.resize(2);
    rod.frames.resize(1);
    rod.frames[0].w = 1.0;
    rod.twists.resize(2);
    rod.radii = {0.01};
    bag.write("/state", rod.header.stamp, rod);
  }
  bag.close();
  return path;
}

TEST(StepGaps, ReadersOfBagsTell)
{
  for (const bool whole : {true, false})
  {
    const std::string path = writeBag(whole ? std::vector<int>{} : std::vector<int>{20, 21, 22});
    BagReader bag(path);
    SceneSnapshot instant;
    while (bag.next(instant))
      continue;
    EXPECT_EQ(bag.gaps().find("3 recorded instants are missing in 1 places, first after 0.19 s") != std::string::npos,
              !whole)
        << bag.gaps();
    EXPECT_EQ(bag.gaps().empty(), whole) << bag.gaps();
    std::filesystem::remove(path);
  }
}

}   // namespace
}   // namespace slender
