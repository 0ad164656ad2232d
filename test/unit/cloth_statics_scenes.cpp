// Scenes of cloth with clamps, point loads and a start in equilibrium.
#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {
namespace {

/// A strip of 0.3 m x 1.1 m whose first row of cells is clamped: 1 m is free. D = 1 N m.
const char* const strip = R"(
gravity: [0, 0, -1.0e-3]
start: equilibrium
time: {step: 0.01, duration: 1}
cloths:
  - name: strip
    grid: {corner: [0, 0, 0], sides: [[0.3, 0, 0], [0, 1.1, 0]], cells: [3, 11], pattern: one_diagonal}
    material: {area_density: 1, thickness: 0.01, youngs_modulus: 1.2e7, poissons_ratio: 0}
    bending: {modulus: 1, poissons_ratio: 0}
    grasps:
      wall: {edge: lower, clamp: true}
)";

std::string problemsOfStrip(const std::vector<std::string>& overrides)
{
  try
  {
    const Simulation simulation(parseScene(strip, "t", overrides));
  }
  catch (const std::exception& error)
  {
    return error.what();
  }
  return "";
}

double tip(const Simulation& simulation) { return -simulation.state().cloths[0].x.row(2).minCoeff(); }

TEST(ClothStaticsScene, aClampHoldsTheSlopeOfAnEdge)
{
  const SceneConfig scene = parseScene(strip, "t");
  EXPECT_EQ(scene.cloths[0].grasps[0].vertices.size(), 8u);   // two rows of four
  Simulation simulation(scene);
  EXPECT_NEAR(tip(simulation), 1e-3 / 8, 0.02 * 1e-3 / 8);   // beam: q L^4 / (8 D); ten cells are 1 % off
  ASSERT_TRUE(simulation.startReport());
  EXPECT_TRUE(simulation.startReport()->stable);
  // The wall bears the weight of the whole strip.
  const Wrench& wrench = simulation.state().wrenches[0];
  EXPECT_NEAR(wrench.force.z(), -0.33 * 1e-3, 1e-7);
  // Steps from there stay there.
  const double start = tip(simulation);
  for (int k = 0; k < 20; ++k)
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  EXPECT_NEAR(tip(simulation), start, 1e-4 * start);   // Newton's tolerance over 20 steps
  EXPECT_NE(problemsOfStrip({"cloths.0.grasps.wall.clamp=maybe"}).find("clamp"), std::string::npos);
}

TEST(ClothStaticsScene, pointLoadsActOnEachVertexInStaticsAndInDynamics)
{
  // 4e-4 N at the end of a beam of 0.3 m width: P L^3 / (3 D b)
  const double expected = 4e-4 / (3 * 0.3);
  const std::string loads = "cloths.0.loads=[{edge: upper, force: [0, 0, -1.0e-4]}]";
  Simulation simulation(parseScene(strip, "t", {"gravity=[0, 0, 0]", loads}));
  EXPECT_NEAR(tip(simulation), expected, 0.02 * expected);
  Simulation moving(parseScene(strip, "t", {"gravity=[0, 0, 0]", "start=as_given", loads}));
  ASSERT_TRUE(moving.step(moving.defaultInputs()).ok);
  EXPECT_GT(tip(moving), 0.0);
  EXPECT_NE(problemsOfStrip({"cloths.0.loads=[{vertices: [0]}]"}).find("force"), std::string::npos);
  EXPECT_NE(problemsOfStrip({"cloths.0.loads=[{force: [0, 0, 1]}]"}).find("must have one of vertices"),
            std::string::npos);
}

TEST(ClothStaticsScene, loadFactorsScaleGravityAndLoads)
{
  Simulation simulation(
      parseScene(strip, "t", {"statics={factors: [1, 2]}", "cloths.0.loads=[{edge: upper, force: [0, 0, -1.0e-5]}]"}),
      false);
  const StaticsRun run = simulation.runStatics();
  ASSERT_TRUE(run.end.ok) << run.end.message;
  ASSERT_EQ(run.rows.size(), 2u);
  EXPECT_TRUE(run.rows[0].report.stable);
  EXPECT_GT(run.rows[0].displacement, 1e-3 / 8);
  // deflections of 1e-4 of the length are linear
  EXPECT_NEAR(run.rows[1].displacement / run.rows[0].displacement, 2.0, 1e-5);
}

TEST(ClothStaticsScene, whatHasNoStaticsIsRefused)
{
  EXPECT_NE(problemsOfStrip({"cloths.0.contact={}"}).find("has contact"), std::string::npos);
  EXPECT_NE(problemsOfStrip({"cloths.0.bending={model: conforming, modulus: 1}"}).find("leave out clamp"),
            std::string::npos);
}

}   // namespace
}   // namespace slender
