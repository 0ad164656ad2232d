#include <cmath>
#include <cstdio>
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/contact/intersection.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

/// Cloths of scene files that touch themselves, each other and solids.
namespace slender {
namespace {

using Eigen::Vector3d;

const char* const one = R"(
name: one
time: {step: 0.01, duration: 1}
cloths:
  - name: sheet
    grid: {corner: [-0.1, -0.1, 0.06], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: 8, pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6}
    damping: {mass: 1, stiffness: 0.001}
    contact: {friction: 0.3, thickness: 0.004}
obstacles:
  - {name: thing, shape: {sphere: {radius: 0.05}}}
)";

const char* const two = R"(
name: two
time: {step: 0.01, duration: 1}
cloths:
  - name: lower
    grid: {corner: [0, 0, 0.01], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: 6, pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005}
    contact: {friction: 0.3, thickness: 0.004}
  - name: upper
    grid: {corner: [0.03, 0.02, 0.02], sides: [[0.2, 0, 0], [0, 0.2, 0]], cells: 5, pattern: alternating}
    material: {area_density: 0.1, thickness: 0.0005}
    solver: {one_newton_step: true}
    contact: {friction: 0.3, thickness: 0.004}
obstacles:
  - {name: floor, shape: {plane: {}}}
)";

std::string problemOfContact(const char* scene, const std::vector<std::string>& overrides)
{
  try
  {
    Simulation simulation(parseScene(scene, "t", overrides));
  }
  catch (const SceneError& error)
  {
    return error.what();
  }
  return "";
}

/// By the check of all pairs, built from the configuration alone.
std::size_t intersectionsOf(const Simulation& simulation)
{
  CollisionSurface surface;
  Eigen::Matrix3Xd x(3, 0);
  surface.rest.resize(3, 0);
  for (std::size_t k = 0; k < simulation.config().cloths.size(); ++k)
  {
    const TriangleMesh& mesh = simulation.config().cloths[k].mesh;
    const Eigen::Index first = x.cols(), count = mesh.vertices.cols();
    CollisionSheet sheet;
    sheet.triangles = mesh.triangles.array() + static_cast<int>(first);
    surface.sheets.push_back(sheet);
    surface.rest.conservativeResize(3, first + count);
    surface.rest.rightCols(count) = mesh.vertices;
    x.conservativeResize(3, first + count);
    x.rightCols(count) = simulation.state().cloths[k].x;
  }
  std::vector<Pose> poses;
  for (std::size_t k = 0; k < simulation.config().obstacles.size(); ++k)
  {
    surface.solids.push_back({simulation.config().obstacles[k].shape, -1.0, {}});
    poses.push_back(simulation.state().obstacles[k]);
  }
  for (std::size_t b = 0; b < simulation.config().bodies.size(); ++b)
  {
    const BodyConfig& body = simulation.config().bodies[b];
    if (body.shape)
    {
      surface.solids.push_back({*body.shape, -1.0, {}});
      poses.push_back(simulation.state().bodies[b].X_WB * body.X_BS);
    }
  }
  return intersections(surface, x, poses).size();
}

/// Steps with the scene's own inputs; every one must succeed and leave no intersection.
StepReport runApart(Simulation& simulation, int steps)
{
  StepReport total;
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    EXPECT_TRUE(report.ok) << report.message;
    EXPECT_EQ(intersectionsOf(simulation), 0u) << "step " << simulation.state().steps;
    total.merge(report);
    if (!report.ok)
      break;
  }
  return total;
}

TEST(ClothContact, ReadsItsKeys)
{
  const auto contact = [](const std::string& text) {
    return parseScene(one, "t", {"cloths.0.contact=" + text}).cloths[0].contact;
  };
  ASSERT_TRUE(contact("{}"));
  EXPECT_TRUE(contact("{}")->self && contact("{}")->others && contact("{}")->solids);
  EXPECT_EQ(contact("{}")->thickness, 1e-3);
  const auto all = contact("{self: false, cloths: false, obstacles: false, friction: 0.1, thickness: 0.01}");
  EXPECT_FALSE(all->self || all->others || all->solids);
  EXPECT_EQ(all->friction, 0.1);
  EXPECT_EQ(all->thickness, 0.01);
  EXPECT_FALSE(parseScene("cloths: [{grid: {sides: [[1, 0, 0], [0, 1, 0]], cells: 2}}]", "t").cloths[0].contact);

  const std::pair<const char*, const char*> cases[] = {
      {"cloths.0.contact.thickness=0", "cloths.0.contact.thickness = 0: is out of range; must be a number in (0, 1] m"},
      {"cloths.0.contact.friction=-1", "cloths.0.contact.friction = -1"},
      {"cloths.0.contact.rods=true", "unknown key"},
      {"cloths.0.contact.self=maybe", "cloths.0.contact.self = maybe"},
      {"contact={gap: 0.001}", "has a thickness and no gap"},
      {"bodies=[{name: ball, mass: 1, inertia: [1, 1, 1], shape: {sphere: {radius: 0.1}}, pose: {position: [0, 0, "
       "9]}}]",
       "t:9: cloths.0.contact: body ball is simulated"},
  };
  for (const auto& [assignment, expected] : cases)
  {
    EXPECT_NE(problemOfContact(one, {assignment, "cloths.0.contact.method=impulses"}).find(expected), std::string::npos)
        << assignment << "\ngave: " << problemOfContact(one, {assignment});
  }
  const char* const body =
      "bodies=[{name: ball, mass: 1, inertia: [1, 1, 1], shape: {sphere: {radius: 0.1}}, pose: {position: [0, 0, 9]}, "
      "contact: false}]";
  EXPECT_EQ(problemOfContact(one, {body}), "");
}

TEST(ClothContact, WithoutItClothTouchesNothing)
{
  SceneConfig config = parseScene(one, "t");
  config.cloths[0].contact.reset();
  Simulation simulation(config);
  for (int k = 0; k < 40; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok);
    EXPECT_EQ(report.repulsions + report.impulses, 0);
  }
  EXPECT_LT(simulation.state().cloths[0].x.row(2).maxCoeff(), -0.1);
}

TEST(ClothContact, RestsOnEveryShape)
{
  const std::pair<const char*, double> shapes[] = {
      // and how high its top is
      {"{plane: {}}", 0.0},
      {"{sphere: {radius: 0.05}}", 0.05},
      {"{box: {size: [0.1, 0.1, 0.1]}}", 0.05},
      {"{cylinder: {radius: 0.05, length: 0.1}}", 0.05},
      {"{capsule: {radius: 0.03, length: 0.04}}", 0.05},
      {"{mesh: {file: " SLENDER_SOURCE_DIR "/config/meshes/ring.obj}}", 0.012},
  };
  for (const auto& [shape, top] : shapes)
  {
    SCOPED_TRACE(shape);
    Simulation simulation(parseScene(one, "t", {"obstacles.0.shape=" + std::string(shape)}));
    const StepReport report = runApart(simulation, 40);
    EXPECT_GT(report.repulsions, 0);
    const Eigen::Matrix3Xd& x = simulation.state().cloths[0].x;
    EXPECT_GT(x.row(2).maxCoeff(), top + 1e-4);
    EXPECT_LT(x.row(2).maxCoeff(), top + 0.02);   // folds
  }
}

TEST(ClothContact, ClothsTouchEachOther)
{
  Simulation simulation(parseScene(two, "t"));
  const StepReport report = runApart(simulation, 100);
  EXPECT_GT(report.repulsions, 0);
  const auto height = [&](int k) { return simulation.state().cloths[k].x.row(2).mean(); };
  EXPECT_NEAR(height(0), 2e-3, 5e-4);
  EXPECT_GT(height(1), height(0) + 2e-3);

  // those that have no contact, or none with cloths, pass through
  SceneConfig config = parseScene(two, "t", {"cloths.0.contact.cloths=false"});
  Simulation apart(config);
  config.cloths[1].contact.reset();
  Simulation ghost(config);
  for (int k = 0; k < 60; ++k)
  {
    ASSERT_TRUE(apart.step(apart.defaultInputs()).ok);
    ASSERT_TRUE(ghost.step(ghost.defaultInputs()).ok);
  }
  EXPECT_NEAR(apart.state().cloths[1].x.row(2).mean(), 2e-3, 5e-4);
  EXPECT_LT(ghost.state().cloths[1].x.row(2).maxCoeff(), -0.5);
  EXPECT_NEAR(ghost.state().cloths[0].x.row(2).mean(), 2e-3, 5e-4);
}

/// Of what moves by a table, by inputs, and as a body.
TEST(ClothContact, SolidsPushCloth)
{
  const std::vector<std::string> hanging{"gravity=[0, 0, 0]", "cloths.0.grasps={a: {edge: left}, b: {edge: right}}"};
  for (const char* mover :
       {"obstacles=[{name: fist, shape: {sphere: {radius: 0.03}}, motion: {table: [[0, 0, 0, 0], [0.4, 0, 0, 0.1]]}}]",
        "obstacles=[{name: fist, shape: {sphere: {radius: 0.03}}, motion: topic}]"})
  {
    SCOPED_TRACE(mover);
    std::vector<std::string> overrides = hanging;
    overrides.push_back(mover);
    Simulation simulation(parseScene(one, "t", overrides));
    for (int k = 1; k <= 40; ++k)
    {
      SceneInputs inputs = simulation.defaultInputs();
      if (std::holds_alternative<TopicMotion>(simulation.config().obstacles[0].motion))
        inputs.obstacles[0].X_WG.position.z() = 0.0025 * k;
      ASSERT_TRUE(simulation.step(inputs).ok);
      ASSERT_EQ(intersectionsOf(simulation), 0u);
    }
    EXPECT_NEAR(simulation.state().obstacles[0].position.z(), 0.1, 1e-12);
    EXPECT_GT(simulation.state().cloths[0].x.row(2).maxCoeff(), 0.1 + 0.03);
    EXPECT_GT(simulation.grasps().wrench(0).force.z(), 1e-3);   // the cloth pulls the grasps along
  }
  std::vector<std::string> overrides = hanging;
  overrides.push_back(
      "bodies=[{name: arm, shape: {box: {size: [0.03, 0.4, 0.03]}}, motion: {table: [[0, 0, 0, -0.1], [0.4, 0, 0, "
      "0.1]]}}]");
  overrides.push_back("obstacles=[]");
  Simulation simulation(parseScene(one, "t", overrides));
  runApart(simulation, 40);
  EXPECT_GT(simulation.state().cloths[0].x.row(2).maxCoeff(), 0.1 + 0.015);
}

TEST(ClothContact, IntersectionsAtTheStartAreRefusedByName)
{
  EXPECT_EQ(problemOfContact(one, {}), "");
  const std::string inside = problemOfContact(one, {"cloths.0.grid.corner=[-0.1, -0.1, 0.03]"});
  EXPECT_NE(inside.find("cloth 'sheet' at vertex "), std::string::npos) << inside;
  EXPECT_NE(inside.find(" meets 'thing'"), std::string::npos) << inside;
  EXPECT_NE(inside.find("move them apart"), std::string::npos) << inside;
  const std::string crossing = problemOfContact(two, {"cloths.1.grid.sides=[[0.2, 0, 0], [0, 0.2, -0.015]]"});
  EXPECT_NE(crossing.find("cloth 'upper' at vertex "), std::string::npos) << crossing;
  EXPECT_NE(crossing.find(" meets cloth 'lower'"), std::string::npos) << crossing;
  const std::string mesh =
      problemOfContact(one, {"obstacles.0.shape={mesh: {file: " SLENDER_SOURCE_DIR "/config/meshes/ring.obj}}",
                             "cloths.0.grid.corner=[-0.1, -0.1, 0]"});
  EXPECT_NE(mesh.find("cloth 'sheet' at vertex "), std::string::npos) << mesh;
  EXPECT_NE(mesh.find("'thing'"), std::string::npos) << mesh;
  // outside a cylinder, but within the prism that stands for it
  const std::string prism = problemOfContact(
      one, {"obstacles.0.shape={cylinder: {radius: 0.05, length: 0.4}}",
            "obstacles.0.pose={rpy: [1.5707963267948966, 0, 0]}", "cloths.0.grid.corner=[-0.1, -0.1, 0.05000001]"});
  EXPECT_NE(prism.find("the prism that stands for it"), std::string::npos) << prism;
  EXPECT_NE(prism.find("'thing'"), std::string::npos) << prism;
}

class ClothStateFiles : public ::testing::Test
{
protected:
  void TearDown() override { std::remove(path_.c_str()); }
  const std::string path_ =
      (std::filesystem::temp_directory_path() / ("slender_cloth_contact_" + std::to_string(::getpid()))).string();
};

TEST_F(ClothStateFiles, RestartsBitEqualInTheMiddleOfContact)
{
  const std::vector<std::string> moving{
      "cloths.0.grasps={left: {edge: left}}",
      "obstacles=[{name: floor, shape: {plane: {}}}, {name: fist, shape: {sphere: {radius: 0.02}}, motion: {table: "
      "[[0, 0.15, 0.1, 0.06], [0.3, 0.1, 0.1, 0.03]]}}]",
      "bodies=[{name: arm, shape: {capsule: {radius: 0.02, length: 0.1}}, motion: {table: [[0, 0.3, 0.1, 0.03], [0.3, "
      "0.2, 0.1, 0.03]]}}]"};
  Simulation simulation(parseScene(two, "t", moving));
  runApart(simulation, 15);
  simulation.save(path_);
  const StepReport report = runApart(simulation, 15);
  EXPECT_GT(report.repulsions, 0);
  Simulation again(parseScene(two, "t", moving));
  again.load(path_);
  runApart(again, 15);
  for (int k = 0; k < 2; ++k)
  {
    EXPECT_EQ(again.state().cloths[k].x, simulation.state().cloths[k].x);
    EXPECT_EQ(again.state().cloths[k].v, simulation.state().cloths[k].v);
  }
  EXPECT_EQ(again.grasps().wrench(0).force, simulation.grasps().wrench(0).force);
  EXPECT_EQ(again.grasps().wrench(0).torque, simulation.grasps().wrench(0).torque);
  for (const char* other :
       {"cloths.1.contact.thickness=0.003", "cloths.1.contact.friction=0.2", "cloths.1.contact.self=false"})
  {
    std::vector<std::string> overrides = moving;
    overrides.push_back(other);
    Simulation another(parseScene(two, "t", overrides));
    EXPECT_THROW(another.load(path_), std::runtime_error) << other;
  }
}

/// The same scene but for an obstacle's size.
TEST_F(ClothStateFiles, StatesWithIntersectionsAreRefused)
{
  Simulation simulation(parseScene(one, "t"));
  runApart(simulation, 30);
  simulation.save(path_);
  Simulation larger(parseScene(one, "t", {"obstacles.0.shape.sphere.radius=0.055"}));
  const Eigen::Matrix3Xd before = larger.state().cloths[0].x;
  try
  {
    larger.load(path_);
    ADD_FAILURE();
  }
  catch (const std::runtime_error& error)
  {
    EXPECT_NE(std::string(error.what()).find("meets 'thing'"), std::string::npos) << error.what();
  }
  EXPECT_EQ(larger.state().cloths[0].x, before);
  runApart(larger, 30);
}

/// A sheet on a slippery slope hangs from its upper edge: on the average over time the grasp carries the weight along
/// the slope; and of what presses on the slope those vertices' own part.
TEST(ClothContact, WrenchesHoldWhatTheSlopeDoesNotCarry)
{
  for (const char* shape : {"{plane: {normal: [-0.5, 0, 0.8660254037844386]}}", "{box: {size: [1, 1, 0.1]}}"})
  {
    SCOPED_TRACE(shape);
    const bool plane = shape[1] == 'p';
    std::vector<std::string> slope{
        "cloths.0.grid={corner: [0.1732050808, 0, 0.1], sides: [[-0.1732050808, 0, -0.1], [0, -0.2, 0]], cells: 8, "
        "pattern: alternating}",
        "cloths.0.grasps={top: {edge: left}}", "cloths.0.contact.friction=0", "cloths.0.damping.mass=4",
        "obstacles.0.shape=" + std::string(shape)};
    if (plane)
    {
      slope.push_back("cloths.0.grid.corner=[0.1732050808, 0, 0.1023094]");
    }
    else
    {
      // 2 mm below
      slope.push_back("obstacles.0.pose={position: [0.025, 0, -0.0456], rpy: [0, -0.5235987755982988, 0]}");
    }
    Simulation simulation(parseScene(one, "t", slope));
    runApart(simulation, 300);
    Vector3d mean(0, 0, 0);
    double most = 0.0;
    const Vector3d along(0.8660254037844386, 0, 0.5), normal(-0.5, 0, 0.8660254037844386);
    const double weight = 9.81 * simulation.clothModel(0).totalMass();
    const int steps = 200;
    for (int k = 0; k < steps; ++k)
    {
      ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
      mean += simulation.grasps().wrench(0).force / steps;
      most = std::max(most, std::abs(simulation.grasps().wrench(0).force.dot(along) + 0.5 * weight));
    }
    EXPECT_NEAR(mean.dot(along), -0.5 * weight, 2e-3 * weight);
    EXPECT_LT(most, 0.05 * weight);
    EXPECT_NEAR(mean.dot(normal), -0.866 * weight / 16, 0.05 * weight);
    EXPECT_NEAR(mean.y(), 0.0, 2e-3 * weight);
  }
}

TEST(ClothContact, ReportsCollisions)
{
  Simulation simulation(parseScene(one, "t", {"gravity=[0, 0, -2000]"}));
  const StepReport report = runApart(simulation, 20);
  EXPECT_GT(report.repulsions, 0);
  EXPECT_GT(report.impulses, 0);
}

/// What is called a cloth there is not rubber; and the ring's has really been pulled through.
TEST(ClothContact, ScenesOfFabricStretchLikeFabric)
{
  for (const char* name : {"twisted_cloth", "pulled_through_ring"})
  {
    SCOPED_TRACE(name);
    Simulation simulation(readScene(std::string(SLENDER_SOURCE_DIR) + "/config/scenes/" + name + ".yaml"));
    const TriangleMesh& mesh = simulation.config().cloths[0].mesh;
    const Eigen::Matrix3Xd& x = simulation.state().cloths[0].x;
    const int steps = static_cast<int>(std::lround(simulation.config().time.duration / simulation.config().time.step));
    double most = 0.0;
    long touching = 0;
    for (int k = 1; k <= steps; ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << report.message;
      touching += report.repulsions;
      for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
        for (int c = 0; c < 3; ++c)
        {
          const int a = mesh.triangles(c, f), b = mesh.triangles((c + 1) % 3, f);
          most =
              std::max(most, (x.col(b) - x.col(a)).norm() / (mesh.vertices.col(b) - mesh.vertices.col(a)).norm() - 1.0);
        }
      if (k % 20 == 0)
        ASSERT_EQ(intersectionsOf(simulation), 0u) << k;
    }
    // The folds depend on rounding errors: most is 0.12 by sweeps and 0.15 by factorisations, touching 2302 and 556.
    EXPECT_LT(most, 0.2);
    EXPECT_GT(touching, 300);
    if (!simulation.config().obstacles.empty())
      EXPECT_LT(x.row(2).maxCoeff(), -0.0288);   // all of it below the ring
  }
}

}   // namespace
}   // namespace slender
