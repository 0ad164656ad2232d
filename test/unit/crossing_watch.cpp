// Objects without contact that others pass through are named.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/scene/crossing_watch.h"
#include "slender_sim/scene/reader.h"

namespace slender::test {
namespace {

/// A ball that falls past x = 0 at 5 m/s, and a line at z = 0 that it meets after 0.05 s.
std::string fallingPast(const std::string& line)
{
  return R"(
time: {step: 0.005, integrator: implicit_euler}
gravity: [0, 0, 0]
bodies:
  - {name: ball, mass: 1, shape: {sphere: {radius: 0.05}}, pose: {position: [0, 0, 0.3]}, velocity: {linear: [0, 0, -5]}}
)" + line;
}

const std::string kStringAcross = R"(
rods:
  - name: string
    centerline: {straight: {from: [-0.5, 0, 0], to: [0.5, 0, 0], edges: 4}}
    cross_section: {radius: 0.002}
)";

std::vector<std::string> crossingsOf(const std::string& scene)
{
  Simulation s(parseScene(scene));
  CrossingWatch watch(s);
  std::vector<std::string> all;
  for (int k = 0; k < 40; ++k)
  {
    EXPECT_TRUE(s.step(s.defaultInputs()).ok);
    for (const std::string& text : watch.check())
      all.push_back(text);
  }
  return all;
}

TEST(CrossingWatch, NamesWhatPassesThrough)
{
  const std::vector<std::string> found = crossingsOf(fallingPast(kStringAcross));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].rfind("rod 'string' has no contact and passes through body 'ball' (t = 0.05", 0), 0u) << found[0];

  const std::string sheet = R"(
cloths:
  - name: sheet
    grid: {corner: [-0.2, -0.2, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: 8}
)";
  EXPECT_EQ(crossingsOf(fallingPast(sheet)).size(), 1u);

  const std::string falling = R"(
time: {step: 0.005, integrator: implicit_euler}
rods:
  - name: held
    centerline: {straight: {from: [-0.5, 0, 0], to: [0.5, 0, 0], edges: 4}}
    grasps: {all: {edges: [0, 1, 2, 3]}}
    contact: {}
  - name: falling
    centerline: {straight: {from: [0, -0.5, 0.03], to: [0, 0.5, 0.03], edges: 4}}
)";
  EXPECT_EQ(crossingsOf(falling).size(), 1u);
}

const std::string kLowered = R"(
time: {step: 0.005, integrator: implicit_euler}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 0.02], to: [0.1, 0, 0.02], edges: 10}}
    cross_section: {radius: 0.002}
    contact: {}
    grasps: {hand: {edges: [0], motion: {table: [[0, 0, 0, 0.02, 0, 0, 0, 1], [0.1, 0, 0, -0.02, 0, 0, 0, 1]]}}}
obstacles:
  - {name: table, shape: {box: {size: [1, 1, 0.2]}}, pose: {position: [0, 0, -0.1]}}
)";

TEST(CrossingWatch, NamesWhatIsHeldInsideOfAnObstacle)
{
  const std::vector<std::string> found = crossingsOf(kLowered);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].rfind("rod 'rope' is held inside obstacle 'table', node 0 at (0, 0, 0", 0), 0u) << found[0];
  EXPECT_NE(found[0].find("(t = 0.0"), std::string::npos) << found[0];
  std::string passing = kLowered;
  passing.replace(passing.find("edges: [0],"), 11, "edges: [0], contact: {ignore: [table]},");
  EXPECT_TRUE(crossingsOf(passing).empty());
}

TEST(CrossingWatch, IsSilentAboutWhatIsMeant)
{
  EXPECT_TRUE(crossingsOf(fallingPast(kStringAcross + "    contact: {}\n")).empty());
  // far away
  std::string beside = kStringAcross;
  beside.replace(beside.find("[-0.5, 0, 0]"), 12, "[-0.5, 0.2, 0]");
  beside.replace(beside.find("[0.5, 0, 0]"), 11, "[0.5, 0.2, 0]");
  EXPECT_TRUE(crossingsOf(fallingPast(beside)).empty());
  // a body that is welded to the rod stands around its end
  const std::string pendulum = R"(
time: {step: 0.005, integrator: implicit_euler}
rods:
  - name: string
    centerline: {straight: {from: [0, 0, 0], to: [0, 0, -0.5], edges: 8}}
    grasps: {top: {edges: [0]}}
bodies:
  - {name: bob, mass: 1, shape: {sphere: {radius: 0.05}}, pose: {position: [0, 0, -0.5]}, welds: [{rod: string, edge: -1}]}
)";
  EXPECT_TRUE(crossingsOf(pendulum).empty());
}

}   // namespace
}   // namespace slender::test
