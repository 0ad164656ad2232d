#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "test/support/shell.h"

/// What a failed run says: the object, where it is farthest from a solution, and what is near, each figure with its
/// unit.
namespace {

namespace fs = std::filesystem;

using slender::test::Result;

/// Runs the scene, which must fail, and returns what it wrote.
std::string failureOf(const std::string& scene)
{
  const std::string folder = testing::TempDir() + "/slender_sim_failures_" + std::to_string(getpid());
  fs::create_directories(folder);
  std::ofstream(folder + "/scene.yaml") << scene;
  const Result result = slender::test::shell(std::string(SLENDER_SIMULATE) + " " + folder + "/scene.yaml --quiet");
  fs::remove_all(folder);
  EXPECT_EQ(result.status, 3) << result.output;
  return result.output;
}

/// The number that the expression's first group matches; NaN, and reported, where there is none.
double numberIn(const std::string& text, const std::string& expression)
{
  std::smatch found;
  EXPECT_TRUE(std::regex_search(text, found, std::regex(expression))) << expression << "\n" << text;
  return found.size() > 1 ? std::stod(found[1]) : std::nan("");
}

/// Steps that cannot be done: one iteration of Newton's method does not solve anything that moves.
const std::string hopeless =
    "time: {step: 0.01, duration: 1, integrator: implicit_euler, newton: {max_iterations: 1, max_cuts: 0}}\n";
const std::string ball =
    "obstacles:\n  - {name: ball, shape: {sphere: {radius: 0.1}}, pose: {position: [0.5, 0, 0.5]}}\n";

const std::string place = R"(at \(([-0-9.e]+), ([-0-9.e]+), ([-0-9.e]+)\) m)";

struct Place
{
  double x, y, z;
  explicit Place(const std::string& text) : x(numberIn(text, place)), y(0), z(0)
  {
    std::smatch found;
    if (std::regex_search(text, found, std::regex(place)))
    {
      y = std::stod(found[2]);
      z = std::stod(found[3]);
    }
  }
  double from(double x0, double y0, double z0) const { return std::hypot(x - x0, y - y0, z - z0); }
};

// Numbers in messages have three or four digits.
constexpr double rounding = 2e-3;

TEST(Failures, ofARodNameTheNodeTheGraspAndTheObstacle)
{
  const std::string text = failureOf(hopeless + ball + R"(
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 20}}
    cross_section: {radius: 0.01}
    material: {density: 1100, youngs_modulus: 1.0e6}
    contact: {friction: 0.3}
    grasps:
      left: {edges: [0]}
      right: {edges: [-1], motion: {table: [[0, 1, 0, 1, 0, 0, 0, 1], [0.01, 1.3, 0, 1, 0, 0, 0, 1]]}, attach: initial}
)");
  EXPECT_NE(text.find("newton_diverged: rod 'rope'"), std::string::npos) << text;
  const Place at(text);
  EXPECT_GT(numberIn(text, "largest unbalanced force is ([-0-9.e+]+) N, on node"), 0.0);
  const double node = numberIn(text, "on node ([0-9]+), which was at");
  EXPECT_NEAR(at.x, 0.05 * node, rounding);   // as the step began the rope lay straight
  EXPECT_GE(numberIn(text, "largest stretch strain is ([-0-9.e+]+), in edge [0-9]+"), 0.0);
  const bool left = at.x < 0.5;
  EXPECT_NEAR(numberIn(text, std::string("nearest grasp is '") + (left ? "left" : "right") + "', ([-0-9.e+]+) m away"),
              std::min(at.x, 1.0 - at.x), rounding);
  EXPECT_NEAR(numberIn(text, "nearest contact partner is obstacle 'ball', ([-0-9.e+]+) m away"),
              at.from(0.5, 0, 0.5) - 0.1 - 0.01, rounding);
}

// Of several rods that are solved together the message names the one that fails, not the first one.
TEST(Failures, ofSeveralRodsNameTheRightOne)
{
  const auto rod = [](const std::string& name, double y, const std::string& motion) {
    return "  - name: " + name + "\n    centerline: {straight: {from: [0, " + std::to_string(y) + ", 1], to: [1, " +
           std::to_string(y) +
           ", 1], edges: 20}}\n    cross_section: {radius: 0.01}\n    material: {density: 1100, youngs_modulus: "
           "1.0e6}\n    contact: {friction: 0.3}\n"
           "    grasps: {start_of_" +
           name + ": {edges: [0]}, end_of_" + name + ": {edges: [-1]" + motion + "}}\n";
  };
  const std::string fast =
      ", attach: initial, motion: {table: [[0, 1, 0.1, 1, 0, 0, 0, 1], [0.01, 1.3, 0.1, 1, 0, 0, 0, 1]]}";
  const std::string text =
      failureOf(hopeless + "gravity: [0, 0, 0]\nrods:\n" + rod("still", 0.0, "") + rod("pulled", 0.1, fast));
  EXPECT_NE(text.find("rod 'pulled'"), std::string::npos) << text;
  EXPECT_EQ(text.find("overlap"), std::string::npos) << text;   // no grasp is in the way of another
  EXPECT_NE(text.find("nearest grasp is 'end_of_pulled'"), std::string::npos) << text;
  EXPECT_NEAR(numberIn(text, "nearest contact partner is rod 'still', ([-0-9.e+]+) m away"), 0.1 - 0.02, rounding);
}

// A rod that comes back to itself is its own partner, and only then.
TEST(Failures, ofARodThatComesBackNameItsOwnEdge)
{
  const std::string text = failureOf(hopeless + R"(
rods:
  - name: hairpin
    centerline: {polyline: {points: [[0, 0, 1], [0.5, 0, 1], [0.55, 0.05, 1], [0.5, 0.1, 1], [0, 0.1, 1]], edges: 60}}
    cross_section: {radius: 0.005}
    material: {density: 1100, youngs_modulus: 1.0e6}
    contact: {friction: 0.3}
    grasps:
      held: {edges: [0]}
      pulled: {edges: [-1], motion: {table: [[0, 0, 0.1, 1, 0, 0, 0, 1], [0.01, -0.2, 0.1, 1, 0, 0, 0, 1]]}, attach: initial}
)");
  EXPECT_NE(text.find("nearest grasp is 'pulled'"), std::string::npos) << text;
  EXPECT_NEAR(numberIn(text, "nearest contact partner is the rod itself at edge [0-9]+, ([-0-9.e+]+) m away"),
              0.1 - 0.01, rounding);
}

std::string twoGrasps(const std::string& wall, const std::string& gripper, double to, const std::string& contact)
{
  return R"(
time: {step: 0.005, duration: 6}
rods:
  - name: cable
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 40}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e7, poissons_ratio: 0.45}
    damping: {mass: 2}
    )" + contact +
         "\n    grasps:\n      wall: {edges: " + wall + "}\n      gripper: {edges: " + gripper +
         ", attach: initial, motion: {table: [[0, 1, 0, 1, 0, 0, 0, 1], [1, " + std::to_string(to) +
         ", 0, 1, 0, 0, 0, 1]]}}\n";
}

// A gripper that drives the end that it holds into the clamp of the other end.
TEST(Failures, ofGraspsThatMeetNameBoth)
{
  const std::string text = failureOf(twoGrasps("[0]", "[-1]", -0.1, "contact: {self: true}"));
  EXPECT_NE(text.find("squeezed: grasps 'wall' and 'gripper' overlap"), std::string::npos) << text;
  EXPECT_LT(numberIn(text, "come within ([-0-9.e+]+) m of each other"), 0.0085);
  EXPECT_NEAR(numberIn(text, "radii add up to ([-0-9.e+]+) m"), 0.008, 1e-9);
}

// Two grasps side by side, of which one is pushed over the other: the two edges between them have no room.
TEST(Failures, ofGraspsWithoutRoomBetweenThemNameBoth)
{
  const std::string text = failureOf(twoGrasps("[0..9]", "[12, 13]", 0.8, ""));
  EXPECT_NE(text.find("squeezed: grasps 'wall' and 'gripper' overlap"), std::string::npos) << text;
  EXPECT_NEAR(numberIn(text, "with ([-0-9.e+]+) m of the rod between them"), 0.05, 1e-9);
}

TEST(Failures, ofExplicitStepsNameTheFastestNode)
{
  const std::string text = failureOf(R"(
time: {step: 0.01, duration: 10, integrator: symplectic_euler}
rods:
  - name: wire
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 40}}
    cross_section: {radius: 0.002}
    material: {density: 1100, youngs_modulus: 1.0e9}
    grasps: {left: {edges: [0]}}
)");
  EXPECT_NE(text.find("rod 'wire'"), std::string::npos) << text;
  EXPECT_GT(numberIn(text, "is the fastest, with ([-0-9.e+]+) m/s"), 0.01);
  numberIn(text, "nearest grasp is 'left', ([-0-9.e+]+) m away");
}

TEST(Failures, ofAClothNameTheVertexTheGraspAndTheObstacle)
{
  const std::string text = failureOf(hopeless + ball + R"(
cloths:
  - name: sheet
    grid: {corner: [0, 0, 1], sides: [[1, 0, 0], [0, 1, 0]], cells: 10}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6, poissons_ratio: 0.3}
    contact: {thickness: 0.002}
    grasps: {corner: {corner: upper_left}}
)");
  EXPECT_NE(text.find("cloth 'sheet'"), std::string::npos) << text;
  const Place at(text);
  EXPECT_GT(numberIn(text, "largest unbalanced force is ([-0-9.e+]+) N, on vertex [0-9]+"), 0.0);
  EXPECT_NEAR(numberIn(text, "nearest grasp is 'corner', ([-0-9.e+]+) m away"), at.from(0, 1, 1), rounding);
  EXPECT_NEAR(numberIn(text, "nearest contact partner is obstacle 'ball', ([-0-9.e+]+) m away"),
              at.from(0.5, 0, 0.5) - 0.1, rounding);
}

/// Two fingers that close on what stands between them, from and to these distances [m] of their middles.
std::string fingers(double from, double to)
{
  const auto finger = [&](const std::string& name, const std::string& sign) {
    return "  - {name: " + name + ", shape: {box: {size: [0.02, 0.06, 0.03]}}, friction: 1, motion: {table: [[0, " +
           sign + std::to_string(0.5 * from) + ", 0, 0.06], [0.1, " + sign + std::to_string(0.5 * to) +
           ", 0, 0.06]]}}\n";
  };
  return "time: {step: 0.005, duration: 0.2}\nobstacles:\n" + finger("left", "-") + finger("right", "");
}

TEST(Failures, ofWhatIsSqueezedNameTheTwoThatSqueeze)
{
  const std::string cube = failureOf(fingers(0.051, 0.0496) + R"(
bodies: [{name: cube, mass: 0.05, gravity: false, shape: {box: {size: [0.03, 0.03, 0.1]}}, pose: {position: [0, 0, 0.06]}}]
)");
  EXPECT_NE(cube.find("squeezed: obstacle 'left' and obstacle 'right' leave body 'cube' too little room"),
            std::string::npos)
      << cube;
  EXPECT_NEAR(numberIn(cube, "it needs more than ([0-9.]+) mm between them"), 30, 0.3);
  EXPECT_LT(numberIn(cube, "they are to be ([0-9.]+) mm apart at the end of the step"), 30.0);
  const std::string sheet = failureOf(fingers(0.024, 0.0214) + R"(
gravity: [0, 0, 0]
cloths:
  - name: sheet
    grid: {corner: [0, -0.08, 0.02], sides: [[0, 0.16, 0], [0, 0, 0.08]], cells: [12, 6], pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6}
    contact: {thickness: 0.002, method: barrier}
)");
  EXPECT_NE(sheet.find("squeezed: obstacle 'left' and obstacle 'right' leave cloth 'sheet' too little room"),
            std::string::npos)
      << sheet;
  EXPECT_NEAR(numberIn(sheet, "it needs more than ([0-9.]+) mm between them"), 2, 0.1);
  EXPECT_EQ(sheet.find("pins"), std::string::npos) << sheet;
}

TEST(Failures, ofAThreadNameTheNodeAndTheNozzle)
{
  const std::string text = failureOf(R"(
time: {step: 0.01, duration: 1, newton: {max_iterations: 1, max_cuts: 0}}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 10, surface_tension: 0.08}
    nozzle: {position: [0, 0, 0.1], diameter: 0.004, flow: 2.0e-7}
    floor: {height: 0}
)");
  EXPECT_NE(text.find("thread 'honey'"), std::string::npos) << text;
  EXPECT_GT(numberIn(text, "largest unbalanced force is ([-0-9.e+]+) N, on node [0-9]+ of [0-9]+"), 0.0);
  EXPECT_NEAR(numberIn(text, "nearest grasp is the nozzle, ([-0-9.e+]+) m away"), Place(text).from(0, 0, 0.1),
              rounding);
  EXPECT_GT(numberIn(text, "nearest contact partner is the floor, ([-0-9.e+]+) m away"), 0.05);
}

TEST(Failures, summariesHaveUnits)
{
  const Result result = slender::test::shell(std::string(SLENDER_SIMULATE) + " " + SLENDER_SOURCE_DIR +
                                             "/config/scenes/cantilever.yaml --duration 0.05");
  ASSERT_EQ(result.status, 0) << result.output;
  for (const char* line :
       {R"(simulated +[-0-9.e+]+ s\n)", R"(wall +[-0-9.e+]+ s\n)",
        R"(real-time factor +[-0-9.e+]+ \(simulated over wall time\)\n)",
        R"(worst residual +[-0-9.e+]+ of the largest force\n)", R"(moduli .* N, bend .* N m\^2, twist .* N m\^2)"})
    EXPECT_TRUE(std::regex_search(result.output, std::regex(line))) << line << "\n" << result.output;
}

}   // namespace
