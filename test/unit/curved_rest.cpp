// Cloths that are curved at rest: none is flattened. They bend by hinges, or are refused.
#include <cmath>
#include <filesystem>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender::test {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// Half of a cylinder of radius 0.2 m: 0.4 m wide.
TriangleMesh halfCylinder()
{
  TriangleMesh mesh = gridMesh(0.2 * M_PI, 0.2, 16, 0, GridPattern::equilateral);
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
  {
    const double angle = mesh.vertices(0, i) / 0.2;
    mesh.vertices.col(i) = Vector3d(-0.2 * std::cos(angle), mesh.vertices(1, i), 0.2 * std::sin(angle));
  }
  return mesh;
}

TriangleMesh tiltedSheet()
{
  TriangleMesh mesh = gridMesh(0.4, 0.3, 12, 0, GridPattern::irregular);
  mesh.vertices =
      (Eigen::AngleAxisd(0.8, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix() * mesh.vertices).colwise() +
      Vector3d(1, 2, 3);
  return mesh;
}

double widthOf(const Matrix3Xd& x) { return x.row(0).maxCoeff() - x.row(0).minCoeff(); }

std::shared_ptr<ClothModel> shellOf(const TriangleMesh& mesh, BendingModel bending)
{
  auto model = std::make_shared<ClothModel>(buildCloth("shell", mesh, 0.15, isotropicMembrane(1e6, 0.3, 3e-4)));
  model->bending = bending;
  model->bending_modulus = 1e-3;
  return model;
}

std::string refusal(const std::shared_ptr<ClothModel>& model, const ClothOptions& options = {})
{
  try
  {
    ClothStepper stepper(model, options);
  }
  catch (const std::invalid_argument& error)
  {
    return error.what();
  }
  return "";
}

TEST(CurvedRest, SteppersRefuseConstantMatricesOfCurvedShapes)
{
  for (const BendingModel bending : {BendingModel::isometric_nonconforming, BendingModel::isometric_conforming})
  {
    EXPECT_NE(refusal(shellOf(halfCylinder(), bending)).find("its shape at rest is curved"), std::string::npos);
    EXPECT_NE(refusal(shellOf(halfCylinder(), bending)).find("bending: {model: hinge}"), std::string::npos);
    EXPECT_EQ(refusal(shellOf(tiltedSheet(), bending)), "");
    auto rolled = shellOf(gridMesh(0.2 * M_PI, 0.2, 16, 0, GridPattern::equilateral), bending);
    EXPECT_EQ(refusal(rolled), "");
    rolled->undeformed = halfCylinder().vertices;
    EXPECT_NE(refusal(rolled).find("its shape at rest is curved"), std::string::npos);
    auto flattened = shellOf(halfCylinder(), bending);   // flat angles at rest: the matrix is right
    flattened->undeformed = gridMesh(0.2 * M_PI, 0.2, 16, 0, GridPattern::equilateral).vertices;
    EXPECT_EQ(refusal(flattened), "");
    auto limp = shellOf(halfCylinder(), bending);   // does not bend at all
    limp->bending_modulus = 0;
    EXPECT_EQ(refusal(limp), "");
  }
}

/// The sheet is 0.5 m long, so that the limit is 1e-6 m.
TEST(CurvedRest, RoundingOfFilesBendsNothing)
{
  const auto rounded = [](double unit) {
    TriangleMesh mesh = tiltedSheet();
    mesh.vertices = unit * (mesh.vertices / unit).array().round().matrix();
    return restsFlat(*shellOf(mesh, BendingModel::isometric_nonconforming));
  };
  EXPECT_TRUE(rounded(1e-9));
  EXPECT_TRUE(rounded(1e-6));
  EXPECT_FALSE(rounded(1e-5));
}

TEST(CurvedRest, FoldsAndSmallBumpsAreCurved)
{
  TriangleMesh bump = gridMesh(0.4, 0.3, 12, 0, GridPattern::equilateral);
  bump.vertices(2, 60) += 2e-6;
  EXPECT_FALSE(restsFlat(*shellOf(bump, BendingModel::isometric_nonconforming)));
  TriangleMesh folded;   // two triangles that lie on each other
  folded.vertices.resize(3, 4);
  folded.vertices << 0, 1, 0, 0.9, 0, 0, 1, 0.9, 0, 0, 0, 0;
  folded.triangles.resize(3, 2);
  folded.triangles << 0, 2, 1, 1, 2, 3;
  const auto model = shellOf(folded, BendingModel::isometric_nonconforming);
  EXPECT_TRUE(restsFlat(*model));
  folded.vertices.col(3) = Vector3d(0.1, 0.1, 0.0);
  EXPECT_FALSE(restsFlat(*shellOf(folded, BendingModel::isometric_nonconforming)));
}

TEST(CurvedRest, RatiosOfBendingBelongToIsometricBendingOfFlatShapes)
{
  for (const BendingModel bending : {BendingModel::none, BendingModel::hinge, BendingModel::isometric_conforming})
  {
    auto model = shellOf(tiltedSheet(), bending);
    model->bending_poissons_ratio = 0.3;
    EXPECT_NE(refusal(model).find("leave poissons_ratio out"), std::string::npos) << toString(bending);
  }
  auto model = shellOf(tiltedSheet(), BendingModel::isometric_nonconforming);
  for (const double bad : {-1.0, 1.0, std::nan("")})
  {
    model->bending_poissons_ratio = bad;
    EXPECT_NE(refusal(model).find("must be in (-1, 1)"), std::string::npos) << bad;
  }
  model->bending_poissons_ratio = 0.35;
  EXPECT_EQ(refusal(model), "");
}

/// Every solver and integrator with a Poisson's ratio of bending gives what the direct one does.
TEST(CurvedRest, RatiosOfBendingReachAllSolvers)
{
  const auto bent = [](ClothSolver solver, bool with_ratio) {
    auto model = shellOf(gridMesh(0.4, 0.3, 8, 0, GridPattern::equilateral), BendingModel::isometric_nonconforming);
    if (with_ratio)
      model->bending_poissons_ratio = 0.5;
    ClothState state = makeClothState(*model, model->rest.vertices);
    state.v.row(2) = 20.0 * state.x.row(0).cwiseProduct(state.x.row(1));   // a twist, of which the ratio makes most
    ClothOptions options;
    options.solver = solver;
    options.linear_tolerance = 1e-8;
    ClothStepper stepper(model, options);
    for (int k = 0; k < 5; ++k)
      EXPECT_TRUE(stepper.step(state, {}, 0.005).ok);
    return state.x;
  };
  const Matrix3Xd direct = bent(ClothSolver::cholesky, true);
  // Newton's tolerance: 5e-8 m
  EXPECT_LT((bent(ClothSolver::gauss_seidel, true) - direct).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_GT((bent(ClothSolver::cholesky, false) - direct).cwiseAbs().maxCoeff(), 1e-4);
}

class CurvedScenes : public ::testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = std::filesystem::temp_directory_path() / ("slender_curved_rest_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    writeMesh((folder_ / "roll.obj").string(), halfCylinder());
    writeMesh((folder_ / "flat.obj").string(), gridMesh(0.2 * M_PI, 0.2, 16, 0, GridPattern::equilateral));
    writeMesh((folder_ / "tilted.obj").string(), tiltedSheet());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Simulation scene(const std::string& cloth, const std::string& rest = "", const std::string& kind = "cloths")
  {
    return Simulation(
        parseScene("gravity: [0, 0, 0]\n" + rest + kind + ": [{" + cloth + "}]", "t", {}, folder_.string()));
  }
  std::string problem(const std::string& cloth, const std::string& rest = "")
  {
    try
    {
      scene(cloth, rest);
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
};

/// Isometric bending, which acts on positions, opens it to 0.62 m within half a second.
TEST_F(CurvedScenes, AHalfCylinderStaysOneAndTheSceneSaysHowItBends)
{
  for (const char* kind : {"cloths", "tracked"})
  {
    const std::string tracked = "guide: {mesh: {file: roll.obj}, motion: fixed}, mesh: {subdivide: 1}, ";
    Simulation simulation =
        scene(std::string(*kind == 't' ? tracked : "mesh: {file: roll.obj}, ") + "bending: {modulus: 0.001}", "", kind);
    ASSERT_EQ(simulation.config().warnings.size(), 1u) << kind;
    EXPECT_NE(simulation.config().warnings[0].find("so it bends by hinges"), std::string::npos);
    const Matrix3Xd start = simulation.state().cloths[0].x;
    ASSERT_NEAR(widthOf(start), 0.4, 1e-3);
    for (int k = 0; k < 50; ++k)
      ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
    // the issue: 1e-9 of its size
    EXPECT_LT((simulation.state().cloths[0].x - start).cwiseAbs().maxCoeff(), 1e-10) << kind;
  }
}

TEST_F(CurvedScenes, WhatIsChosenIsWhatHingesDo)
{
  Simulation chosen = scene("mesh: {file: flat.obj}, undeformed: {file: roll.obj}, bending: {modulus: 0.001}");
  Simulation asked =
      scene("mesh: {file: flat.obj}, undeformed: {file: roll.obj}, bending: {model: hinge, modulus: 0.001}");
  EXPECT_EQ(chosen.config().warnings.size(), 1u);
  EXPECT_EQ(asked.config().warnings.size(), 0u);
  for (int k = 0; k < 10; ++k)
  {
    ASSERT_TRUE(chosen.step(chosen.defaultInputs()).ok);
    ASSERT_TRUE(asked.step(asked.defaultInputs()).ok);
  }
  EXPECT_EQ(chosen.state().cloths[0].x, asked.state().cloths[0].x);
  EXPECT_LT(widthOf(chosen.state().cloths[0].x), 0.625);   // it has begun to curl, from 0.628
}

TEST_F(CurvedScenes, FlatShapesKeepTheirMatrix)
{
  for (const char* cloth :
       {"mesh: {file: tilted.obj}", "mesh: {file: flat.obj}", "mesh: {file: roll.obj}, undeformed: {file: flat.obj}",
        "mesh: {file: roll.obj}, bending: {model: none}", "mesh: {file: roll.obj}, bending: {modulus: 0}",
        "mesh: {file: flat.obj}, bending: {poissons_ratio: 0.35}"})
  {
    const Simulation simulation = scene(cloth);
    EXPECT_TRUE(simulation.config().warnings.empty()) << cloth;
    EXPECT_EQ(simulation.state().cloths[0].rest_angles.size(), 0) << cloth;   // hinges have them
  }
}

TEST_F(CurvedScenes, OthersAreRefusedWithTheFix)
{
  EXPECT_NE(problem("mesh: {file: roll.obj}, bending: {model: conforming}").find("use bending: {model: hinge}"),
            std::string::npos);
  EXPECT_NE(problem("mesh: {file: roll.obj}, bending: {model: conforming}, contact: {thickness: 0.001}")
                .find("use bending: {model: hinge}"),
            std::string::npos);
  EXPECT_NE(problem("mesh: {file: roll.obj}", "time: {integrator: imex}\n")
                .find("only isometric bending of a flat rest shape has"),
            std::string::npos);
  EXPECT_NE(problem("mesh: {file: roll.obj}, bending: {poissons_ratio: 0.3}").find("its shape at rest is curved"),
            std::string::npos);
}

TEST_F(CurvedScenes, MeshesOnWhichARatioIsInexactAreWarnedOf)
{
  const Simulation simulation = scene("mesh: {file: tilted.obj}, bending: {poissons_ratio: 0.35}");
  ASSERT_EQ(simulation.config().warnings.size(), 1u);
  EXPECT_NE(simulation.config().warnings[0].find("this mesh resists some curvatures"), std::string::npos);
}

/// D = E h^3 / (12 (1 - nu^2)) with the ratio of bending, if there is one.
TEST_F(CurvedScenes, TheModulusComesWithTheRatioOfBending)
{
  const auto modulus = [&](const std::string& bending) {
    return parseScene(
               "cloths: [{mesh: {file: flat.obj}, material: {youngs_modulus: 1e6, thickness: 0.001, poissons_ratio: "
               "0.3}" +
                   bending + "}]",
               "t", {}, folder_.string())
        .cloths[0]
        .bending_modulus;
  };
  EXPECT_NEAR(modulus(""), 1e-3 / (12 * (1 - 0.09)), 1e-12);
  EXPECT_NEAR(modulus(", bending: {poissons_ratio: 0.5}"), 1e-3 / (12 * 0.75), 1e-12);
}

}   // namespace
}   // namespace slender::test
