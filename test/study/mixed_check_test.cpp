// The check of the study coupled_safety finds each kind of pair whose contact is switched off.
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "src/study/coupled/mixed_check.h"

namespace slender::study {
namespace {

/// Runs a scene for 0.2 s. Returns the pairs that were wrong.
int wrongPairs(const std::string& text)
{
  Simulation scene(parseScene("time: {step: 0.005, integrator: implicit_euler}\ncontact: {gap: 0.001}\n" + text));
  MixedCheck check(scene);
  int wrong = 0;
  for (int k = 0; k < 40; ++k)
  {
    const StepReport report = scene.step(scene.defaultInputs());
    EXPECT_TRUE(report.ok) << report.message;
    const MixedFindings found = check.check(scene);
    wrong += found.penetrations + found.thickness_violations;
  }
  return wrong;
}

/// The scene is right as it is, and wrong after a replacement that switches off a kind of pair.
void expectFound(std::string text, const std::string& from, const std::string& to)
{
  EXPECT_EQ(wrongPairs(text), 0) << text;
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, from.size(), to);
  EXPECT_GT(wrongPairs(text), 0) << text;
}

const std::string kFloor =
    "obstacles: [{name: floor, shape: {box: {size: [2, 2, 0.1]}}, pose: {position: [0, 0, -0.05]}}]\n";
const std::string kRod =
    "centerline: {straight: {from: [-0.1, 0, 0.02], to: [0.1, 0, 0.02], edges: 8}}, cross_section: {radius: 0.003}, ";

TEST(MixedCheck, FindsRodsInObstacles)
{
  expectFound("rods: [{" + kRod + "contact: {obstacles: true}}]\n" + kFloor, "obstacles: true", "obstacles: false");
}

TEST(MixedCheck, FindsClothInObstacles)
{
  expectFound(
      "cloths: [{grid: {corner: [-0.1, -0.1, 0.02], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: 4}, "
      "contact: {method: barrier, obstacles: true}}]\n" +
          kFloor,
      "obstacles: true", "obstacles: false");
}

TEST(MixedCheck, FindsThreadsInObstacles)
{
  expectFound(
      "threads: [{centerline: {straight: {from: [-0.05, 0, 0.02], to: [0.05, 0, 0.02], edges: 8}}, radius: 0.003, "
      "fluid: {density: 1000, viscosity: 100}, contact: {obstacles: true}}]\n" +
          kFloor,
      "obstacles: true", "obstacles: false");
}

TEST(MixedCheck, FindsBodiesInObstacles)
{
  // without it nothing at all would have contact
  const std::string kFarRod =
      "rods: [{centerline: {straight: {from: [5, 0, 1], to: [5, 0, 2], edges: 4}}, contact: {}}]\n";
  for (const char* shape : {"sphere: {radius: 0.02}", "box: {size: [0.05, 0.04, 0.03]}",
                            "cylinder: {radius: 0.02, length: 0.03}", "capsule: {radius: 0.01, length: 0.03}"})
    expectFound("bodies: [{mass: 0.1, shape: {" + std::string(shape) +
                    "}, pose: {position: [0, 0, 0.05], rpy: [0.3, 0.2, 0]}, contact: true}]\n" + kFloor + kFarRod,
                "contact: true", "contact: false");
}

TEST(MixedCheck, FindsRodsInRods)
{
  expectFound("rods:\n  - {name: falling, " + kRod +
                  "contact: {rods: true}}\n"
                  "  - {name: held, centerline: {straight: {from: [0, -0.1, 0], to: [0, 0.1, 0], edges: 8}}, "
                  "cross_section: {radius: 0.003}, contact: {}, grasps: {a: {edges: [0]}, b: {edges: [-1]}}}\n",
              "rods: true", "rods: false");
}

/// The upper leg of a hairpin falls on the lower one. Both are nearer along the rod than half a turn of its tightest
/// bend.
TEST(MixedCheck, FindsBendsThatClose)
{
  expectFound(
      "rods: [{centerline: {polyline: {points: [[0.05, 0, 0], [0, 0, 0], [0, 0, 0.006], [0.05, 0, 0.006]]}}, "
      "cross_section: {radius: 0.005}, material: {density: 1000, youngs_modulus: 1.0e5, poissons_ratio: 0.4}, "
      "damping: {stiffness: 0.02}, contact: {self: true}, grasps: {a: {edges: [0]}}}]\n",
      "self: true", "self: false");
}

/// A needle passes in one step through two places of a ring, one of which is the segment that closes the ring. The
/// linking integral of the whole curves is the same before and after. Nothing is near anything after the step.
TEST(MixedCheck, FindsANeedleThatPassesThroughARing)
{
  Simulation scene(parseScene(R"(
time: {step: 0.005, integrator: implicit_euler}
gravity: [0, 0, -960]
rods:
  - name: ring
    closed: true
    centerline: {polyline: {points: [[-0.05, 0, 0], [0, 0.05, 0], [0.05, 0, 0], [0.03, -0.05, 0], [-0.03, -0.05, 0]]}}
    cross_section: {radius: 0.002}
    grasps: {held: {edges: [0..3]}}
  - name: needle
    centerline: {straight: {from: [-0.2, -0.025, 0.012], to: [0.2, -0.025, 0.012], edges: 8}}
    cross_section: {radius: 0.002}
)"));
  MixedCheck check(scene);
  EXPECT_TRUE(scene.step(scene.defaultInputs()).ok);
  const MixedFindings found = check.check(scene);
  EXPECT_EQ(found.thickness_violations, 0);
  EXPECT_GT(found.penetrations, 0);
}

}   // namespace
}   // namespace slender::study
