// Scenes with tracked cloths: reading, stepping, restart.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/recorder.h"
#include "slender_sim/scene/simulation.h"

namespace slender {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

const char* const flap = R"(
name: flap
time: {step: 0.01, duration: 1}
tracked:
  - name: flap
    guide:
      grid: {corner: [0, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [2, 2], pattern: alternating}
      motion: fixed
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5}
    bending: {model: hinge}
    solver: {one_newton_step: true}
)";

class TrackedScenes : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_tracked_" + std::to_string(getpid());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ + "/" + name) << text; }

  /// Frames of the guide's grid that wave; returns the rest.
  TriangleMesh writeFrames(int count) const
  {
    TriangleMesh mesh = gridMesh(0.4, 0.4, 2, 2, GridPattern::alternating);
    writeObj(folder_ + "/rest.obj", mesh);
    const Matrix3Xd rest = mesh.vertices;
    for (int k = 0; k < count; ++k)
    {
      mesh.vertices = wave(rest, k / 20.0);
      // not in the order of their names: 10 comes after 9
      writeObj(folder_ + "/frame_" + std::to_string(k) + ".obj", mesh);
    }
    mesh.vertices = rest;
    return mesh;
  }
  static Matrix3Xd wave(const Matrix3Xd& rest, double t)
  {
    Matrix3Xd x = rest;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x(2, i) += 0.05 * std::sin(8.0 * t + 5.0 * rest(0, i)) * std::min(1.0, 4.0 * t);
    return x;
  }

  std::string problems(const std::vector<std::string>& overrides) const
  {
    try
    {
      parseScene(flap, "t", overrides, folder_);
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }

  std::string folder_;
};

TEST_F(TrackedScenes, AreReadWithDefaults)
{
  const SceneConfig scene = parseScene(flap, "t");
  ASSERT_EQ(scene.cloths.size(), 1u);
  const ClothConfig& c = scene.cloths[0];
  ASSERT_TRUE(c.tracking);
  EXPECT_EQ(c.mesh.vertices.cols(), 81);
  EXPECT_EQ(c.tracking->sets[0].functions.count(), 9);
  EXPECT_EQ(c.tracking->sets[0].constraints->count(), 9);
  EXPECT_NEAR(c.tracking->size, 0.4 * std::sqrt(2.0), 1e-12);
  EXPECT_FALSE(c.tracking->guide.byTopic());
  EXPECT_LT((c.start - c.mesh.vertices).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_EQ(c.start_velocity.cwiseAbs().maxCoeff(), 0.0);
  EXPECT_TRUE(c.grid.has_value());   // edges and corners can be held
  EXPECT_EQ(scene.time.integrator, Integrator::implicit_euler);
}

TEST_F(TrackedScenes, SayWhatIsWrong)
{
  writeFrames(3);
  write("poses.csv", "t,body,x,y,z,qx,qy,qz,qw\n0,hand,0,0,0,0,0,0,1\n1,hand,0,0,1,0,0,0,1\n");
  TriangleMesh other = gridMesh(0.4, 0.4, 3, 2, GridPattern::alternating);
  writeObj(folder_ + "/other.obj", other);
  writeObj(folder_ + "/mixed_0.obj", gridMesh(0.4, 0.4, 2, 2, GridPattern::alternating));
  writeObj(folder_ + "/mixed_1.obj", other);
  const std::string t = "tracked.0.", m = t + "guide.motion=";
  const struct
  {
    std::vector<std::string> set;
    const char* expected;
  } cases[] = {
      {{t + "guide={mesh: {file: none.obj}, motion: fixed}"}, "none.obj"},
      {{t + "guide={motion: fixed}"}, "must have one of mesh"},
      {{m + "{frames: \"frame_*.obj\"}"}, "motion.rate: is missing"},
      {{m + "{frames: \"none_*.obj\", rate: 30}"}, "no such file"},
      {{m + "{frames: frame.obj, rate: 30}"}, "must have one *"},
      {{m + "{frames: \"mixed_*.obj\", rate: 30}"}, "the guide's mesh has 9"},
      {{m + "{frames: \"frame_*.obj\", rate: 0}"}, "(0, 1000000] Hz"},
      {{m + "{bodies: poses.csv, groups: {hand: [0, 1, 2]}}"}, "vertex 3 is carried by no body"},
      {{m + "{bodies: poses.csv, groups: {foot: [0..8]}}"}, "has no body foot"},
      {{m + "{bodies: poses.csv}"}, "groups"},
      {{m + "{bodies: poses.csv, groups: obj}"}, "needs a mesh from an OBJ file"},
      {{m + "{topic: clouds}"}, "one of: points, bodies"},
      {{m + "{frames: \"frame_*.obj\", rate: 30, late: hold}"}, "is for guides by topic"},
      {{t + "mesh={subdivide: 0}"}, "[1, 10] levels"},
      {{t + "mesh={subdivide: 10}"}, "more than 1000000 vertices"},
      {{t + "mesh={file: other.obj}"}, "regions: {NAME"},
      {{t + "mesh={file: other.obj}", t + "test_functions={regions: {a: {guide: [0]}}}"}, "tracked"},
      {{t + "test_functions={basis: wavelet}"}, "one of: subdivision"},
      {{t + "test_functions={clusters: {count: 3}}"}, "take mesh: same"},
      {{t + "mesh=same", t + "test_functions={clusters: {count: 90}}"}, "number of faces"},
      {{t + "test_functions={regions: {left: {guide: [0, 1]}, again: {guide: [0, 1]}}}"}, "'again' depends on 'left'"},
      {{t + "test_functions={regions: {far: {guide: [77]}}}"}, "[-9, 8]"},
      {{t + "mesh=same", t + "grasps={all: {edge: left}}"}, "(on the vertices that are not held)"},
      {{t + "colour=red"}, "colour"},
      {{"cloths=[{name: flap, grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 2}}]"},
       "names must differ"},
  };
  for (const auto& c : cases)
  {
    const std::string text = problems(c.set);
    EXPECT_NE(text.find(c.expected), std::string::npos) << c.set.back() << "\n -> " << text;
    EXPECT_NE(text.find("tracked"), std::string::npos) << c.set.back() << "\n -> " << text;   // where
  }
  // what the stepper refuses has its place, too
  try
  {
    Simulation simulation(parseScene(flap, "t", {"tracked.0.solver={linear: cholesky}"}));
    ADD_FAILURE();
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("prescribed averages"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("tracked.0"), std::string::npos) << error.what();
  }
  EXPECT_NE(problems({"time.integrator=tr_bdf2"}).find("is not for the cloth of this scene; must be implicit_euler"),
            std::string::npos);
}

TEST_F(TrackedScenes, FollowFramesFromTheGuidesShapeAndVelocity)
{
  const TriangleMesh rest = writeFrames(21);
  const std::string motion =
      "tracked.0.guide={mesh: {file: rest.obj, scale: 2, pose: {position: [1, 0, 0]}}, motion: {frames: "
      "\"frame_*.obj\", rate: 20, begin: -0.3}}";
  Simulation simulation(parseScene(flap, "t", {motion}, folder_));
  const GuideConfig& guide = simulation.config().cloths[0].tracking->guide;
  Matrix3Xd x, v, before, after;
  guide.evaluate(0.0, x, &v);
  // begins in its seventh frame
  EXPECT_LT((x - (2.0 * wave(rest.vertices, 0.3)).colwise().operator+(Vector3d(1, 0, 0))).cwiseAbs().maxCoeff(), 1e-12);
  guide.evaluate(-1e-5, before);
  guide.evaluate(1e-5, after);
  EXPECT_LT((v - (after - before) / 2e-5).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_GT(v.cwiseAbs().maxCoeff(), 0.3);
  const ClothState& start = simulation.state().cloths[0];
  EXPECT_TRUE(start.x.leftCols(9) == x);   // the subdivision keeps the guide's vertices
  EXPECT_TRUE(start.v.leftCols(9) == v);
  EXPECT_LT(simulation.trackingError({ObjectRef::cloth, 0}).met, 1e-14);
  double travelled = 0.0;
  for (int k = 1; k <= 60; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_LT(report.tracking_error, 1e-13) << k;
    guide.evaluate(0.01 * k, x);
    EXPECT_LT((simulation.state().cloth_guides[0].points - x).cwiseAbs().maxCoeff(), 1e-12);
    travelled = std::max(travelled, (simulation.state().cloths[0].x - start.x).cwiseAbs().maxCoeff());
  }
  // the guide rests: its forces carry the weight
  for (int k = 0; k < 400; ++k)
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  const Vector3d total = simulation.state().cloth_guides[0].forces.rowwise().sum();
  EXPECT_NEAR(total.z(), 9.81 * simulation.clothModel(0).totalMass(),
              0.02 * 9.81 * simulation.clothModel(0).totalMass());
}

TEST_F(TrackedScenes, FollowBodies)
{
  // two bodies turn by the same motion: rigidly; with attach: frame the poses themselves
  std::string csv;
  for (int k = 0; k <= 20; ++k)
  {
    const double angle = 0.05 * k;
    for (const char* body : {"a", "b"})
      csv += std::to_string(0.05 * k) + "," + body + ",0.3," + std::to_string(0.02 * k) + ",0.1," +
             std::to_string(std::sin(angle / 2)) + ",0,0," + std::to_string(std::cos(angle / 2)) + "\n";
  }
  write("poses.csv", csv);
  const Matrix3Xd rest = gridMesh(0.4, 0.4, 2, 2, GridPattern::alternating).vertices;
  for (const bool initial : {true, false})
  {
    const std::string motion =
        std::string("tracked.0.guide.motion={bodies: poses.csv, groups: {a: [0..5], b: [3..8]}, attach: ") +
        (initial ? "initial" : "frame") + "}";
    Simulation simulation(parseScene(flap, "t", {motion}, folder_));
    const auto pose = [&](double t) {
      return Pose{{0.3, 0.4 * t, 0.1}, Eigen::Quaterniond(Eigen::AngleAxisd(t, Vector3d::UnitX()))};
    };
    for (int k = 1; k <= 50; ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << report.message;
      ASSERT_LT(report.tracking_error, 1e-13);
    }
    const Pose X = initial ? pose(0.5) * pose(0.0).inverse() : pose(0.5);
    for (Eigen::Index i = 0; i < rest.cols(); ++i)
      EXPECT_LT((simulation.state().cloth_guides[0].points.col(i) - X * Vector3d(rest.col(i))).norm(), 2e-6)
          << initial << " " << i;
    Matrix3Xd x, v, before, after;
    const GuideConfig& guide = simulation.config().cloths[0].tracking->guide;
    guide.evaluate(0.52, x, &v);
    guide.evaluate(0.52 - 1e-5, before);
    guide.evaluate(0.52 + 1e-5, after);
    EXPECT_LT((v - (after - before) / 2e-5).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST_F(TrackedScenes, StartAsFastAsTheirFrames)
{
  TriangleMesh mesh = writeFrames(0);
  const Matrix3Xd rest = mesh.vertices;
  for (int k = 0; k < 8; ++k)
  {
    mesh.vertices = rest.colwise() + Vector3d(0.02 * k, 0, 0);
    writeObj(folder_ + "/frame_" + std::to_string(k) + ".obj", mesh);
  }
  const auto guide = [](const char* begin) {
    return std::string("tracked.0.guide={mesh: {file: rest.obj}, motion: {frames: \"frame_*.obj\", rate: 20, begin: ") +
           begin + "}}";
  };
  Simulation simulation(parseScene(flap, "t", {guide("0"), "gravity=[0, 0, 0]"}, folder_));
  const Matrix3Xd start = simulation.state().cloths[0].x;
  EXPECT_LT((simulation.state().cloths[0].v.colwise() - Vector3d(0.4, 0, 0)).cwiseAbs().maxCoeff(), 1e-12);
  for (int k = 1; k <= 30; ++k)   // carried along, as if at rest
  {
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
    ASSERT_LT((simulation.state().cloths[0].x - start).colwise().norm().maxCoeff(), 0.004 * k + 1e-9) << k;
    ASSERT_LT(simulation.state().cloth_guides[0].forces.norm(), 1e-9) << k;
  }
  // a guide that begins later stands still until then
  const SceneConfig late = parseScene(flap, "t", {guide("0.1")}, folder_);
  EXPECT_EQ(late.cloths[0].start_velocity.norm(), 0.0);
  Matrix3Xd x, v;
  late.cloths[0].tracking->guide.evaluate(0.1, x, &v);
  EXPECT_EQ(v.norm(), 0.0);
}

TEST_F(TrackedScenes, LieOnTheirGuidesWhateverTheirLengthsAtRest)
{
  // crumpled, of no stiffness and without weight: where the guide is their averages are the guide's, and they stay
  for (const char* step : {"0.01", "0.001"})
  {
    Simulation simulation(
        parseScene(flap, "t",
                   {"tracked.0.undeformed={crinkles: {height: 0.015}, lengths: true}",
                    "tracked.0.material.youngs_modulus=1", std::string("time.step=") + step, "gravity=[0, 0, 0]"}));
    const ClothState& cloth = simulation.state().cloths[0];
    const Matrix3Xd start = cloth.x;
    const WeakConstraints& constraints = *simulation.config().cloths[0].tracking->sets[0].constraints;
    EXPECT_LT(constraints.error(constraints.averages(simulation.state().cloth_guides[0].points), start), 1e-15);
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
    EXPECT_LT((cloth.x - start).cwiseAbs().maxCoeff(), 1e-4) << step;
  }
}

TEST_F(TrackedScenes, TakeGroupsOfFiles)
{
  write("cross.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\ng left\nf 1 2 3\nf 1 3 4\ng right\nf 2 5 6\nf 2 6 3\n");
  const SceneConfig scene = parseScene(
      flap, "t", {"tracked.0.guide={mesh: {file: cross.obj}}", "tracked.0.test_functions={regions: obj}"}, folder_);
  const TestFunctions& f = scene.cloths[0].tracking->sets[0].functions;
  ASSERT_EQ(f.names, (std::vector<std::string>{"left", "right"}));
  // prolonged: the left function is 1 over its faces and falls to 0 within the right ones
  EXPECT_TRUE(Eigen::MatrixXd(f.guide).row(0) == Eigen::RowVectorXd(Eigen::Map<const Eigen::RowVectorXd>(
                                                     std::vector<double>{1, 1, 1, 1, 0, 0}.data(), 6)));
  const Matrix3Xd& x = scene.cloths[0].mesh.vertices;
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    EXPECT_NEAR(f.tracked.coeff(0, i), x(0, i) <= 1 ? 1.0 : 2.0 - x(0, i), 1e-12);
}

TEST_F(TrackedScenes, ClusterReproducibly)
{
  const std::vector<std::string> set{"tracked.0.guide.grid.cells=[12, 12]", "tracked.0.mesh=same",
                                     "tracked.0.test_functions={clusters: {count: 7, seed: 4}}"};
  const SceneConfig a = parseScene(flap, "t", set), b = parseScene(flap, "t", set);
  EXPECT_EQ(a.cloths[0].tracking->sets[0].functions.count(), 7);
  EXPECT_EQ(
      Eigen::MatrixXd(a.cloths[0].tracking->sets[0].functions.guide - b.cloths[0].tracking->sets[0].functions.guide)
          .norm(),
      0.0);
  Simulation simulation(a);
  for (int k = 0; k < 10; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_LT(report.tracking_error, 1e-13);
  }
}

TEST_F(TrackedScenes, RestartExactly)
{
  writeFrames(21);
  const std::string motion = "tracked.0.guide={mesh: {file: rest.obj}, motion: {frames: \"frame_*.obj\", rate: 20}}";
  Simulation one(parseScene(flap, "t", {motion}, folder_)), two(parseScene(flap, "t", {motion}, folder_));
  for (int k = 0; k < 15; ++k)
    ASSERT_TRUE(one.step(one.defaultInputs()).ok);
  one.save(folder_ + "/state");
  two.load(folder_ + "/state");
  EXPECT_TRUE(two.state().cloth_guides[0].points == one.state().cloth_guides[0].points);
  EXPECT_TRUE(two.state().cloth_guides[0].forces == one.state().cloth_guides[0].forces);
  for (int k = 0; k < 10; ++k)
  {
    ASSERT_TRUE(one.step(one.defaultInputs()).ok);
    ASSERT_TRUE(two.step(two.defaultInputs()).ok);
    ASSERT_TRUE(one.state().cloths[0].x == two.state().cloths[0].x);
  }
  Simulation other(
      parseScene(flap, "t", {motion, "tracked.0.test_functions={basis: subdivision, vertices: [0..4]}"}, folder_));
  EXPECT_THROW(other.load(folder_ + "/state"), std::runtime_error);
}

TEST_F(TrackedScenes, KeepTheirAveragesInContact)
{
  // pressed through a ball by its guide, free and held at one side
  const std::vector<std::string> set{
      "tracked.0.guide.motion={bodies: poses.csv, groups: {all: [0..8]}}", "tracked.0.contact={thickness: 0.004}",
      "tracked.0.test_functions={regions: {near: {guide: [0, 1, 2]}, far: {guide: [6, 7, 8]}}}",
      "obstacles=[{name: ball, shape: {sphere: {radius: 0.05}}, pose: {position: [0.2, 0.2, -0.06]}, motion: fixed}]"};
  write("poses.csv", "t,body,x,y,z,qx,qy,qz,qw\n0,all,0,0,0,0,0,0,1\n0.3,all,0,0,-0.05,0,0,0,1\n");
  for (const bool held : {false, true})
  {
    std::vector<std::string> all = set;
    if (held)
      all.push_back("tracked.0.grasps={corner: {vertices: [0, 1]}}");
    Simulation simulation(parseScene(flap, "t", all, folder_));
    int contacts = 0;
    for (int k = 0; k < 60; ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << report.message;
      contacts += report.repulsions;
      ASSERT_LT(report.tracking_error, 2e-12) << held << " step " << k;
    }
    EXPECT_GT(contacts, 100);
    const Matrix3Xd& x = simulation.state().cloths[0].x;
    EXPECT_GT((x.colwise() - Vector3d(0.2, 0.2, -0.06)).colwise().norm().minCoeff(), 0.05);
    // ball, guide and holder bear it together
    double down = 0.0;
    for (int k = 0; k < 20; ++k)
    {
      ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
      down -= simulation.state().cloth_guides[0].forces.row(2).sum() / 20;
    }
    const double weight = 9.81 * simulation.clothModel(0).totalMass();
    EXPECT_LT(-down, 1.01 * weight) << held;   // the ball does not pull
    if (held)
      EXPECT_GT(down, weight);   // and the guide presses against it
  }
}

TEST_F(TrackedScenes, LieOnAFloorThatTheirGuidesGoThrough)
{
  // all of the shell is pressed at a floor, which no average can be met against: collisions have the last word, and
  // bounded forces are at their bounds
  const std::vector<std::string> set{"tracked.0.guide.motion={bodies: poses.csv, groups: {all: [0..8]}}",
                                     "tracked.0.contact={thickness: 0.004}",
                                     "obstacles=[{name: floor, shape: {plane: {}}, pose: {position: [0, 0, -0.02]}}]"};
  write("poses.csv",
        "t,body,x,y,z,qx,qy,qz,qw\n0,all,0,0,0,0,0,0,1\n0.3,all,0,0,-0.05,0,0,0,1\n0.6,all,0,0,-0.05,0,0,0,1\n0.9,all,"
        "0,0,0,0,0,0,1\n");
  for (const double traction : {0.0, 5.0, 50.0})
  {
    std::vector<std::string> all = set;
    if (traction > 0)
      all.push_back("tracked.0.max_traction=" + std::to_string(traction));
    Simulation simulation(parseScene(flap, "t", all, folder_));
    const ClothState& held = simulation.state().cloths[0];
    for (int k = 1; k <= 100; ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << traction << " step " << k << ": " << report.message;
      ASSERT_GT(held.x.row(2).minCoeff(), -0.0181) << traction << " step " << k;
      if (k < 12 || k > 79 || traction > 0)
        EXPECT_LT(report.tracking_error, 1e-12) << traction << " step " << k;
      if (traction > 0 && k == 60)
      {
        EXPECT_EQ(report.forces_at_bound, 9);
        EXPECT_NEAR(simulation.trackingError({ObjectRef::cloth, 0}).at_bound, 0.032, 1e-6);
        EXPECT_NEAR(simulation.state().cloth_guides[0].forces.row(2).sum(), -0.16 * traction,
                    1e-9);   // traction times area
      }
    }
    EXPECT_TRUE(held.at_bound.empty());
    EXPECT_LT(simulation.trackingError({ObjectRef::cloth, 0}).met, 1e-13);
  }
}

TEST_F(TrackedScenes, BoundForcesByRegion)
{
  // a stiff flap whose guide stretches: one side is followed exactly, the other as far as the force allows, as often as
  // it is restarted
  TriangleMesh mesh = writeFrames(1);
  for (int k = 0; k < 3; ++k)
  {
    TriangleMesh frame = mesh;
    frame.vertices.row(1) *= k == 1 ? 3.0 : 1.0;
    writeObj(folder_ + "/pull_" + std::to_string(k) + ".obj", frame);
  }
  const std::vector<std::string> set{
      "tracked.0.guide={mesh: {file: rest.obj}, motion: {frames: \"pull_*.obj\", rate: 2}}",
      "tracked.0.material.youngs_modulus=1.0e7",
      "tracked.0.test_functions={regions: {left: {guide: [0, 1, 2]}, right: {guide: [6, 7, 8]}}}",
      "tracked.0.max_traction={right: 200}"};
  Simulation one(parseScene(flap, "t", set, folder_)), two(parseScene(flap, "t", set, folder_));
  const TrackingConfig& tracking = *one.config().cloths[0].tracking;
  EXPECT_TRUE(std::isinf(tracking.sets[0].bounds[0]));
  EXPECT_NEAR(tracking.sets[0].bounds[1], 200 * tracking.sets[0].constraints->measures()[1], 1e-12);
  double furthest = 0.0, strain = 0.0;
  for (int k = 1; k <= 300; ++k)
  {
    StepReport report = one.step(one.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_LT(report.tracking_error, 1e-13) << k;
    EXPECT_LE(one.state().cloth_guides[0].forces.col(1).norm(), tracking.sets[0].bounds[1] * (1 + 1e-9)) << k;
    furthest = std::max(furthest, one.trackingError({ObjectRef::cloth, 0}).at_bound);
    strain = std::max(strain, report.max_strain);
    if (k == 50)
    {
      EXPECT_EQ(one.state().cloths[0].at_bound, std::vector<int>{1});
      one.save(folder_ + "/state");
      two.load(folder_ + "/state");
      EXPECT_EQ(two.state().cloths[0].at_bound, std::vector<int>{1});
    }
    if (k > 50 && k < 70)
    {
      ASSERT_TRUE(two.step(two.defaultInputs()).ok);
      ASSERT_TRUE(one.state().cloths[0].x == two.state().cloths[0].x) << k;
    }
  }
  EXPECT_GT(furthest, 0.3);
  EXPECT_LT(strain, 0.05);
  EXPECT_TRUE(one.state().cloths[0].at_bound.empty());
  EXPECT_LT(one.trackingError({ObjectRef::cloth, 0}).met, 1e-14);
  EXPECT_NE(problems({"tracked.0.max_traction={top: 30}"}).find("test function that is not there"), std::string::npos);
  EXPECT_NE(problems({"tracked.0.max_traction=0"}).find("Pa"), std::string::npos);
  EXPECT_THROW(
      Simulation(parseScene(flap, "t", {"tracked.0.max_traction=10", "tracked.0.solver={one_newton_step: false}"})),
      SceneError);
  Simulation other(parseScene(flap, "t", {set[0], set[1], set[2]}, folder_));
  EXPECT_THROW(other.load(folder_ + "/state"), std::runtime_error);
}

TEST_F(TrackedScenes, AreRecorded)
{
  Simulation simulation(parseScene(flap, "t"));
  const auto recorder = makeCsvRecorder(folder_ + "/csv");
  recorder->record(simulation, {});
  ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  recorder->record(simulation, {});
  recorder->finish();
  std::ifstream file(folder_ + "/csv/tracking.csv");
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "t [s],object,function,x [m],y [m],z [m],fx [N],fy [N],fz [N]");
  int rows = 0;
  double up = 0.0;
  while (std::getline(file, line))
  {
    EXPECT_NE(line.find(",flap,vertex " + std::to_string(rows % 9) + ","), std::string::npos) << line;
    up += std::stod(line.substr(line.rfind(',') + 1));
    ++rows;
  }
  EXPECT_EQ(rows, 18);
  EXPECT_GT(up, 0.1);
}

TEST_F(TrackedScenes, StayWithGuidesByTopicUntilTheyMove)
{
  Simulation simulation(parseScene(flap, "t", {"tracked.0.guide.motion={topic: points}"}));
  EXPECT_TRUE(simulation.config().cloths[0].tracking->guide.byTopic());
  SceneInputs inputs = simulation.defaultInputs();
  EXPECT_TRUE(inputs.guides[0] == simulation.config().cloths[0].tracking->guide.mesh.vertices);
  inputs.guides[0].row(2).array() += 0.3;   // a jump: exact all the same
  StepReport report = simulation.step(inputs);
  ASSERT_TRUE(report.ok) << report.message;
  EXPECT_LT(report.tracking_error, 1e-13);
  EXPECT_TRUE(simulation.defaultInputs().guides[0] == inputs.guides[0]);
  const SceneState before = simulation.state();
  inputs.guides[0](1, 4) = NAN;
  report = simulation.step(inputs);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.failure, StepFailure::input_not_finite);
  EXPECT_TRUE(simulation.state().cloths[0].x == before.cloths[0].x);
  EXPECT_TRUE(simulation.state().cloth_guides[0].points == before.cloth_guides[0].points);
  inputs.guides[0].resize(3, 4);
  EXPECT_THROW(simulation.step(inputs), std::invalid_argument);
}

}   // namespace
}   // namespace slender
