// The one definition of stable.
#include <cmath>

#include <gtest/gtest.h>

#include "study/framework/stability.h"

using namespace slender;
using namespace slender::study;

namespace {

StepReport done(double residual = 0)
{
  StepReport report;
  report.substeps = 1;
  report.residual = residual;
  return report;
}

TEST(Stability, aCellIsDoneCutOrRefused)
{
  StabilityCell cell;
  EXPECT_TRUE(cell.took(done(), true, false));
  EXPECT_EQ(cell.outcome(), Outcome::done);
  StepReport report = done();
  report.cut_steps = 2;
  EXPECT_TRUE(cell.took(report, true, false));
  EXPECT_EQ(cell.outcome(), Outcome::cut);
  EXPECT_EQ(cell.steps, 2);
  report.ok = false;
  report.message = "too stiff";
  EXPECT_FALSE(cell.took(report, true, true));
  EXPECT_EQ(cell.outcome(), Outcome::refused);
  EXPECT_EQ(cell.reason, "too stiff");
}

TEST(Stability, nothingUnsoundPasses)
{
  const auto unsound = [](const auto& spoil) {
    StabilityCell cell;
    spoil(cell);
    return cell.outcome() == Outcome::unsound;
  };
  StepReport refused;
  refused.ok = false;
  EXPECT_TRUE(unsound([&](StabilityCell& c) { c.took(refused, true, true); })) << "no reason";
  refused.message = "reason";
  EXPECT_TRUE(unsound([&](StabilityCell& c) { c.took(refused, true, false); })) << "changed state";
  EXPECT_TRUE(unsound([](StabilityCell& c) { c.took(done(), false, false); })) << "not finite";
  EXPECT_TRUE(unsound([](StabilityCell& c) { c.took(done(1.0), true, false); })) << "unbalanced";
  EXPECT_TRUE(unsound([](StabilityCell& c) { c.took(done(std::nan("")), true, false); }));
  EXPECT_FALSE(unsound([](StabilityCell& c) {
    c.linear_steps = true;
    c.took(done(1.0), true, false);
  }));
  EXPECT_TRUE(unsound([](StabilityCell& c) { c.energyIs(0.2, 0.1); }));
  EXPECT_TRUE(unsound([](StabilityCell& c) { c.energyIs(std::nan(""), 0.1); }));
  EXPECT_FALSE(unsound([](StabilityCell& c) { c.energyIs(-5, 0.1); }));
}

/// Steps of a segment of 1 m to heights, compared with its motion to height 1 m and back in steps of a quarter.
TEST(Stability, whatGoesAnotherWayIsUnsound)
{
  Eigen::Matrix3Xd start = Eigen::Matrix3Xd::Zero(3, 2);
  start(0, 1) = 1.0;
  const auto path = [&](const std::vector<double>& heights) {
    Path p(start);
    for (const double z : heights)
      p.x.push_back(start.colwise() + Eigen::Vector3d(0, 0, z));
    return p;
  };
  const Path fine = path({0.2, 0.5, 0.8, 1.0, 0.8, 0.5, 0.2, 0.0});
  const auto judged = [&](const std::vector<double>& heights) {
    StabilityCell cell;
    cell.compare(path(heights), fine);
    return cell;
  };
  EXPECT_EQ(judged({0.9, 0.1}).outcome(), Outcome::done);
  EXPECT_NEAR(judged({0.9, 0.1}).fine_distance, 0.1 / 1.01, 1e-12);
  EXPECT_EQ(judged({0.0, 0.0}).outcome(), Outcome::unsound) << "stands still, and is where it should be at the end";
  EXPECT_EQ(judged({1.0, 1.0}).outcome(), Outcome::unsound) << "does not come back";
  EXPECT_EQ(judged({1.6, 0.0}).outcome(), Outcome::unsound) << "goes too far";
}

/// A rod that falls is done, one whose scene is nonsense refused.
TEST(Stability, scenesAreJudged)
{
  const char* const rod =
      "rods:\n  - centerline: {straight: {from: [0, 0, 0], to: [1, 0, 0], edges: 10}}\n    cross_section: {radius: "
      "0.01}\n"
      "    material: {density: 1000, youngs_modulus: 1.0e7}\n    grasps: {left: {edges: [0]}}\n";
  const StabilityCell cell = runScene({rod, {}}, 0.01, 5);
  EXPECT_EQ(cell.outcome(), Outcome::done) << cell.complaint << cell.reason;
  EXPECT_EQ(cell.steps, 5);
  EXPECT_GT(cell.fine_distance, 0) << "compared with a finer run, and not equal to it";
  EXPECT_LT(cell.fine_distance, 0.5);
  const StabilityCell nonsense = runScene({std::string(rod) + "    colour: red\n", {}}, 0.01, 5);
  EXPECT_EQ(nonsense.outcome(), Outcome::refused);
  EXPECT_NE(nonsense.reason.find("colour"), std::string::npos) << nonsense.reason;
}

}   // namespace
