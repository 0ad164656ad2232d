// Tracked cloths whose guide is another cloth of the scene; numbered frames; undeformed shapes.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_offsets.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// A sheet that falls from where one corner is held, and a finer one that does as it does.
std::string previewed(const std::string& contact = "", const std::string& more = "")
{
  const std::string traits =
      "    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}\n    bending: {model: hinge}\n    "
      "solver: {one_newton_step: true}\n" +
      (contact.empty() ? "" : "    contact: " + contact + "\n");
  return "name: previewed\ntime: {step: 0.01, duration: 1}\ncloths:\n  - name: coarse\n"
         "    grid: {corner: [0, 0, 0.3], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [2, 2], pattern: alternating}\n    "
         "grasps: {corner: {vertices: [0]}}\n" +
         traits + "tracked:\n  - name: fine\n    guide: {cloth: coarse}\n    mesh: {subdivide: 2}\n" + traits + more;
}

const char* const kObstacleBall =
    "obstacles: [{name: ball, shape: {sphere: {radius: 0.1}}, pose: {position: [0.25, 0.25, 0.15]}}]\n";

class TrackedPreviews : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_previews_" + std::to_string(getpid());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string problems(const std::string& text) const
  {
    try
    {
      parseScene(text, "t", {}, folder_);
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }

  std::string folder_;
};

TEST_F(TrackedPreviews, FollowTheClothOfTheSameInstant)
{
  for (const bool contact : {false, true})
  {
    const std::string text = contact ? previewed("{thickness: 0.004, cloths: true}", kObstacleBall) : previewed();
    Simulation simulation(parseScene(text, "t"));
    const SceneState& state = simulation.state();
    ASSERT_EQ(state.cloths[1].x.cols(), 81);
    EXPECT_FALSE(simulation.config().cloths[1].tracking->guide.byTopic());
    EXPECT_TRUE(state.cloth_guides[1].points == state.cloths[0].x);
    // the preview is as it is alone: what tracks it does not touch it
    const std::string alone_text = text.substr(0, text.find("tracked:")) + (contact ? kObstacleBall : "");
    Simulation alone(parseScene(alone_text, "t"));
    for (int k = 0; k < 60; ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << report.message;
      ASSERT_TRUE(alone.step(alone.defaultInputs()).ok);
      EXPECT_LT(report.tracking_error, contact ? 2e-12 : 1e-13) << k;
      EXPECT_TRUE(state.cloth_guides[1].points == state.cloths[0].x) << k;
      EXPECT_TRUE(state.cloths[0].x == alone.state().cloths[0].x) << k;
    }
    EXPECT_LT(state.cloths[0].x(2, 8), 0.25);   // it fell
    // averages are followed, not points
    EXPECT_GT((state.cloths[1].x.leftCols(9) - state.cloths[0].x).cwiseAbs().maxCoeff(), 1e-4);
  }
}

TEST_F(TrackedPreviews, RestartExactly)
{
  const std::string text = previewed("{thickness: 0.004}", kObstacleBall);
  Simulation one(parseScene(text, "t")), two(parseScene(text, "t"));
  for (int k = 0; k < 25; ++k)
    ASSERT_TRUE(one.step(one.defaultInputs()).ok);
  one.save(folder_ + "/state");
  two.load(folder_ + "/state");
  for (int k = 0; k < 15; ++k)
  {
    ASSERT_TRUE(one.step(one.defaultInputs()).ok);
    ASSERT_TRUE(two.step(two.defaultInputs()).ok);
    for (int c = 0; c < 2; ++c)
    {
      ASSERT_TRUE(one.state().cloths[c].x == two.state().cloths[c].x) << k;
      ASSERT_TRUE(one.state().cloths[c].v == two.state().cloths[c].v) << k;
    }
    ASSERT_TRUE(one.state().cloth_guides[1].points == two.state().cloth_guides[1].points);
    ASSERT_TRUE(one.state().cloth_guides[1].forces == two.state().cloth_guides[1].forces);
  }
  one.reset();
  EXPECT_TRUE(one.state().cloth_guides[1].points == one.state().cloths[0].x);
}

TEST_F(TrackedPreviews, StayWhereTheyWereWhenAStepFails)
{
  Simulation simulation(parseScene(previewed(), "t"));
  ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  const SceneState before = simulation.state();
  SceneInputs inputs = simulation.defaultInputs();
  inputs.grasps[0].X_WG.position.x() = NAN;
  EXPECT_FALSE(simulation.step(inputs).ok);
  for (int c = 0; c < 2; ++c)
    EXPECT_TRUE(simulation.state().cloths[c].x == before.cloths[c].x);
  EXPECT_TRUE(simulation.state().cloth_guides[1].points == before.cloth_guides[1].points);
}

TEST_F(TrackedPreviews, SayWhatIsWrong)
{
  const auto with = [](const std::string& guide) {
    std::string text = previewed();
    return text.replace(text.find("{cloth: coarse}"), 15, guide);
  };
  EXPECT_NE(problems(with("{cloth: other}")).find("the scene's cloths are: coarse"), std::string::npos);
  EXPECT_NE(problems(with("{cloth: fine}")).find("there is no such cloth"), std::string::npos);
  EXPECT_NE(problems(with("{cloth: coarse, motion: fixed}")).find("does not go with cloth"), std::string::npos);
  EXPECT_NE(problems(with("{}")).find("cloth: NAME"), std::string::npos);
  EXPECT_NE(problems("tracked:\n  - {guide: {cloth: coarse}}\n").find("the scene has no cloths"), std::string::npos);
  EXPECT_NE(
      problems(with("{grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 2}, motion: {bag: none.bag}}"))
          .find("a program that reads bags"),
      std::string::npos);
}

TEST_F(TrackedPreviews, FramesAreTheNumberedOnes)
{
  const TriangleMesh mesh = gridMesh(0.4, 0.4, 2, 2, GridPattern::alternating);
  const auto frame = [&](const std::string& name) { writeObj(folder_ + "/" + name, mesh); };
  const auto scene = [](const std::string& pattern) {
    return "tracked:\n  - guide: {mesh: {file: rest.obj}, motion: {frames: \"" + pattern +
           "\", rate: 20}}\n    mesh: {subdivide: 1}\n";
  };
  frame("rest.obj");
  frame("f_08.obj");
  frame("f_09.obj");
  frame("f_10.obj");
  EXPECT_EQ(problems(scene("f_*.obj")), "");
  frame("f_12.obj");
  EXPECT_NE(problems(scene("f_*.obj")).find("frame 11 is missing between"), std::string::npos)
      << problems(scene("f_*.obj"));
  std::filesystem::remove(folder_ + "/f_09.obj");
  EXPECT_EQ(problems(scene("f_*.obj")), "");   // every second one
  frame("f_11.obj");
  EXPECT_NE(problems(scene("f_*.obj")).find("frame 9 is missing between"), std::string::npos)
      << problems(scene("f_*.obj"));
  std::filesystem::remove(folder_ + "/f_11.obj");
  frame("f_8.obj");
  EXPECT_NE(problems(scene("f_*.obj")).find("are the same frame"), std::string::npos);
  std::filesystem::remove(folder_ + "/f_8.obj");
  frame("f_old.obj");
  EXPECT_NE(problems(scene("f_*.obj")).find("f_old.obj matches, but has no frame's number"), std::string::npos);
  EXPECT_NE(problems(scene("nowhere/f_*.obj")).find("there is no folder"), std::string::npos);
  std::ofstream(folder_ + "/loose.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 5 5 5\nf 1 2 3\n";
  EXPECT_NE(problems("tracked:\n  - guide: {mesh: {file: loose.obj}}\n    mesh: {subdivide: 1}\n").find("loose.obj"),
            std::string::npos);
}

TEST_F(TrackedPreviews, UndeformedShapesAreMadeFromTheMesh)
{
  const auto undeformed = [this](const std::string& shape) {
    const std::string text =
        "cloths:\n  - grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 20, pattern: alternating}\n    "
        "bending: {model: hinge, modulus: 1e-4}\n"
        "    undeformed: " +
        shape + "\n";
    return parseScene(text, "t", {}, folder_).cloths[0];
  };
  const ClothConfig folds = undeformed("{folds: {along: [1, 0, 0], wavelength: 0.5, height: 0.02}}");
  for (Eigen::Index i = 0; i < folds.mesh.vertices.cols(); ++i)
    EXPECT_NEAR(folds.undeformed(2, i), 0.02 * std::sin(4 * M_PI * folds.mesh.vertices(0, i)), 1e-12);
  const ClothConfig ridges = undeformed("{ridges: {axis: [0, 0, 1], count: 4, height: 0.01}}");
  for (Eigen::Index i = 0; i < ridges.mesh.vertices.cols(); ++i)   // a quarter turn about the centre is one ridge
  {
    const Vector3d p = ridges.mesh.vertices.col(i), turned(1 - p.y(), p.x(), 0);
    Eigen::Index j;
    ASSERT_LT((ridges.mesh.vertices.colwise() - turned).colwise().norm().minCoeff(&j), 1e-9);
    if ((p - Vector3d(0.5, 0.5, 0)).norm() > 0.01)
      EXPECT_NEAR(ridges.undeformed(2, i), ridges.undeformed(2, j), 1e-9);
  }
  EXPECT_GT(ridges.undeformed.row(2).maxCoeff(), 0.0099);
  const ClothConfig crinkles = undeformed("{crinkles: {height: 0.03, seed: 5}}");
  EXPECT_LE(crinkles.undeformed.row(2).cwiseAbs().maxCoeff(), 0.03);
  EXPECT_NEAR(std::sqrt(crinkles.undeformed.row(2).squaredNorm() / 441), 0.03 / std::sqrt(3.0), 0.002);
  EXPECT_TRUE(crinkles.undeformed == crinkled(crinkles.mesh, 0.03, 5));
  const ClothConfig longer = undeformed("{crinkles: {height: 0.03, seed: 5}, lengths: true}");
  EXPECT_TRUE(longer.mesh.vertices == crinkles.undeformed);
  EXPECT_TRUE(longer.start == crinkles.mesh.vertices);
  EXPECT_EQ(longer.undeformed.cols(), 0);
  const auto refused = [&](const std::string& shape) -> std::string {
    try
    {
      undeformed(shape);
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  };
  // edges of 0.05 and 0.05 sqrt(2) m, 0.057 on average
  EXPECT_NE(refused("{folds: {wavelength: 0.5, height: 0.1}}").find("along"), std::string::npos);
  EXPECT_NE(refused("{folds: {along: [0, 0, 1], wavelength: 0.5, height: 0.1}}")
                .find("gets no folds; take a direction within the cloth"),
            std::string::npos);
  EXPECT_NE(refused("{folds: {along: [1, 0, 0], wavelength: 0.22, height: 0.1}}")
                .find("undeformed.folds.wavelength = 0.22: is less than 4 edges"),
            std::string::npos)
      << refused("{folds: {along: [1, 0, 0], wavelength: 0.22, height: 0.1}}");
  EXPECT_EQ(refused("{folds: {along: [1, 0, 0], wavelength: 0.23, height: 0.1}}"), "");
  const std::string ridged = refused("{ridges: {count: 12, height: 0.01}}");
  EXPECT_NE(ridged.find("undeformed.ridges.count = 12: makes ridges of less than 4 edges"), std::string::npos)
      << ridged;
  EXPECT_NE(ridged.find("take 11 or fewer"), std::string::npos) << ridged;
  EXPECT_EQ(refused("{ridges: {count: 11, height: 0.01}}"), "");
  EXPECT_THROW(undeformed("{folds: {wavelength: 0.5}}"), SceneError);
  EXPECT_THROW(undeformed("{folds: {wavelength: 0.5, height: 0.1, along: [0, 0, 0]}}"), SceneError);
  EXPECT_THROW(undeformed("{folds: {wavelength: 0.5, height: 0.1}, crinkles: {height: 0.1}}"), SceneError);
}

}   // namespace
}   // namespace slender
