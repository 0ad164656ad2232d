#include "slender_sim/node/paused_messages.h"

#include <gtest/gtest.h>

namespace slender {
namespace {

struct Stamped
{
  int source = 0;
  ros::Time stamp{};
  int number = 0;
};

class Paused : public testing::Test
{
protected:
  static constexpr double kTimeout = 1.0, kAhead = 10.0;

  Arrival arrive(double stamp, int source = 0)
  {
    Stamped message{source, ros::Time(stamp), ++number_};
    const Arrival arrival = paused_.arrive(message);
    completed_ = message.stamp;
    return arrival;
  }
  void standStill(double present)
  {
    present_ = ros::Time(present);
    paused_.onPresent([this] { return present_; });
  }
  std::vector<int> release(bool all)
  {
    std::vector<int> numbers;
    for (const Stamped& message : paused_.release(all))
      numbers.push_back(message.number);
    return numbers;
  }

  SimClock clock_{ros::Time(100.0), 0.01};
  PausedMessages<Stamped> paused_{clock_, kTimeout, kAhead};
  ros::Time present_, completed_;
  int number_ = 0;
};

TEST_F(Paused, JudgesByTheSimulatedTimeWhileItPasses)
{
  EXPECT_EQ(arrive(100.0), Arrival::now);
  EXPECT_EQ(arrive(99.5), Arrival::now);
  EXPECT_EQ(arrive(98.0), Arrival::stale);
  EXPECT_EQ(arrive(109.0), Arrival::now);
  EXPECT_EQ(arrive(111.0), Arrival::from_future);
  EXPECT_EQ(arrive(0.0), Arrival::now);
  EXPECT_EQ(completed_, clock_.stamp());
  EXPECT_TRUE(release(true).empty());
}

// While the simulation runs, the present of others is the clock's stamp, which is rounded to nanoseconds.
TEST_F(Paused, TakesRoundedStampsForThePresent)
{
  clock_ = SimClock(ros::Time(100.0), 1.0 / 3.0);
  paused_.onPresent([this] { return clock_.stamp(); });
  for (int k = 0; k < 10; ++k, clock_.tick())
    EXPECT_EQ(arrive(0.0), Arrival::now) << k;
}

TEST_F(Paused, KeepsWhatIsOfThePresent)
{
  standStill(105.0);
  EXPECT_EQ(arrive(105.0), Arrival::now);   // within ~guide_ahead of the simulated time
  standStill(130.0);
  EXPECT_EQ(arrive(130.0), Arrival::kept);
  EXPECT_EQ(arrive(141.0), Arrival::from_future);   // of nobody's present
  standStill(130.5);
  EXPECT_EQ(arrive(130.5), Arrival::kept);
  EXPECT_EQ(release(true), (std::vector<int>{2, 4}));
  EXPECT_TRUE(release(true).empty());
}

TEST_F(Paused, KeepsTheLastSecondAndAtLeastTheLastMessageOfEachSource)
{
  standStill(120.0);
  EXPECT_EQ(arrive(120.0, 1), Arrival::kept);   // a source that speaks once
  for (int k = 1; k <= 100; ++k)
  {
    standStill(120.0 + 0.1 * k);
    EXPECT_EQ(arrive(120.0 + 0.1 * k, 2), Arrival::kept);
  }
  const std::vector<int> kept = release(true);
  EXPECT_EQ(kept.front(), 1);
  EXPECT_EQ(kept.back(), 101);
  EXPECT_GE(kept.size(), 11u);
  EXPECT_LE(kept.size(), 13u);
}

TEST_F(Paused, KeepsTheLastMessageWithoutAStampForTheNextStep)
{
  standStill(101.0);
  EXPECT_EQ(arrive(0.0), Arrival::kept);
  EXPECT_EQ(arrive(0.0), Arrival::kept);
  standStill(130.0);
  EXPECT_EQ(arrive(130.0), Arrival::kept);
  EXPECT_EQ(release(false), std::vector<int>{2});   // ~step: the stamped one is still ahead
  EXPECT_EQ(release(true), std::vector<int>{3});
}

TEST_F(Paused, ForgetsAllAfterAReset)
{
  standStill(130.0);
  arrive(130.0);
  arrive(0.0);
  paused_.clear();
  EXPECT_TRUE(release(true).empty());
}

}   // namespace
}   // namespace slender
