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

}  // namespace
}  // namespace slender
