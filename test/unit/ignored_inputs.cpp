// What a scene says and does not get is warned of.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {
namespace {

const std::string rod = R"(
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1, 0, 1], edges: 10}}
    cross_section: {radius: 0.005}
    material: {density: 1100, youngs_modulus: 1.0e7}
)";
const std::string sheet = R"(
cloths:
  - name: sheet
    grid: {corner: [0, 0, 0], sides: [[0.3, 0, 0], [0, 0.3, 0]], cells: 2}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e5}
)";

/// The warnings that have all of these words.
int count(const std::vector<std::string>& warnings, const std::vector<std::string>& words)
{
  int found = 0;
  for (const std::string& warning : warnings)
  {
    bool all = true;
    for (const std::string& word : words)
    {
      all = all && warning.find(word) != std::string::npos;
    }
    found += all;
  }
  return found;
}

std::vector<std::string> warningsOf(const std::string& scene) { return parseScene(scene, "test.yaml").warnings; }

TEST(IgnoredInputs, aBodyThatTheSceneDoesNotHaveIsWarnedOf)
{
  const std::string grasps = "    grasps: {end: {edges: [0], motion: {body: hnad}}}\n", hand = "bodies:\n  - {name: hand, motion: fixed}\n";
  EXPECT_EQ(count(warningsOf(rod + grasps), {"rods.0.grasps.end.motion", "no body or obstacle"}), 1);
  EXPECT_EQ(count(warningsOf(rod + grasps + hand), {"did you mean hand?"}), 1);
  EXPECT_EQ(count(warningsOf(rod + "    grasps: {end: {edges: [0], motion: {body: hand}}}\n" + hand), {"no body"}), 0);
}

TEST(IgnoredInputs, aClothThatChangesTheDefaultIntegratorIsWarnedOf)
{
  EXPECT_EQ(count(warningsOf(rod + sheet), {"time.integrator", "implicit_euler", "tr_bdf2"}), 1);
  EXPECT_EQ(count(warningsOf("time: {integrator: tr_bdf2}\n" + rod + sheet), {"time.integrator"}), 0);
  EXPECT_EQ(count(warningsOf(sheet), {"time.integrator"}), 0);
}

std::string tracked(const std::string& contact, const std::string& functions)
{
  return sheet + contact + "tracked:\n  - name: shell\n    guide: {cloth: sheet}\n    mesh: same\n    test_functions: " + functions + "\n" +
         "    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e5}\n" + contact;
}

TEST(IgnoredInputs, clustersOfAGuideWhoseMotionIsNotKnownAreWarnedOf)
{
  EXPECT_EQ(count(warningsOf(tracked("", "{clusters: {count: 2}}")), {"test_functions.clusters", "first shape alone"}), 1);
  EXPECT_EQ(count(warningsOf(tracked("", "{basis: subdivision}")), {"first shape alone"}), 0);
}

TEST(IgnoredInputs, aPreviewThatPassesThroughOtherClothsIsWarnedOf)
{
  const auto built = [](const std::string& contact) { return Simulation(parseScene(tracked(contact, "{basis: subdivision}"), "test.yaml")).config().warnings; };
  EXPECT_EQ(count(built("    contact: {thickness: 0.002, self: false}\n"), {"cloth sheet", "is the guide of another", "shell"}), 1);
  EXPECT_EQ(count(built("    contact: {thickness: 0.002, self: false, cloths: false}\n"), {"is the guide of another"}), 0);
}

/// The scene with `more` in the material of its rod.
std::string withMaterial(const std::string& more) { return std::string(rod).insert(rod.find("density:"), more + ", "); }

TEST(IgnoredInputs, materialThatNothingFollowsFromIsWarnedOf)
{
  const std::string twist = "twist_modulus: 1.0e-3, bend_modulus: 1.0e-3";
  EXPECT_EQ(count(warningsOf(withMaterial("poissons_ratio: 0.4, " + twist)), {"material.poissons_ratio", "has no effect", "twist_modulus"}), 1);
  EXPECT_EQ(count(warningsOf(withMaterial("torsion: saint_venant, " + twist)), {"material.torsion", "has no effect", "twist_modulus"}), 1);
  EXPECT_EQ(count(warningsOf(withMaterial("poissons_ratio: 0.4, torsion: saint_venant")), {"has no effect"}), 0);
  EXPECT_EQ(count(warningsOf(withMaterial("linear_density: 0.1")), {"material.density", "linear_density is given"}), 1);
  EXPECT_EQ(count(warningsOf("gravity: [0, 0, 0]\n" + withMaterial("inextensible: true")), {"material.inextensible", "no gravity"}), 1);
  EXPECT_EQ(count(warningsOf(withMaterial("inextensible: true")), {"has no effect"}), 0);
}

TEST(IgnoredInputs, timeKeysOfOtherIntegratorsAreWarnedOf)
{
  EXPECT_EQ(count(warningsOf("time: {integrator: bdf2, spectral_radius: 0.5}\n" + rod), {"time.spectral_radius", "generalized_alpha", "bdf2"}), 1);
  EXPECT_EQ(count(warningsOf("time: {integrator: generalized_alpha, spectral_radius: 0.5}\n" + rod), {"spectral_radius"}), 0);
  EXPECT_EQ(count(warningsOf("time: {integrator: symplectic_euler, newton: {max_iterations: 5}}\n" + rod), {"time.newton", "has no effect"}), 1);
}

TEST(IgnoredInputs, windThatNothingFeelsIsWarnedOf)
{
  const std::string wind = "wind: {velocity: [1, 0, 0]}\n";
  EXPECT_EQ(count(warningsOf(wind + rod), {"wind", "has no effect", "drag"}), 1);
  EXPECT_EQ(count(warningsOf(wind + sheet), {"wind", "has no effect"}), 1);
  EXPECT_EQ(count(warningsOf(wind + rod + "    damping: {drag: 0.1}\n"), {"wind"}), 0);
  EXPECT_EQ(count(warningsOf(wind + sheet + "    aerodynamics: {drag: 1.2}\n"), {"wind"}), 0);
}

TEST(IgnoredInputs, obstaclesThatNothingTouchesAreWarnedOf)
{
  const std::string post = "obstacles:\n  - {name: post, shape: {sphere: {radius: 0.1}}}\n";
  EXPECT_EQ(count(warningsOf(rod + post), {"obstacles", "touched by nothing", "post"}), 1);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {friction: 0.3}\n" + post), {"touched by nothing"}), 0);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {obstacles: false}\n" + post), {"touched by nothing"}), 1);
  EXPECT_EQ(count(warningsOf(rod + "    grasps: {end: {edges: [0], motion: {body: post}}}\n" + post), {"touched by nothing"}), 0);   // a frame to follow
}

TEST(IgnoredInputs, otherKeysWithoutEffectAreWarnedOf)
{
  EXPECT_EQ(count(warningsOf(rod + "bodies:\n  - {name: hand, motion: fixed, force: [1, 0, 0]}\n"), {"bodies.0.force", "motion is given"}), 1);
  EXPECT_EQ(count(warningsOf(sheet + "    bending: {model: none, modulus: 1.0e-4}\n"), {"bending.modulus", "model: none"}), 1);
  EXPECT_EQ(count(warningsOf(sheet + "    solver: {linear: cholesky, tolerance: 0.01}\n"), {"solver.tolerance", "cholesky"}), 1);
  EXPECT_EQ(count(warningsOf("time: {integrator: symplectic_euler, step: 1.0e-5}\n" + sheet + "    solver: {tolerance: 0.01}\n"), {"solver", "has no effect"}), 1);
  const std::string thread = "threads:\n  - {name: honey, fluid: {viscosity: 10}, nozzle: {position: [0, 0, 1], diameter: 0.004, flow: 1.0e-7}, edges: {deposited: 100}}\n";
  EXPECT_EQ(count(warningsOf(thread), {"edges.deposited", "no"}), 1);
}

TEST(IgnoredInputs, overridesThatMatchNothingAreRefusedWithNearNames)
{
  const auto refusal = [](const std::string& assignment) {
    try
    {
      parseScene(rod + "    grasps: {left: {edges: [0]}, right: {edges: [-1]}}\n", "test.yaml", {assignment});
      return std::string();
    }
    catch (const SceneError& error)
    {
      return std::string(error.what());
    }
  };
  const auto has = [](const std::string& text, const std::vector<std::string>& words) { return count({text}, words) == 1; };
  EXPECT_TRUE(has(refusal("rods.0.material.youngs_modulis=1e7"), {"--set", "youngs_modulis", "did you mean youngs_modulus?"})) << refusal("rods.0.material.youngs_modulis=1e7");
  EXPECT_TRUE(has(refusal("rods.rope.closed=true"), {"--set", "is a list", "0 is rope"})) << refusal("rods.rope.closed=true");
  EXPECT_TRUE(has(refusal("rods.1.closed=true"), {"--set", "[-1, 0]"}));
  EXPECT_TRUE(has(refusal("rods.0.grasps.lefft.motion=topic"), {"--set", "no grasp 'lefft'", "it has: left, right", "did you mean left?"}))
    << refusal("rods.0.grasps.lefft.motion=topic");
  EXPECT_TRUE(has(refusal("rod.0.closed=true"), {"--set", "did you mean rods?"})) << refusal("rod.0.closed=true");
  EXPECT_TRUE(has(refusal("rods.0.name.first=a"), {"--set", "single value"}));
  EXPECT_EQ(refusal("rods.0.material.youngs_modulus=1e8"), "");
  EXPECT_EQ(refusal("rods.0.grasps.middle={edges: [4]}"), "");   // a new one, as a whole
}

}  // namespace
}  // namespace slender
