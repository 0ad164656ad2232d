#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

/// Keys of a cloth for drag and lift, plasticity, and shapes other than the mesh.
namespace slender {
namespace {

using Eigen::Vector3d;

class ClothMaterial : public ::testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = std::filesystem::temp_directory_path() / ("slender_cloth_material_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    flat_ = gridMesh(0.2, 0.3, 5, 0, GridPattern::equilateral);
    writeMesh((folder_ / "flat.obj").string(), flat_);
    TriangleMesh roll = flat_;
    for (Eigen::Index i = 0; i < roll.vertices.cols(); ++i)
    {
      const double angle = flat_.vertices(1, i) / kRadius;
      roll.vertices.col(i) << flat_.vertices(0, i), kRadius * std::sin(angle), kRadius * (1 - std::cos(angle));
    }
    writeMesh((folder_ / "roll.obj").string(), roll);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  SceneConfig parse(const std::string& cloth, const std::string& rest = "")
  {
    return parseScene(rest + "cloths: [{" + cloth + "}]", "t", {}, folder_.string());
  }
  std::string problem(const std::string& cloth)
  {
    try
    {
      parse(cloth);
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }

  static constexpr double kRadius = 0.08;
  std::filesystem::path folder_;
  TriangleMesh flat_;
};

TEST_F(ClothMaterial, ReadsAirAndPlasticity)
{
  const ClothConfig c =
      parse(
          "mesh: {file: flat.obj}, bending: {model: hinge}, aerodynamics: {air_density: 1.3, drag: 1.1, lift: 0.4}, "
          "plasticity: {yield_curvature: 5, hardening: 0.2, creep_time: 0.1}")
          .cloths[0];
  EXPECT_EQ(c.aerodynamics.air_density, 1.3);
  EXPECT_EQ(c.aerodynamics.drag, 1.1);
  EXPECT_EQ(c.aerodynamics.lift, 0.4);
  EXPECT_EQ(c.plasticity.yield_curvature, 5);
  EXPECT_EQ(c.plasticity.hardening, 0.2);
  EXPECT_EQ(c.plasticity.creep_time, 0.1);
  const ClothConfig bare = parse("mesh: {file: flat.obj}").cloths[0];
  EXPECT_EQ(bare.aerodynamics.drag, 0.0);
  EXPECT_EQ(bare.aerodynamics.lift, 0.0);
  EXPECT_FALSE(std::isfinite(bare.plasticity.yield_curvature));
  EXPECT_EQ(bare.start.cols(), 0);
  EXPECT_EQ(bare.undeformed.cols(), 0);
}

TEST_F(ClothMaterial, NamesWhatIsWrong)
{
  const std::string flat = "mesh: {file: flat.obj}, ", hinge = flat + "bending: {model: hinge}, ";
  writeMesh((folder_ / "small.obj").string(), gridMesh(0.2, 0.3, 4, 0, GridPattern::equilateral));
  TriangleMesh turned = flat_;
  turned.triangles.col(3) = Eigen::Vector3i(turned.triangles.col(3).reverse());
  writeMesh((folder_ / "turned.obj").string(), turned);
  TriangleMesh fewer = flat_;
  fewer.triangles.conservativeResize(3, flat_.triangles.cols() - 1);
  writeMesh((folder_ / "fewer.obj").string(), fewer);
  TriangleMesh needle = flat_;
  needle.vertices.col(needle.triangles(0, 0)) =
      0.5 * (needle.vertices.col(needle.triangles(1, 0)) + needle.vertices.col(needle.triangles(2, 0)));
  writeMesh((folder_ / "needle.obj").string(), needle);
  const std::pair<std::string, const char*> cases[] = {
      {flat + "plasticity: {yield_curvature: 5}",
       "cloths.0.plasticity: needs rest angles that can flow, which only bending: {model: hinge} has"},
      {hinge + "plasticity: {hardening: 5}", "yield_curvature"},
      {hinge + "plasticity: {yield_curvature: -1}", "cloths.0.plasticity.yield_curvature = -1"},
      {hinge + "plasticity: {yield_curvature: 1, creep_time: -1}", "cloths.0.plasticity.creep_time = -1"},
      {hinge + "plasticity: {yield: 1, yield_curvature: 1}", "unknown key"},
      {flat + "aerodynamics: {drag: -1}", "cloths.0.aerodynamics.drag = -1"},
      {flat + "aerodynamics: {air_density: 0}", "cloths.0.aerodynamics.air_density = 0"},
      {flat + "bending: {model: conforming}, undeformed: {file: roll.obj}",
       "cloths.0.undeformed: gives angles at rest, which this bending model does not have"},
      {flat + "bending: {model: none}, undeformed: {file: roll.obj}",
       "cloths.0.undeformed: gives angles at rest, which this bending model does not have"},
      {hinge.substr(0, hinge.size() - 3) + ", poissons_ratio: 0.3}",
       "cloths.0.bending.poissons_ratio = 0.3: is for bending: {model: isometric}"},
      {flat + "bending: {poissons_ratio: 1}",
       "cloths.0.bending.poissons_ratio = 1: is out of range; must be a number in (-1, 1)"},
      {hinge + "undeformed: {file: small.obj}", "cloths.0.undeformed.file = small.obj: small.obj has"},
      {hinge + "undeformed: {file: small.obj}", "vertices, the cloth's mesh has"},
      {hinge + "start: {file: fewer.obj}", "triangles, the cloth's mesh has"},
      {hinge + "start: {file: turned.obj}", "turned.obj: triangle 3 has the vertices"},
      {hinge + "start: {file: needle.obj}", "no area"},
      {hinge + "start: {file: nowhere.obj}", "nowhere.obj: cannot"},
      {hinge + "start: {file: flat.obj, scale: 1e6, pose: {position: [1e6, 0, 0]}}", "has coordinates beyond"},
  };
  for (const auto& [cloth, expected] : cases)
    EXPECT_NE(problem(cloth).find(expected), std::string::npos) << cloth << "\ngave: " << problem(cloth);
}

/// Least squares [m]: radius of the circle through the (y, z) of the vertices.
double radiusOf(const Eigen::Matrix3Xd& x)
{
  Eigen::MatrixXd a(x.cols(), 3);
  a << x.row(1).transpose(), x.row(2).transpose(), Eigen::VectorXd::Ones(x.cols());
  const Eigen::VectorXd b = x.row(1).cwiseAbs2() + x.row(2).cwiseAbs2();
  const Vector3d s = a.colPivHouseholderQr().solve(b);
  return std::sqrt(s[2] + 0.25 * (s[0] * s[0] + s[1] * s[1]));
}

TEST_F(ClothMaterial, CurlsToItsUndeformedShape)
{
  Simulation simulation(
      parse("mesh: {file: flat.obj}, undeformed: {file: roll.obj}, bending: {model: hinge, modulus: 1e-3}, damping: "
            "{mass: 10, stiffness: 0.002}",
            "gravity: [0, 0, 0]\ntime: {step: 0.02, duration: 1}\n"));
  const double bent = simulation.clothEnergies(0).bending;
  for (int k = 0; k < 1000; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
  }
  const Eigen::Matrix3Xd& x = simulation.state().cloths[0].x;
  EXPECT_LT(simulation.clothEnergies(0).bending, 1e-4 * bent);
  // lengths are those of the flat mesh: rows become chords, not arcs, of height h with the angle h / R between them
  const double h = 0.3 / 9;
  EXPECT_NEAR(radiusOf(x), 0.5 * h / std::sin(0.5 * h / kRadius), 1e-5);
  EXPECT_NEAR(radiusOf(x), kRadius, 0.01 * kRadius);
}

TEST_F(ClothMaterial, StartsFromAnotherShape)
{
  const SceneConfig scene = parse(
      "mesh: {file: flat.obj}, start: {file: roll.obj, pose: {position: [1, 2, 3]}}, grasps: {g: {near: {point: [1, 2, "
      "3]}}}",
      "gravity: [0, 0, 0]\n");
  Simulation simulation(scene);
  const Eigen::Matrix3Xd& x = simulation.state().cloths[0].x;
  EXPECT_LT((x.col(0) - Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_EQ(scene.cloths[0].grasps[0].vertices, std::vector<int>{0});
  EXPECT_EQ(simulation.clothModel(0).rest.vertices, flat_.vertices);
  EXPECT_GT(simulation.clothEnergies(0).bending, 0.0);   // it was bent
  ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  EXPECT_GT(simulation.state().cloths[0].v.norm(), 1e-3);
}

TEST_F(ClothMaterial, PlasticFlowRestartsBitEqual)
{
  const std::string cloth =
      "mesh: {file: flat.obj}, start: {file: roll.obj}, bending: {model: hinge, modulus: 1e-4}, aerodynamics: {drag: "
      "1, lift: 0.5}, "
      "plasticity: {yield_curvature: 1, hardening: 0.1, creep_time: 0.2}, grasps: {g: {vertices: [0, 1]}}";
  const std::string wind = "wind: {velocity: [0, 1, 4]}\n", path = (folder_ / "state").string();
  Simulation simulation(parse(cloth, wind));
  for (int k = 0; k < 8; ++k)
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  simulation.save(path);
  const ClothState saved = simulation.state().cloths[0];
  for (int k = 0; k < 8; ++k)
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  Simulation again(parse(cloth, wind));
  again.load(path);
  EXPECT_EQ(again.state().cloths[0].stiffening, saved.stiffening);
  for (int k = 0; k < 8; ++k)
    ASSERT_TRUE(again.step(again.defaultInputs()).ok);
  const ClothState &a = simulation.state().cloths[0], &b = again.state().cloths[0];
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.rest_angles, b.rest_angles);
  EXPECT_EQ(a.stiffening, b.stiffening);
  EXPECT_NE(a.rest_angles, saved.rest_angles);
  EXPECT_GT(a.stiffening.maxCoeff(), 1.01);
  Simulation other(parse(
      cloth.substr(0, cloth.find("hardening")) + "hardening: 0.2, creep_time: 0.2}, grasps: {g: {vertices: [0, 1]}}",
      wind));
  EXPECT_THROW(other.load(path), std::runtime_error);
}

}   // namespace
}   // namespace slender
