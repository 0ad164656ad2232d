#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/scenes.h"

namespace slender {
namespace {

using Eigen::Vector3d;
using test::problemsOf;

const char* const towel = R"(
name: towel
time: {step: 0.01, duration: 1}
cloths:
  - name: towel
    grid: {corner: [0, 0, 1], sides: [[0.4, 0, 0], [0, 0.3, 0]], cells: [8, 6], pattern: alternating}
    material: {density: 500, thickness: 0.0004, youngs_modulus: 2.0e5, poissons_ratio: 0.25}
    bending: {model: hinge}
    damping: {mass: 0.5, stiffness: 0.001, drag: 0.8}
    solver: {linear: cholesky, tolerance: 0.01}
    grasps:
      left: {corner: upper_left}
      right: {vertices: [8, "17..18", -1], motion: {topic: true}, attach: frame}
)";

TEST(ClothReader, ReadsEverything)
{
  const SceneConfig scene = parseScene(towel, "t");
  ASSERT_EQ(scene.cloths.size(), 1u);
  const ClothConfig& c = scene.cloths[0];
  EXPECT_EQ(c.mesh.vertices.cols(), 63);
  EXPECT_DOUBLE_EQ(c.area_density, 0.2);
  EXPECT_NEAR(c.membrane.c33, 2e5 * 4e-4 / (2 * 1.25), 1e-9);
  EXPECT_EQ(c.bending, BendingModel::hinge);
  EXPECT_NEAR(c.bending_modulus, 2e5 * 64e-12 / (12 * (1 - 0.0625)), 1e-18);
  EXPECT_EQ(c.wind_coefficient, 0.8);
  EXPECT_EQ(c.solver, ClothSolver::cholesky);
  EXPECT_EQ(c.linear_tolerance, 0.01);
  EXPECT_EQ(scene.time.integrator, Integrator::implicit_euler);
  ASSERT_EQ(c.grasps.size(), 2u);
  EXPECT_EQ(c.grasps[0].vertices, std::vector<int>{54});
  EXPECT_EQ(c.grasps[0].attach, Attach::initial);
  EXPECT_EQ(c.grasps[1].vertices, (std::vector<int>{8, 17, 18, 62}));
  EXPECT_EQ(c.grasps[1].attach, Attach::section);
  EXPECT_LT((c.mesh.vertices.col(54) - Vector3d(0, 0.3, 1)).norm(), 1e-12);
}

/// Corners and edges of a grid that stands askew in space, whatever the pattern.
TEST(ClothReader, FindsCornersAndEdges)
{
  for (const char* pattern : {"one_diagonal", "alternating", "equilateral", "irregular"})
  {
    const auto held = [&](const std::string& grasp) {
      const SceneConfig scene =
          parseScene(towel, "t",
                     {"cloths.0.grid={corner: [1, 2, 3], sides: [[0, 0.6, 0.8], [0.5, 0, 0]], cells: 10, pattern: " +
                          std::string(pattern) + "}",
                      "cloths.0.grasps={g: " + grasp + "}"});
      Eigen::Matrix3Xd points(3, 0);
      for (const int v : scene.cloths[0].grasps[0].vertices)
      {
        points.conservativeResize(3, points.cols() + 1);
        points.rightCols<1>() = scene.cloths[0].mesh.vertices.col(v);
      }
      return points;
    };
    const auto expectPoint = [&](const char* corner, const Vector3d& at) {
      const Eigen::Matrix3Xd points = held("{corner: " + std::string(corner) + "}");
      ASSERT_EQ(points.cols(), 1) << pattern;
      EXPECT_LT((points.col(0) - at).norm(), 1e-12) << pattern << " " << corner;
    };
    expectPoint("lower_left", {1, 2, 3});
    expectPoint("lower_right", {1, 2.6, 3.8});
    expectPoint("upper_left", {1.5, 2, 3});
    expectPoint("upper_right", {1.5, 2.6, 3.8});
    const Eigen::Matrix3Xd upper = held("{edge: upper}"), lower = held("{edge: lower}");
    EXPECT_GE(upper.cols(), 11) << pattern;
    EXPECT_LT((upper.row(0).array() - 1.5).abs().maxCoeff(), 1e-12);
    EXPECT_LT((lower.row(0).array() - 1.0).abs().maxCoeff(), 1e-12);
    const Eigen::Matrix3Xd left = held("{edge: left}"), right = held("{edge: right}");
    EXPECT_GE(left.cols(), 5) << pattern;
    EXPECT_LT((left.row(1).array() - 2.0).abs().maxCoeff(), 1e-12);
    EXPECT_LT((right.row(1).array() - 2.6).abs().maxCoeff(), 1e-12);
    const Eigen::Matrix3Xd patch = held("{near: {point: [1, 2, 3], radius: 0.15}}");
    EXPECT_GE(patch.cols(), 3) << pattern;
    EXPECT_LE((patch.colwise() - Vector3d(1, 2, 3)).colwise().norm().maxCoeff(), 0.15);
    EXPECT_EQ(held("{near: {point: [1, 2, 3]}}").cols(), 1);
  }
}

TEST(ClothReader, NamesWhatIsWrong)
{
  const std::pair<const char*, const char*> cases[] = {
      {"cloths.0.material.density=-1",
       "cloths.0.material.density = -1: is out of range; must be a number in (0, 1000000] kg/m^3"},
      {"cloths.0.material.area_density=0.2", "there is an area_density as well"},
      {"cloths.0.material.thickness=0", "cloths.0.material.thickness = 0"},
      {"cloths.0.material.poissons_ratio=0.6", "must be a number in (-1, 0.5]"},
      {"cloths.0.bending.model=stiff", "cloths.0.bending.model = stiff"},
      {"cloths.0.bending.modulus=-1", "must be a number in [0, 1000000000] N m"},
      {"cloths.0.membrane={warp: 300, weft: 200, shear: 50}", "there is a membrane as well"},
      {"cloths.0.membrane={warp: 1, weft: 200, poissons_ratio: 0.9, shear: 50}", "cloths.0.membrane"},
      {"cloths.0.grid.sides=[[1, 0, 0], [1, 1, 0]]", "must be at right angles"},
      {"cloths.0.grid.sides=[[1, 0, 0], [0, 0, 0]]", "has no length"},
      {"cloths.0.grid.cells=0", "must be a whole number in [1, 2000]"},
      {"cloths.0.grid.seed=3", "is for pattern: irregular"},
      {"cloths.0.mesh={file: a.obj}", "must have either grid"},
      {"cloths.0.damping.drag=-1", "cloths.0.damping.drag = -1"},
      {"cloths.0.solver.linear=gauss", "cloths.0.solver.linear = gauss"},
      {"cloths.0.solver.tolerance=1", "must be a number in (0, 1)"},
      {"cloths.0.grasps={left-hand: {corner: upper_left}}", "\"left-hand\", which is not a name"},
      {"cloths.0.grasps.left={corner: top}", "cloths.0.grasps.left.corner = top"},
      {"cloths.0.grasps.left={corner: upper_left, edge: upper}", "must have one of vertices"},
      {"cloths.0.grasps.left={vertices: [63]}", "must be a whole number in [-63, 62]"},
      {"cloths.0.grasps.left={vertices: [1, 1]}", "names vertex 1 twice"},
      {"cloths.0.grasps.left={vertices: [8]}", "which grasp"},
      {"cloths.0.grasps.left={near: {point: [9, 9, 9], radius: 0.1}}", "reaches no vertex; the nearest, 62"},
      {"cloths.0.grasps.left={corner: upper_left, attach: frame, motion: {table: [[0, 0, 0, 1]]}}",
       "must be [t, x, y, z, qx, qy, qz, qw]"},
      {"cloths.0.stiff=1", "unknown key"},
      {"time.integrator=bdf2",
       "is not for the cloth of this scene; must be one of: implicit_euler, tr_bdf2, symplectic_euler, imex"},
      {"time.spectral_radius=0.5", "is for generalized_alpha, which cloth does not have"},
      {"wind={velocity: [2000, 0, 0]}", "wind.velocity"},
  };
  for (const auto& [assignment, expected] : cases)
  {
    EXPECT_NE(problemsOf(towel, {assignment}).find(expected), std::string::npos)
        << assignment << "\ngave: " << problemsOf(towel, {assignment});
  }
  EXPECT_NE(problemsOf(towel, {"rods=[{grasps: {left: {edges: [0]}}}]"}).find("same name as rods.0.grasps.left"),
            std::string::npos);
  EXPECT_NE(problemsOf(towel, {"bodies=[{name: hand, mass: 1, inertia: [1, 1, 1]}]",
                               "cloths.0.grasps.left.motion={body: hand}"})
                .find("is simulated"),
            std::string::npos);
}

/// What a message offers must be what the scene takes.
TEST(ClothReader, NamesTheIntegratorsOfTheScene)
{
  const std::string body = "bodies=[{name: box, mass: 1, shape: {sphere: {radius: 0.1}}}]",
                    contact = "cloths.0.contact={}", method = "cloths.0.contact={method: impulses, obstacles: false}";
  const auto refusal = [&](const std::string& c) {
    return problemsOf(towel, {body, c, "time.integrator=generalized_alpha"});
  };
  EXPECT_NE(refusal(contact).find("is not for the cloth of this scene; must be implicit_euler"), std::string::npos);
  EXPECT_NE(refusal(method).find("must be one of: implicit_euler, tr_bdf2, symplectic_euler"), std::string::npos);
  EXPECT_NE(problemsOf(towel, {body, contact, "time.integrator=tr_bdf2"}), "");
  EXPECT_EQ(problemsOf(towel, {body, method, "time.integrator=tr_bdf2"}), "");
  const SceneConfig scene = parseScene(towel, "t", {body, contact});
  ASSERT_FALSE(scene.warnings.empty());
  EXPECT_NE(scene.warnings[0].find("give time.integrator, which in this scene must be implicit_euler"),
            std::string::npos)
      << scene.warnings[0];
}

class ClothFiles : public ::testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = std::filesystem::temp_directory_path() / ("slender_cloth_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text)
  {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::string problem(const std::string& obj)
  {
    write("bad.obj", obj);
    try
    {
      parseScene("cloths: [{mesh: {file: bad.obj}}]", "t", {}, folder_.string());
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }
  std::filesystem::path folder_;
};

TEST_F(ClothFiles, ReadsAndPlacesMeshes)
{
  write("quad.obj", "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nf 1 2 3 4\n");
  const SceneConfig scene = parseScene(
      "cloths: [{mesh: {file: quad.obj, scale: 0.01, pose: {position: [0, 0, 2], rpy: [1.5707963267948966, 0, 0]}}, "
      "grasps: {a: {near: {point: [0, 0, 3]}}}}]",
      "t", {}, folder_.string());
  const ClothConfig& c = scene.cloths[0];
  EXPECT_EQ(c.mesh.triangles.cols(), 2);
  EXPECT_LT((c.mesh.vertices.col(2) - Vector3d(1, 0, 3)).norm(), 1e-12);
  EXPECT_EQ(c.grasps[0].vertices, std::vector<int>{3});
}

TEST_F(ClothFiles, ReportsDefectsByNameWithTheFile)
{
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  const std::pair<std::string, const char*> cases[] = {
      {square + "v 2 0 0\nf 1 2 3\nf 1 3 4\nf 1 2 5\n", "no area"},
      {square + "v 0.5 0.5 1\nf 1 2 3\nf 1 3 4\nf 1 3 5\n", "edge"},
      {square + "v 1 1 0\nf 1 2 3\nf 1 5 4\n", "same place"},
      {square + "v 5 5 5\nf 1 2 3\nf 1 3 4\n", "no face"},
      {square + "f 1 2 3\nf 1 4 3\n", "direction"},
  };
  for (const auto& [obj, expected] : cases)
  {
    const std::string text = problem(obj);
    EXPECT_NE(text.find("t:1: cloths.0.mesh.file = bad.obj: bad.obj: "), std::string::npos) << text;
    EXPECT_NE(text.find(expected), std::string::npos) << expected << "\n" << text;
  }
  EXPECT_NE(problem("v 0 0 nonsense\n").find("bad.obj:1"), std::string::npos);
  try
  {
    parseScene("cloths: [{mesh: {file: nowhere.ply}}]", "t", {}, folder_.string());
    FAIL();
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("nowhere.ply: cannot"), std::string::npos) << error.what();
  }
}

double weight(const Simulation& simulation) { return 9.81 * simulation.clothModel(0).totalMass(); }

StepReport mergedRun(Simulation& simulation, int steps)
{
  StepReport total;
  for (int k = 0; k < steps && total.ok; ++k)
    total.merge(simulation.step(simulation.defaultInputs()));
  return total;
}

/// Two grippers lift the cloth: at rest they carry it, and each wrench's moment about the other end of the balance is
/// that of the weight.
TEST(ClothScene, WrenchesCarryTheWeight)
{
  Simulation simulation(
      parseScene(towel, "t",
                 {"cloths.0.grasps={left: {edge: left}, right: {near: {point: [0.4, 0, 1], radius: 0.12}, "
                  "motion: {table: [[0, 5, 5, 5], [0.5, 4.9, 5, 5.05]]}}}",
                  "cloths.0.damping.mass=8"}));
  const Pose before = simulation.grasps().pose(1);
  const StepReport report = mergedRun(simulation, 600);
  ASSERT_TRUE(report.ok) << report.message;
  // attach: initial
  EXPECT_LT((simulation.grasps().pose(1).position - before.position - Vector3d(-0.1, 0, 0.05)).norm(), 1e-12);
  const Wrench &left = simulation.grasps().wrench(0), &right = simulation.grasps().wrench(1);
  EXPECT_LT((left.force + right.force + Vector3d(0, 0, weight(simulation))).norm(), 1e-3 * weight(simulation));
  const ClothState& cloth = simulation.state().cloths[0];
  const Vector3d centre = cloth.x * simulation.clothModel(0).mass / simulation.clothModel(0).totalMass();
  const Vector3d moment = left.torque + right.torque + simulation.grasps().pose(0).position.cross(left.force) +
                          simulation.grasps().pose(1).position.cross(right.force) +
                          centre.cross(Vector3d(0, 0, weight(simulation)));
  EXPECT_LT(moment.norm(), 1e-3 * weight(simulation));
  EXPECT_GT(left.torque.norm(), 1e-4);
  EXPECT_LT(simulation.clothEnergies(0).kinetic, 1e-6);
}

/// The held set turns rigidly with its motion.
TEST(ClothScene, GraspsTurnTheirVertices)
{
  Simulation simulation(parseScene(towel, "t",
                                   {"cloths.0.grasps={g: {vertices: [0, 1, 2, 9, 10], attach: frame, "
                                    "motion: {table: [[0, 0, 0, 0, 0, 0, 0, 1], [0.2, 0.1, 0, 0.1, 0.7071067811865476, "
                                    "0, 0, 0.7071067811865476]]}}}"}));
  const Eigen::Matrix3Xd points = simulation.state().cloth_grasps[0][0].points_G;
  const StepReport report = mergedRun(simulation, 25);
  ASSERT_TRUE(report.ok) << report.message;
  const ClothState& held = simulation.state().cloths[0];
  const ClothGrasp& grasp = simulation.state().cloth_grasps[0][0];
  for (int k = 0; k < 5; ++k)
  {
    const Vector3d turned(points(0, k), -points(2, k), points(1, k));   // a quarter turn about x
    EXPECT_LT((held.x.col(grasp.vertices[k]) - Vector3d(0.1, 0, 0.1) - turned).norm(), 1e-12);
  }
}

TEST(ClothScene, WindCarriesThemAlong)
{
  Simulation simulation(parseScene(
      towel, "t", {"cloths.0.grasps={top: {edge: upper}}", "wind={velocity: [0, 0, 4]}", "gravity=[0, 0, 0]"}));
  ASSERT_TRUE(mergedRun(simulation, 20).ok);
  EXPECT_GT(simulation.grasps().wrench(0).force.z(), 0.01);
  EXPECT_GT(simulation.state().cloths[0].x.row(2).mean(), 1.01);
}

TEST(ClothScene, RestartsBitEqual)
{
  const std::string path =
      (std::filesystem::temp_directory_path() / ("slender_cloth_state_" + std::to_string(::getpid()))).string();
  const std::vector<std::string> moving{
      "cloths.0.grasps.right.motion={table: [[0, 0.3, 0, 1, 0, 0, 0, 1], [1, 0.3, 0, 1.2, 0, 0, 0, 1]]}",
      "wind={velocity: [0, 3, 0]}"};
  Simulation simulation(parseScene(towel, "t", moving));
  ASSERT_TRUE(mergedRun(simulation, 12).ok);
  simulation.grasps().release(0);
  ASSERT_TRUE(mergedRun(simulation, 3).ok);
  simulation.save(path);
  ASSERT_TRUE(mergedRun(simulation, 10).ok);
  Simulation again(parseScene(towel, "t", moving));
  again.load(path);
  EXPECT_FALSE(again.grasps().isActive(0));
  ASSERT_TRUE(mergedRun(again, 10).ok);
  EXPECT_EQ(again.state().cloths[0].x, simulation.state().cloths[0].x);
  EXPECT_EQ(again.state().cloths[0].v, simulation.state().cloths[0].v);
  EXPECT_EQ(again.grasps().wrench(1).torque, simulation.grasps().wrench(1).torque);
  Simulation other(parseScene(towel, "t", {"cloths.0.material.youngs_modulus=3e5"}));
  EXPECT_THROW(other.load(path), std::runtime_error);
  std::remove(path.c_str());
}

TEST(ClothScene, TakesHoldAndLetsGo)
{
  Simulation simulation(parseScene(towel, "t"));
  ASSERT_TRUE(mergedRun(simulation, 5).ok);
  simulation.grasps().release(0);
  EXPECT_EQ(simulation.state().cloths[0].pins, (std::vector<int>{8, 17, 18, 62}));
  EXPECT_EQ(simulation.grasps().wrench(0).force, Vector3d(0, 0, 0));
  ASSERT_TRUE(mergedRun(simulation, 5).ok);
  EXPECT_THROW(simulation.grasps().attachVertices(0, {17}), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attachVertices(0, {}), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attach(0, -1, 3, Hold::frame), std::invalid_argument);
  const Vector3d held = simulation.state().cloths[0].x.col(40);
  simulation.grasps().attachVertices(0, {41, 40, 40});
  ASSERT_TRUE(mergedRun(simulation, 5).ok);
  EXPECT_LT((simulation.state().cloths[0].x.col(40) - held).norm(), 1e-15);
  simulation.reset();
  EXPECT_EQ(simulation.state().cloth_grasps[0][0].vertices, std::vector<int>{54});
}

/// A step that fails leaves everything where it was.
TEST(ClothScene, FailsWithoutTrace)
{
  Simulation simulation(parseScene(towel, "t"));
  ASSERT_TRUE(mergedRun(simulation, 3).ok);
  const Eigen::Matrix3Xd before = simulation.state().cloths[0].x;
  SceneInputs inputs = simulation.defaultInputs();
  inputs.grasps[1].X_WG.position.x() = std::nan("");
  const StepReport report = simulation.step(inputs);
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("pin positions"), std::string::npos) << report.message;
  EXPECT_EQ(simulation.state().cloths[0].x, before);
  EXPECT_TRUE(simulation.grasps().pose(1).position.allFinite());
  EXPECT_TRUE(mergedRun(simulation, 3).ok);
}

}   // namespace
}   // namespace slender
