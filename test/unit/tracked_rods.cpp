// Rods of a scene that track a guide curve: reading, refusals, exactness, jumps, restart.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/geometry/curves.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/recorder.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/scene/snapshot.h"
#include "slender_sim/tracking/curve_functions.h"

namespace slender {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

const char* const rope = R"(
name: rope
time: {step: 0.01, duration: 1}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 1], to: [1.2, 0, 1], edges: 60}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6}
    damping: {mass: 0.5}
    track: {guide: {nodes: 5, motion: {topic: points}}}
)";

// of the rod's length: linear constraints are met to rounding (1e-16 per metre), of 200 summands here
constexpr double kExact = 1e-12;

class TrackedRods : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_tracked_rods_" + std::to_string(getpid());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ + "/" + name) << text; }

  std::string problems(const std::vector<std::string>& overrides) const
  {
    try
    {
      Simulation simulation(parseScene(rope, "t", overrides, folder_));
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }

  static Simulation make(const std::vector<std::string>& overrides = {}, const std::string& folder = ".")
  {
    return Simulation(parseScene(rope, "t", overrides, folder));
  }

  /// One step with the guide there.
  static StepReport step(Simulation& simulation, const Matrix3Xd& guide)
  {
    SceneInputs inputs = simulation.defaultInputs();
    inputs.guides[0] = guide;
    return simulation.step(inputs);
  }

  static Matrix3Xd wave(const Matrix3Xd& rest, double t)
  {
    Matrix3Xd x = rest;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x.col(i) += std::min(1.0, 4.0 * t) * Vector3d(0, 0.05 * std::sin(5.0 * t + i), 0.1 * std::sin(7.0 * t + 2.0 * i));
    return x;
  }

  std::string folder_;
};

TEST_F(TrackedRods, AreReadWithDefaults)
{
  const SceneConfig scene = parseScene(rope, "t");
  ASSERT_TRUE(scene.rods[0].tracking);
  const TrackingConfig& tracking = *scene.rods[0].tracking;
  EXPECT_EQ(scene.time.integrator, Integrator::implicit_euler);
  EXPECT_NEAR(tracking.size, 1.2, 1e-12);
  EXPECT_TRUE(tracking.guide.byTopic());
  ASSERT_EQ(tracking.sets.size(), 1u);
  EXPECT_EQ(tracking.sets[0].constraints->count(), 5);
  for (int k = 0; k < 5; ++k)
    EXPECT_LT((tracking.guide.mesh.vertices.col(k) - Vector3d(0.3 * k, 0, 1)).norm(), 1e-12);
  // a straight rope that lies on its guide has its averages, wherever the nodes are
  for (const char* track :
       {"{guide: {nodes: 5}}", "{guide: {nodes: 8}}", "{guide: {nodes: 7}, test_functions: {segments: 4}}",
        "{guide: {points: [[0, 0, 1], [0.1234, 0, 1], [0.99, 0, 1], [1.2, 0, 1]]}, test_functions: {segments: 7}}"})
  {
    const Simulation simulation = make({std::string("rods.0.track=") + track});
    EXPECT_LT(simulation.trackingError({ObjectRef::rod, 0}).met, 1e-15) << track;
    EXPECT_LT((simulation.state().rods[0].x.row(2).array() - 1.0).abs().maxCoeff(), 1e-14) << track;
  }
}

TEST_F(TrackedRods, SayWhatIsWrong)
{
  write("few.csv", "x,y,z\n0,0,1\n");
  write("short.csv", "t,x0,y0,z0\n0,0,0,1\n");
  const std::string t = "rods.0.track", g = t + ".guide=", m = t + ".guide.motion=";
  const struct
  {
    std::vector<std::string> set;
    const char* expected;
  } cases[] = {
      {{t + "={}"}, "track.guide: is missing"},
      {{g + "{motion: fixed}"}, "must have one of nodes"},
      {{g + "{nodes: 5, points: [[0, 0, 0], [1, 0, 0]]}"}, "must have one of nodes"},
      {{g + "{nodes: 1}"}, "[2, 61] nodes of the rod"},
      {{g + "{nodes: 62}"}, "[2, 61] nodes of the rod"},
      {{g + "{points: [[0, 0, 0]]}"}, "at least 2"},
      {{g + "{points: [[0, 0, 0], [0, 0, 0], [1, 0, 0]]}"}, "points 0 and 1 are at the same place"},
      {{g + "{file: none.csv}"}, "none.csv"},
      {{g + "{file: few.csv}"}, "has 1 points"},
      {{m + "slow"}, "fixed"},
      {{m + "{}"}, "must be fixed or one of {table"},
      {{m + "{topic: bodies}"}, "points"},
      {{m + "{table: [[0, 1, 2]]}"}, "the guide's 5 nodes"},
      {{m + "{file: short.csv}"}, "must have 16: t, x0"},
      {{m + "{file: short.csv, late: hold}"}, "is for guides by topic"},
      {{t + ".test_functions={}"}, "one of {basis: hats}"},
      {{t + ".test_functions={basis: wavelet}"}, "hats"},
      {{t + ".test_functions={segments: 0}"}, "[1, 61] segments"},
      {{t + ".colour=red"}, "colour"},
      // what does not go together
      {{"time.integrator=tr_bdf2"},
       "time.integrator = tr_bdf2: is not for rods that track a guide; must be implicit_euler"},
      {{"time.error_tolerance=1e-5"}, "time.error_tolerance = 1e-5: is not for rods that track a guide"},
      {{"start=equilibrium"}, "start = equilibrium: is not for rods that track a guide"},
      {{"rods.0.stretching=projected"}, "stretching must be stiff"},
      {{"rods.0.centerline.straight.edges=4000", g + "{nodes: 3000}"}, "makes 3000 test functions"},
      // test functions that depend on each other, on nothing, or on what is held
      {{g + "{points: [[0, 0, 1], [0.001, 0, 1], [0.002, 0, 1], [1.2, 0, 1]]}"}, "'node 1'"},
      {{"rods.0.grasps={all: {nodes: [0..60]}}"}, "'node 0' acts on held vertices only"},
      {{"rods.0.grasps={most: {nodes: [0..57]}}"}, "'node 0' acts on held vertices only"},
  };
  for (const auto& c : cases)
  {
    const std::string text = problems(c.set);
    EXPECT_NE(text.find(c.expected), std::string::npos) << c.set.back() << "\n -> " << text;
  }
  EXPECT_EQ(problems({"rods.0.contact={self: true}",
                      "bodies=[{name: ball, mass: 1, inertia: [1, 1, 1], welds: [{rod: rope, edge: 0}]}]"}),
            "");
  EXPECT_EQ(problems({"rods.0.grasps={end: {edges: [0]}}"}), "");
}

TEST_F(TrackedRods, HaveTheGuidesAveragesAfterEveryStep)
{
  for (const char* change :
       {"name=hats", "rods.0.track.test_functions={segments: 6}", "rods.0.grasps={end: {edges: [0]}}",
        "rods.0.closed=true", "rods.0.damping.stiffness=0.002"})
  {
    std::vector<std::string> set{change};
    if (std::string(change) == "rods.0.closed=true")
      set.push_back(
          "rods.0.centerline={arc: {center: [0, 0, 1], start: [0.2, 0, 1], axis: [0, 0, 1], angle: 6.283185307179586, "
          "edges: 60}}");
    Simulation simulation = make(set);
    EXPECT_LT(simulation.trackingError({ObjectRef::rod, 0}).met, kExact) << change;
    const Matrix3Xd rest = simulation.state().rod_guides[0].points;
    for (int k = 1; k <= 150; ++k)
    {
      const Matrix3Xd guide = wave(rest, 0.01 * k);
      const StepReport report = step(simulation, guide);
      ASSERT_TRUE(report.ok) << change << " " << k << ": " << report.message;
      ASSERT_LT(report.tracking_error, kExact) << change << " " << k;
      ASSERT_LT(simulation.trackingError({ObjectRef::rod, 0}).met, kExact * 1.3) << change;
      ASSERT_TRUE(simulation.state().rod_guides[0].points == guide);
    }
    // the guide is held when nobody moves it, and its forces then carry what hangs from it
    for (int k = 0; k < 1500; ++k)
      ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok) << change;
    const double weight = 9.81 * simulation.rodModel(0).totalMass();
    double carried = simulation.state().rod_guides[0].forces.row(2).sum();
    for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
      carried -= simulation.grasps().wrench(static_cast<int>(g)).force.z();
    EXPECT_NEAR(carried, weight, 0.02 * weight) << change;   // it still sways a little
  }
}

TEST_F(TrackedRods, FollowTablesFromTheirVelocity)
{
  write("points.csv", "x,y,z\n0,0,1\n0.6,0,1\n1.2,0,1\n");
  std::string csv = "# a guide that moves on\nt,x0,y0,z0,x1,y1,z1,x2,y2,z2\n", table;
  for (int k = 0; k <= 20; ++k)
  {
    const double t = 0.05 * k;
    char row[200];
    std::snprintf(row, sizeof row, "%.17g,%.17g,0,1,%.17g,0,%.17g,%.17g,0,1", t, 2 * t, 0.6 + 2 * t, 1 + 0.1 * t * t,
                  1.2 + 2 * t);
    csv += std::string(row) + "\n";
    table += std::string(k ? ", [" : "[") + row + "]";
  }
  write("motion.csv", csv);
  for (const std::string& motion : {std::string("{file: motion.csv}"), "{table: [" + table + "]}"})
  {
    Simulation simulation = make({"rods.0.track={guide: {file: points.csv, motion: " + motion + "}}"}, folder_);
    const GuideConfig& guide = simulation.config().rods[0].tracking->guide;
    // under way as the scene starts
    EXPECT_LT((simulation.state().rods[0].v.colwise() - Vector3d(2, 0, 0)).cwiseAbs().maxCoeff(), 1e-9);
    Matrix3Xd x;
    for (int k = 1; k <= 90; ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << report.message;
      ASSERT_LT(report.tracking_error, kExact);
      guide.evaluate(0.01 * k, x);
      ASSERT_TRUE(simulation.state().rod_guides[0].points == x);
    }
    EXPECT_NEAR(x(0, 0), 1.8, 1e-9);
  }
}

/// Elsewhere than its guide, a rod starts moved there by as little as its averages need.
TEST_F(TrackedRods, StartOnTheirGuide)
{
  Simulation simulation =
      make({"rods.0.centerline={arc: {center: [0, 0, 1], start: [0.3, 0, 1], axis: [0, 1, 0], angle: 2.5, edges: 60}}",
            "gravity=[0, 0, 0]"});
  EXPECT_LT(simulation.trackingError({ObjectRef::rod, 0}).met, kExact);
  SceneConfig config = parseScene(
      rope, "t",
      {"rods.0.centerline={arc: {center: [0, 0, 1], start: [0.3, 0, 1], axis: [0, 1, 0], angle: 2.5, edges: 60}}"});
  config.rods[0].tracking = nullptr;
  const Matrix3Xd free = Simulation(config).state().rods[0].x;
  const double moved = (simulation.state().rods[0].x - free).colwise().norm().maxCoeff();
  EXPECT_GT(moved, 1e-3);   // the polyline of 5 nodes cuts the arc's corners by 0.3 (1 - cos(2.5 / 8)) = 0.015 at most
  EXPECT_LT(moved, 0.03);
  // so that nothing is thrown: the averages rest
  ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  const WeakConstraints& constraints = *simulation.config().rods[0].tracking->sets[0].constraints;
  // 1e-12 m within 0.01 s, and some
  EXPECT_LT((simulation.state().rods[0].v * constraints.matrix().transpose()).colwise().norm().maxCoeff(), 1e-9);
}

TEST_F(TrackedRods, StandGuidesThatJump)
{
  Simulation simulation = make();
  Matrix3Xd guide = simulation.state().rod_guides[0].points;
  for (int k = 0; k < 60; ++k)
  {
    if (k == 10)
      guide.row(1).array() += 3.0;
    if (k == 20)   // turned by 1 rad
      guide = (Eigen::AngleAxisd(1.0, Vector3d::UnitZ()).toRotationMatrix() * guide).eval();
    if (k == 30)
      guide = (guide.colwise() - Vector3d(0, 0, 5)).eval();
    const StepReport report = step(simulation, guide);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    ASSERT_LT(report.tracking_error, 10 * kExact) << k;   // metres away: rounding is that of larger numbers
    ASSERT_TRUE(simulation.state().rods[0].x.allFinite());
  }
  SceneInputs inputs = simulation.defaultInputs();
  const SceneState before = simulation.state();
  // end for end: on the straight way there all averages meet in one point
  inputs.guides[0] = guide.rowwise().reverse();
  const StepReport folded = simulation.step(inputs);
  EXPECT_FALSE(folded.ok);
  EXPECT_NE(folded.message.find("slower motion"), std::string::npos) << folded.message;
  inputs.guides[0](1, 3) = NAN;
  EXPECT_FALSE(simulation.step(inputs).ok);
  EXPECT_TRUE(simulation.state().rods[0].x == before.rods[0].x &&
              simulation.state().rod_guides[0].points == before.rod_guides[0].points);
  inputs.guides[0].resize(3, 4);
  EXPECT_THROW(simulation.step(inputs), std::invalid_argument);
  inputs.guides.clear();
  EXPECT_THROW(simulation.step(inputs), std::invalid_argument);
}

TEST_F(TrackedRods, RestartBitIdentically)
{
  const std::vector<std::string> set{"rods.0.grasps={end: {edges: [0]}}", "rods.0.damping.stiffness=0.001"};
  Simulation one = make(set);
  const Matrix3Xd rest = one.state().rod_guides[0].points;
  for (int k = 1; k <= 30; ++k)
    ASSERT_TRUE(step(one, wave(rest, 0.01 * k)).ok);
  one.save(folder_ + "/state");
  Simulation other = make(set);
  other.load(folder_ + "/state");
  EXPECT_TRUE(other.state().rod_guides[0].points == one.state().rod_guides[0].points);
  EXPECT_TRUE(other.state().rod_guides[0].forces == one.state().rod_guides[0].forces);
  EXPECT_GT(one.state().rod_guides[0].forces.norm(), 0.1);
  for (int k = 31; k <= 60; ++k)
  {
    ASSERT_TRUE(step(one, wave(rest, 0.01 * k)).ok);
    ASSERT_TRUE(step(other, wave(rest, 0.01 * k)).ok);
    ASSERT_TRUE(one.state().rods[0].x == other.state().rods[0].x && one.state().rods[0].v == other.state().rods[0].v &&
                one.state().rods[0].d1 == other.state().rods[0].d1)
        << k;
    ASSERT_TRUE(one.state().rod_guides[0].forces == other.state().rod_guides[0].forces) << k;
    ASSERT_TRUE(one.grasps().wrench(0).force == other.grasps().wrench(0).force) << k;
  }
  one.reset();
  EXPECT_TRUE(one.state().rod_guides[0].points == rest);
  // of other test functions
  for (const char* change : {"rods.0.track.test_functions={segments: 5}", "rods.0.track.guide={nodes: 6}",
                             "rods.0.track.guide={points: [[0, 0, 1], [1.2, 0, 1]]}"})
  {
    std::vector<std::string> changed = set;
    changed.push_back(change);
    Simulation third = make(changed);
    EXPECT_THROW(third.load(folder_ + "/state"), std::runtime_error) << change;
  }
}

TEST_F(TrackedRods, StandBesideOthersAndAreRecorded)
{
  // several rods in parallel, of which two track
  Simulation simulation(parseScene(std::string(rope) +
                                       "  - {name: free, centerline: {straight: {from: [0, 1, 1], to: [1, 1, 1], "
                                       "edges: 20}}, grasps: {left: {edges: [0]}}}\n" +
                                       "  - {name: band, centerline: {straight: {from: [0, 2, 1], to: [1, 2, 1], "
                                       "edges: 20}}, track: {guide: {nodes: 3}, test_functions: {segments: 2}}}\n",
                                   "t"));
  Simulation alone = make();
  for (int k = 0; k < 20; ++k)
  {
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
    ASSERT_TRUE(alone.step(alone.defaultInputs()).ok);
  }
  EXPECT_TRUE(simulation.state().rods[0].x == alone.state().rods[0].x);
  EXPECT_EQ(simulation.state().rod_guides[1].points.cols(), 0);
  EXPECT_EQ(simulation.trackingError({ObjectRef::rod, 1}).met, 0.0);
  EXPECT_LT(simulation.trackingError({ObjectRef::rod, 2}).met, kExact);
  const SceneSnapshot snapshot = snapshotOf(simulation);
  ASSERT_EQ(snapshot.functions.size(), 7u);
  EXPECT_EQ(snapshot.functions[0].object, "rope");
  EXPECT_EQ(snapshot.functions[4].name, "node 4");
  EXPECT_EQ(snapshot.functions[6].name, "segment 1");
  // its second half, into which the first goes over along two edges of 0.05 m
  EXPECT_LT((snapshot.functions[6].average - Vector3d(0.75 - 1.0 / 1200, 2, 1)).norm(), 1e-12);
  EXPECT_GT(snapshot.functions[5].force.z(), 0.0);
}

TEST_F(TrackedRods, RefuseGraspsThatLeaveTooLittle)
{
  Simulation simulation = make({"rods.0.grasps={end: {edges: [0]}}"});
  const Matrix3Xd before = simulation.state().rods[0].x;
  try
  {
    simulation.grasps().attach(0, 2, 60, Hold::frame);
    ADD_FAILURE();
  }
  catch (const std::invalid_argument& error)
  {
    EXPECT_NE(std::string(error.what()).find("test function"), std::string::npos) << error.what();
  }
  EXPECT_EQ(simulation.state().rods[0].grasps[0].last_node, 0);
  simulation.grasps().attach(0, 20, 25, Hold::frame);
  simulation.grasps().release(0);
  ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  EXPECT_LT(simulation.trackingError({ObjectRef::rod, 0}).met, kExact);
}

TEST(CurveFunctions, BelongToTheCurvesLength)
{
  const Matrix3Xd nodes = straightCurve({0, 0, 0}, {1, 0, 0}, 10, 3.0);   // unequal edges
  const Eigen::VectorXd shares = lengthFractions(edgeLengths(nodes, false));
  const Eigen::VectorXd guide = Eigen::VectorXd::LinSpaced(5, 0, 1);
  const MassMatrix weights = polylineWeights(guide, shares, false);
  for (int i = 0; i <= 10; ++i)   // linear functions are kept, so points on a line are themselves
  {
    EXPECT_NEAR((weights.row(i) * guide)(0), nodes(0, i), 1e-15);
    EXPECT_NEAR(Eigen::VectorXd(weights.row(i).transpose()).sum(), 1.0, 1e-15);
  }
  for (const bool closed : {false, true})
    for (const int count : {1, 3, 4, 10})
    {
      const Eigen::VectorXd at = Eigen::VectorXd::LinSpaced(13, 0, 1);
      const Eigen::MatrixXd values = curveSegments(count, at, closed).tracked;
      // a partition of unity
      EXPECT_LT((values.colwise().sum().array() - 1.0).abs().maxCoeff(), 1e-15) << closed << count;
      EXPECT_EQ(values.cols(), closed ? 12 : 13);
    }
  const Eigen::MatrixXd thirds = curveSegments(3, Eigen::VectorXd::LinSpaced(13, 0, 1), true).tracked;
  EXPECT_EQ(thirds(0, 0), 0.5);
  EXPECT_EQ(thirds(2, 0), 0.5);
  EXPECT_EQ(thirds(0, 4), 0.5);
  EXPECT_EQ(thirds(1, 4), 0.5);
  EXPECT_EQ(thirds(0, 2), 1.0);
  const MassMatrix loop =
      polylineWeights(Eigen::VectorXd::LinSpaced(4, 0, 1), Eigen::VectorXd::LinSpaced(7, 0, 1), true);
  EXPECT_EQ(loop.rows(), 6);
  EXPECT_EQ(loop.cols(), 3);
  EXPECT_NEAR(loop.coeff(5, 2), 0.5, 1e-15);
  EXPECT_NEAR(loop.coeff(5, 0), 0.5, 1e-15);   // back to the first
}

}   // namespace
}   // namespace slender
