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

const std::string post = "obstacles:\n  - {name: post, shape: {sphere: {radius: 0.1}}}\n";

/// The warnings that have all of these words.
int count(const std::vector<std::string>& warnings, const std::vector<std::string>& words)
{
  int found = 0;
  for (const std::string& warning : warnings)
  {
    bool all = true;
    for (const std::string& word : words)
      all = all && warning.find(word) != std::string::npos;
    found += all;
  }
  return found;
}

std::vector<std::string> warningsOf(const std::string& scene) { return parseScene(scene, "test.yaml").warnings; }

TEST(IgnoredInputs, aBodyThatTheSceneDoesNotHaveIsWarnedOf)
{
  const std::string grasps = "    grasps: {end: {edges: [0], motion: {body: hnad}}}\n",
                    hand = "bodies:\n  - {name: hand, motion: fixed}\n";
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
  return sheet + contact +
         "tracked:\n  - name: shell\n    guide: {cloth: sheet}\n    mesh: same\n    test_functions: " + functions +
         "\n" + "    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e5}\n" + contact;
}

/// A rope that falls from 0.05 m by tr_bdf2 bounces up to 0.36 m for some heights of fall.
TEST(IgnoredInputs, secondOrderIntegratorsOfRodsInContactAreWarnedOf)
{
  const std::string touching = rod + "    contact: {friction: 0.3}\n" + post;
  for (const char* integrator : {"bdf2", "tr_bdf2"})
    EXPECT_EQ(count(warningsOf(std::string("time: {integrator: ") + integrator + "}\n" + touching),
                    {"may leave a collision"}),
              1);
  EXPECT_EQ(count(warningsOf("time: {integrator: implicit_euler}\n" + touching), {"may leave a collision"}), 0);
  EXPECT_EQ(count(warningsOf(touching), {"may leave a collision"}), 0);
  EXPECT_EQ(count(warningsOf("time: {integrator: tr_bdf2}\n" + rod), {"may leave a collision"}), 0);
}

TEST(IgnoredInputs, clustersOfAGuideWhoseMotionIsNotKnownAreWarnedOf)
{
  EXPECT_EQ(count(warningsOf(tracked("", "{clusters: {count: 2}}")), {"test_functions.clusters", "first shape alone"}),
            1);
  EXPECT_EQ(count(warningsOf(tracked("", "{basis: subdivision}")), {"first shape alone"}), 0);
}

TEST(IgnoredInputs, aPreviewThatPassesThroughOtherClothsIsWarnedOf)
{
  const auto built = [](const std::string& contact) {
    return Simulation(parseScene(tracked(contact, "{basis: subdivision}"), "test.yaml")).config().warnings;
  };
  EXPECT_EQ(count(built("    contact: {thickness: 0.002, self: false}\n"),
                  {"cloth sheet", "is the guide of another", "shell"}),
            1);
  EXPECT_EQ(count(built("    contact: {thickness: 0.002, self: false, cloths: false}\n"), {"is the guide of another"}),
            0);
}

/// The scene with `more` in the material of its rod.
std::string withMaterial(const std::string& more) { return std::string(rod).insert(rod.find("density:"), more + ", "); }

TEST(IgnoredInputs, materialThatNothingFollowsFromIsWarnedOf)
{
  const std::string twist = "twist_modulus: 1.0e-3, bend_modulus: 1.0e-3";
  EXPECT_EQ(count(warningsOf(withMaterial("poissons_ratio: 0.4, " + twist)),
                  {"material.poissons_ratio", "has no effect", "twist_modulus"}),
            1);
  EXPECT_EQ(count(warningsOf(withMaterial("torsion: saint_venant, " + twist)),
                  {"material.torsion", "has no effect", "twist_modulus"}),
            1);
  EXPECT_EQ(count(warningsOf(withMaterial("poissons_ratio: 0.4, torsion: saint_venant")), {"has no effect"}), 0);
  EXPECT_EQ(count(warningsOf(withMaterial("linear_density: 0.1")), {"material.density", "linear_density is given"}), 1);
  EXPECT_EQ(count(warningsOf("gravity: [0, 0, 0]\n" + withMaterial("inextensible: true")),
                  {"material.inextensible", "no gravity"}),
            1);
  EXPECT_EQ(count(warningsOf(withMaterial("inextensible: true")), {"has no effect"}), 0);
}

TEST(IgnoredInputs, timeKeysOfOtherIntegratorsAreWarnedOf)
{
  EXPECT_EQ(count(warningsOf("time: {integrator: bdf2, spectral_radius: 0.5}\n" + rod),
                  {"time.spectral_radius", "generalized_alpha", "bdf2"}),
            1);
  EXPECT_EQ(
      count(warningsOf("time: {integrator: generalized_alpha, spectral_radius: 0.5}\n" + rod), {"spectral_radius"}), 0);
  EXPECT_EQ(count(warningsOf("time: {integrator: symplectic_euler, newton: {max_iterations: 5}}\n" + rod),
                  {"time.newton", "has no effect"}),
            1);
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
  EXPECT_EQ(count(warningsOf(rod + post), {"obstacles", "touched by nothing", "post"}), 1);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {friction: 0.3}\n" + post), {"touched by nothing"}), 0);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {obstacles: false}\n" + post), {"touched by nothing"}), 1);
  // a frame to follow
  EXPECT_EQ(
      count(warningsOf(rod + "    grasps: {end: {edges: [0], motion: {body: post}}}\n" + post), {"touched by nothing"}),
      0);
}

TEST(IgnoredInputs, otherKeysWithoutEffectAreWarnedOf)
{
  EXPECT_EQ(count(warningsOf(rod + "bodies:\n  - {name: hand, motion: fixed, force: [1, 0, 0]}\n"),
                  {"bodies.0.force", "motion is given"}),
            1);
  EXPECT_EQ(
      count(warningsOf(sheet + "    bending: {model: none, modulus: 1.0e-4}\n"), {"bending.modulus", "model: none"}),
      1);
  EXPECT_EQ(
      count(warningsOf(sheet + "    solver: {linear: cholesky, tolerance: 0.01}\n"), {"solver.tolerance", "cholesky"}),
      1);
  EXPECT_EQ(count(warningsOf("time: {integrator: symplectic_euler, step: 1.0e-5}\n" + sheet +
                             "    solver: {tolerance: 0.01}\n"),
                  {"solver", "has no effect"}),
            1);
  const std::string thread =
      "threads:\n  - {name: honey, fluid: {viscosity: 10}, nozzle: {position: [0, 0, 1], diameter: 0.004, flow: "
      "1.0e-7}, edges: {deposited: 100}}\n";
  EXPECT_EQ(count(warningsOf(thread), {"edges.deposited", "no"}), 1);
}

TEST(IgnoredInputs, contactThatFindsNothingToTouchIsWarnedOf)
{
  const std::string deaf = "    contact: {self: false}\n";
  EXPECT_EQ(count(warningsOf(rod + deaf), {"rods.0.contact", "has no effect", "nothing to touch"}), 1);
  EXPECT_EQ(count(warningsOf(rod + deaf + post), {"nothing to touch"}), 0);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {self: false, obstacles: false}\n" + post),
                  {"rods.0.contact", "nothing to touch"}),
            1);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {}\n"), {"nothing to touch"}), 0);
  EXPECT_EQ(count(warningsOf(sheet + "    contact: {self: false, thickness: 0.001}\n"),
                  {"cloths.0.contact", "nothing to touch"}),
            1);
  const std::string thread =
      "threads:\n  - {name: honey, fluid: {viscosity: 10}, centerline: {straight: {from: [0, 0, 1], to: [0.1, 0, 1], "
      "edges: 4}}, radius: 0.002, ";
  EXPECT_EQ(count(warningsOf(thread + "contact: {self: false}}\n"), {"threads.0.contact", "nothing to touch"}), 1);
  EXPECT_EQ(count(warningsOf(thread + "contact: {self: false}, merging: true}\n" + post),
                  {"threads.0.merging", "has no effect"}),
            1);
  EXPECT_EQ(count(warningsOf(thread + "contact: {self: true}, merging: true}\n"), {"has no effect"}), 0);
}

TEST(IgnoredInputs, frictionThatNothingFeelsIsWarnedOf)
{
  const std::string rough = "obstacles:\n  - {name: post, shape: {sphere: {radius: 0.1}}, friction: 0.5}\n";
  EXPECT_EQ(count(warningsOf(rod + rough), {"obstacles.0.friction", "has no effect", "nothing touches it"}), 1);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {friction: 0}\n" + rough), {"obstacles.0.friction", "geometric mean"}),
            1);
  EXPECT_EQ(count(warningsOf(rod + "    contact: {friction: 0.1}\n" + rough), {"has no effect"}), 0);
  const std::string touching = rod + "    contact: {friction: 0.1}\nbodies:\n  - {name: hand, motion: fixed, ";
  EXPECT_EQ(count(warningsOf(touching + "friction: 0.4}\n"), {"bodies.0.friction", "no shape"}), 1);
  EXPECT_EQ(count(warningsOf(touching + "contact: true}\n"), {"bodies.0.contact", "no shape"}), 1);
  EXPECT_EQ(
      count(warningsOf(touching +
                       "pose: {position: [0, 0, 3]}, shape: {sphere: {radius: 0.1}}, contact: false, friction: 0.4}\n"),
            {"bodies.0.friction", "contact is false"}),
      1);
  EXPECT_EQ(
      count(warningsOf(touching + "pose: {position: [0, 0, 3]}, shape: {sphere: {radius: 0.1}}, friction: 0.4}\n"),
            {"has no effect"}),
      0);
  EXPECT_EQ(count(warningsOf("contact: {slip_speed: 0.001}\n" + rod + "    contact: {friction: 0}\n"),
                  {"contact.slip_speed", "has no effect"}),
            1);
  EXPECT_EQ(
      count(warningsOf("contact: {slip_speed: 0.001}\n" + rod + "    contact: {friction: 0.1}\n"), {"slip_speed"}), 0);
  const auto sheet = [](const std::string& friction) {
    return "contact: {slip_speed: 0.001}\ncloths:\n  - {name: sheet, grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, "
           "1, "
           "0]], cells: 4}, contact: {method: barrier, friction: " +
           friction + "}}\n";
  };
  EXPECT_EQ(count(warningsOf(sheet("0.1")), {"slip_speed"}), 0);
  EXPECT_EQ(count(warningsOf(sheet("0")), {"slip_speed"}), 1);
}

TEST(IgnoredInputs, plasticityThatNeverFlowsIsWarnedOf)
{
  const std::string hinges = sheet + "    bending: {model: hinge, modulus: ";
  EXPECT_EQ(count(warningsOf(hinges + "0}\n    plasticity: {yield_curvature: 5}\n"),
                  {"plasticity", "has no effect", "bending.modulus is 0"}),
            1);
  EXPECT_EQ(count(warningsOf(hinges + "1.0e-5}\n    plasticity: {yield_curvature: 1000}\n"),
                  {"plasticity.yield_curvature", "never reached"}),
            1);
  EXPECT_EQ(count(warningsOf(hinges + "1.0e-5}\n    plasticity: {yield_curvature: 5, hardening: 0.1, creep_time: 1}\n"),
                  {"plasticity"}),
            0);
}

TEST(IgnoredInputs, keysOfGeneratorsThatDoNothingAreWarnedOf)
{
  const auto generated = [](const std::string& entry) { return warningsOf("generate:\n  - " + entry + "\n"); };
  EXPECT_EQ(
      count(generated(
                "{chain: {links: 3, cross_section: {radius: 0.002}, material: {density: 1000, linear_density: 0.1}}}"),
            {"generate.0.chain.material.density", "has no effect"}),
      1);
  EXPECT_EQ(count(generated("{chain: {links: 1, spacing: 0.08, cross_section: {radius: 0.002}}}"),
                  {"generate.0.chain.spacing", "links: 1"}),
            1);
  EXPECT_EQ(count(generated("{chain: {links: 2, spacing: 0.08, cross_section: {radius: 0.002}}}"), {"has no effect"}),
            0);
  EXPECT_EQ(count(generated("{chain: {links: 1, cross_section: {radius: 0.002}, contact: {self: false}}}"),
                  {"generate.0.chain.contact", "nothing to touch"}),
            1);
  const std::string trunk =
      "seed: 2, children: 3, length_ratio: 0.4, radius_ratio: 0.4, angle: 0.5, joint_density: 800";
  for (const char* key : {"seed", "children", "length_ratio", "radius_ratio", "angle", "joint_density"})
  {
    EXPECT_EQ(count(generated("{tree: {levels: 1, vertices: 20, " + trunk + "}}"),
                    {"generate.0.tree." + std::string(key) + " ", "levels: 1"}),
              1)
        << key;
  }
  EXPECT_EQ(count(generated("{tree: {levels: 2, vertices: 100, " + trunk + "}}"), {"has no effect"}), 0);
  EXPECT_EQ(count(generated("{hair: {strands: 2, head: {friction: 0.4}}}"),
                  {"generate.0.hair.head.friction", "nothing touches it"}),
            1);
  EXPECT_EQ(
      count(generated("{hair: {strands: 2, head: {friction: 0.4}, contact: {friction: 0.2}}}"), {"has no effect"}), 0);
}

TEST(IgnoredInputs, keysOfTrackedShellsThatDoNothingAreWarnedOf)
{
  const auto shell = [](const std::string& functions) { return warningsOf(tracked("", functions)); };
  EXPECT_EQ(count(shell("[{name: all, basis: subdivision, from: 0.5, blend: 0.1}]"), {"only one set"}), 2);
  EXPECT_EQ(count(shell("[{name: all, basis: subdivision}, {name: one, vertices: [0], from: 0.5, blend: 0.1}]"),
                  {"only one set"}),
            0);
  EXPECT_EQ(count(shell("{clusters: {count: 1, seed: 3, compactness: 0.2, frames: 5}}"), {"with count: 1"}), 3);
  EXPECT_EQ(count(shell("{clusters: {count: 2, frames: 5}}"), {"clusters.frames", "only one shape"}), 1);
  EXPECT_EQ(count(shell("{clusters: {count: 2, seed: 3}}"), {"has no effect"}), 0);
}

TEST(IgnoredInputs, keysOfClothThatNothingFollowsFromAreWarnedOf)
{
  EXPECT_EQ(count(warningsOf(sheet + "    aerodynamics: {air_density: 1.1}\n"),
                  {"aerodynamics.air_density", "has no effect"}),
            1);
  EXPECT_EQ(count(warningsOf(sheet + "    aerodynamics: {air_density: 1.1, lift: 0.5}\n"), {"has no effect"}), 0);
  const auto woven = [](const std::string& material) {
    return warningsOf(
        "cloths:\n  - {name: s, grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 2}, membrane: {warp: 300, weft: 200, "
        "shear: 50}, "
        "bending: {modulus: 1.0e-5}, material: {" +
        material + "}}\n");
  };
  EXPECT_EQ(count(woven("area_density: 0.2, thickness: 0.0005"), {"material.thickness", "has no effect"}), 1);
  EXPECT_EQ(count(woven("density: 300, thickness: 0.0005"), {"has no effect"}), 0);
}

TEST(IgnoredInputs, keysOfNozzlesThatDoNothingAreWarnedOfOrRefused)
{
  const auto poured = [](const std::string& nozzle, const std::string& more) {
    return warningsOf(
        "threads:\n  - {name: honey, fluid: {viscosity: 10}, nozzle: {position: [0, 0, 0.1], diameter: 0.004, " +
        nozzle + "}" + more + "}\n");
  };
  const std::string floor = ", floor: {height: 0}", flow = "flow: 1.0e-7";
  EXPECT_EQ(count(poured(flow + ", swirl: 0.5", ""), {"nozzle.swirl", "has no effect", "nothing below"}), 1);
  EXPECT_EQ(
      count(poured("flow: {topic: true}, swirl: 0.5", floor), {"nozzle.swirl", "has no effect", "no flow is known"}),
      1);
  EXPECT_EQ(count(poured(flow + ", swirl: 0.5", floor), {"swirl"}), 0);
  EXPECT_EQ(count(poured("flow: 0", floor), {"nozzle.flow", "nothing flows"}), 1);
  EXPECT_EQ(count(poured("flow: {topic: true, initial: 0}", floor), {"nothing flows"}), 0);
  try
  {
    poured("flow: {table: [[0, 1.0e-7], [1, 2.0e-7]], initial: 1.0e-8}", floor);
    FAIL() << "initial beside a table was taken";
  }
  catch (const SceneError& error)
  {
    EXPECT_EQ(count({error.what()}, {"nozzle.flow.initial", "by messages"}), 1) << error.what();
  }
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
  const auto has = [](const std::string& text, const std::vector<std::string>& words) {
    return count({text}, words) == 1;
  };
  EXPECT_TRUE(
      has(refusal("rods.0.material.youngs_modulis=1e7"), {"--set", "youngs_modulis", "did you mean youngs_modulus?"}))
      << refusal("rods.0.material.youngs_modulis=1e7");
  EXPECT_TRUE(has(refusal("rods.rope.closed=true"), {"holds the edge that joins the last node"}))
      << refusal("rods.rope.closed=true");   // a name stands for a number
  EXPECT_TRUE(has(refusal("rods.rop.closed=true"), {"--set", "is a list", "0 is rope"}))
      << refusal("rods.rop.closed=true");
  EXPECT_TRUE(has(refusal("rods.1.closed=true"), {"--set", "[-1, 0]"}));
  EXPECT_TRUE(has(refusal("rods.0.grasps.lefft.motion=topic"),
                  {"--set", "no grasp 'lefft'", "it has: left, right", "did you mean left?"}))
      << refusal("rods.0.grasps.lefft.motion=topic");
  EXPECT_TRUE(has(refusal("rod.0.closed=true"), {"--set", "did you mean rods?"})) << refusal("rod.0.closed=true");
  EXPECT_TRUE(has(refusal("rods.0.name.first=a"), {"--set", "single value"}));
  EXPECT_EQ(refusal("rods.0.material.youngs_modulus=1e8"), "");
  EXPECT_EQ(refusal("rods.0.grasps.middle={edges: [4]}"), "");   // a new one, as a whole
}

}   // namespace
}   // namespace slender
