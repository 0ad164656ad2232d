// Sets of test functions of a tracked cloth that take over from each other while it runs.
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

/// A sheet whose waving guide it follows by four quarters, then by all vertices of the guide.
const char* const kSwitched = R"(
name: switched
time: {step: 0.005, duration: 2}
tracked:
  - name: sheet
    guide: {mesh: {file: rest.obj}, motion: {frames: "frame_*.obj", rate: 20}}
    mesh: {subdivide: 1}
    test_functions:
      - {name: coarse, regions: {a: {guide: [0, 1, 5, 6]}, b: {guide: [3, 4, 8, 9]}, c: {guide: [15, 16, 20, 21]}, d: {guide: [18, 19, 23, 24]}}}
      - {name: fine, basis: subdivision, from: 0.6, blend: 0.3}
      - {name: middle, basis: subdivision, vertices: [12]}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 5.0e4}
    bending: {model: hinge}
    damping: {stiffness: 0.002}
    solver: {one_newton_step: true}
)";

class TrackedFunctions : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_functions_" + std::to_string(getpid());
    std::filesystem::create_directories(folder_);
    TriangleMesh mesh = gridMesh(0.4, 0.4, 4, 4, GridPattern::alternating);
    writeObj(folder_ + "/rest.obj", mesh);
    const Matrix3Xd rest = mesh.vertices;
    for (int k = 0; k <= 40; ++k)
    {
      const double t = k / 20.0;
      mesh.vertices = rest;
      for (Eigen::Index i = 0; i < rest.cols(); ++i)
        mesh.vertices(2, i) += 0.05 * std::sin(6.0 * t + 9.0 * rest(0, i)) * std::min(1.0, 4.0 * t);
      mesh.vertices.row(1).array() += 0.1 * t * t;
      writeObj(folder_ + "/frame_" + std::to_string(k) + ".obj", mesh);
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  SceneConfig scene(const std::vector<std::string>& set = {}) const { return parseScene(kSwitched, "t", set, folder_); }
  std::string problems(const std::vector<std::string>& set) const
  {
    try
    {
      scene(set);
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }

  static void run(Simulation& simulation, int steps)
  {
    for (int k = 0; k < steps; ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << report.message;
    }
  }

  /// Greatest distance of an average of these functions from the guide's.
  static double away(const Simulation& simulation, int set)
  {
    const SceneState& state = simulation.state();
    const WeakConstraints& functions =
        *simulation.config().cloths[0].tracking->sets[static_cast<std::size_t>(set)].constraints;
    return functions.error(functions.averages(state.cloth_guides[0].points), state.cloths[0].x);
  }

  /// Velocities of the averages of the second set.
  static Matrix3Xd rates(const Simulation& simulation)
  {
    return simulation.state().cloths[0].v *
           simulation.config().cloths[0].tracking->sets[1].constraints->matrix().transpose();
  }

  std::string folder_;
};

TEST_F(TrackedFunctions, AreExactAfterTheBlend)
{
  Simulation simulation(scene());
  EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "coarse");
  run(simulation, 120);
  EXPECT_LT(away(simulation, 0), 1e-14);
  const double gap = away(simulation, 1);
  EXPECT_GT(gap, 0.005);   // they do differ
  EXPECT_EQ(simulation.state().cloth_guides[0].forces.cols(), 4);
  double before = gap;
  for (int k = 1; k <= 60; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_LT(report.tracking_error, 1e-13) << k;   // of what the blend leaves to do
    const TrackingError error = simulation.trackingError({ObjectRef::cloth, 0});
    EXPECT_NEAR(error.blend, away(simulation, 1), 1e-13) << k;
    if (k > 20)   // the rate's part is over
      EXPECT_LT(error.blend, before) << k;
    EXPECT_LT(error.blend, 1.5 * gap) << k;
    before = error.blend;
    EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "fine");
    EXPECT_EQ(simulation.state().cloth_guides[0].blend.gap.cols(), k < 60 ? 25 : 0) << k;
  }
  EXPECT_EQ(before, 0.0);
  for (int k = 0; k < 60; ++k)
  {
    run(simulation, 1);
    EXPECT_LT(away(simulation, 1), 1e-14) << k;
  }
}

TEST_F(TrackedFunctions, TakeOverWithoutAJump)
{
  double jump[2], shift[2], usual = 0.0, moved = 0.0;
  for (const bool blended : {true, false})
  {
    Simulation simulation(scene({std::string("tracked.0.test_functions.1.blend=") + (blended ? "0.3" : "0")}));
    Matrix3Xd x, v;
    for (int k = 1; k <= 121; ++k)
    {
      x = simulation.state().cloths[0].x;
      v = rates(simulation);
      run(simulation, 1);
      if (blended && k > 100 && k <= 120)
      {
        usual = std::max(usual, (rates(simulation) - v).colwise().norm().maxCoeff());
        moved = std::max(moved, (simulation.state().cloths[0].x - x).colwise().norm().maxCoeff());
      }
    }
    jump[blended] = (rates(simulation) - v).colwise().norm().maxCoeff();
    shift[blended] = (simulation.state().cloths[0].x - x).colwise().norm().maxCoeff();
    EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "fine");
    if (!blended)
      EXPECT_LT(away(simulation, 1), 1e-14);   // at once
  }
  RecordProperty("jump_blended_mm_s", std::to_string(1e3 * jump[1]));
  RecordProperty("jump_at_once_mm_s", std::to_string(1e3 * jump[0]));
  RecordProperty("usual_mm_s", std::to_string(1e3 * usual));
  EXPECT_LT(jump[1], 2.0 * usual);   // no more than in any step
  EXPECT_LT(shift[1], 1.5 * moved);
  EXPECT_GT(jump[0], 20.0 * jump[1]);
  EXPECT_GT(shift[0], 3.0 * moved);
}

TEST_F(TrackedFunctions, VelocitiesJumpLessTheShorterTheStep)
{
  // continuous: what velocities change by in the step of the switch goes with the step
  double jump[2];
  for (const int half : {0, 1})
  {
    Simulation simulation(scene({half ? "time.step=0.0025" : "time.step=0.005"}));
    run(simulation, half ? 240 : 120);
    const Matrix3Xd v = rates(simulation);
    run(simulation, 1);
    jump[half] = (rates(simulation) - v).colwise().norm().maxCoeff();
  }
  EXPECT_LT(jump[1], 0.65 * jump[0]);
}

TEST_F(TrackedFunctions, RestartExactlyInTheMiddleOfABlend)
{
  for (const std::vector<std::string>& set :
       {std::vector<std::string>{}, {"tracked.0.max_traction=2"}, {"tracked.0.contact={thickness: 0.002}"}})
  {
    Simulation one(scene(set)), two(scene(set));
    run(one, 150);
    EXPECT_GT(one.trackingError({ObjectRef::cloth, 0}).blend, 1e-4);
    one.save(folder_ + "/state");
    two.load(folder_ + "/state");
    EXPECT_EQ(two.functions({ObjectRef::cloth, 0}).name, "fine");
    for (int k = 0; k < 60; ++k)
    {
      run(one, 1);
      run(two, 1);
      const ClothState &a = one.state().cloths[0], &b = two.state().cloths[0];
      ASSERT_TRUE(a.x == b.x && a.v == b.v && a.at_bound == b.at_bound) << k;
      ASSERT_TRUE(one.state().cloth_guides[0].forces == two.state().cloth_guides[0].forces) << k;
    }
    two.reset();
    EXPECT_EQ(two.functions({ObjectRef::cloth, 0}).name, "coarse");
    Simulation fresh(scene(set));
    run(two, 125);   // past the switch again
    run(fresh, 125);
    EXPECT_EQ(two.functions({ObjectRef::cloth, 0}).name, "fine");
    EXPECT_TRUE(two.state().cloths[0].x == fresh.state().cloths[0].x);
  }
  // another blend is another scene
  Simulation one(scene()), other(scene({"tracked.0.test_functions.1.blend=0.2"}));
  one.save(folder_ + "/state");
  EXPECT_THROW(other.load(folder_ + "/state"), std::runtime_error);
}

TEST_F(TrackedFunctions, AreSwitchedByRequest)
{
  Simulation simulation(scene({"tracked.0.test_functions.1.from=1.9"}));
  run(simulation, 60);
  simulation.setFunctions(0, "fine", 0.1);
  EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "fine");
  EXPECT_NEAR(simulation.trackingError({ObjectRef::cloth, 0}).blend, away(simulation, 1), 1e-15);
  EXPECT_LT(simulation.trackingError({ObjectRef::cloth, 0}).met, 1e-15);
  run(simulation, 10);
  EXPECT_GT(away(simulation, 1), 1e-4);
  // within a blend, to one function, and back
  simulation.setFunctions(0, "middle");
  EXPECT_EQ(simulation.state().cloth_guides[0].forces.cols(), 1);
  run(simulation, 40);   // the default blend of 0.2 s
  EXPECT_LT(away(simulation, 2), 1e-14);
  EXPECT_GT(away(simulation, 0), 1e-4);
  simulation.setFunctions(0, "coarse", 0.0);
  EXPECT_EQ(simulation.trackingError({ObjectRef::cloth, 0}).blend, 0.0);
  run(simulation, 1);
  EXPECT_LT(away(simulation, 0), 1e-14);
  run(simulation, 20);   // the speed of that step is gone
  // to what is in force: nothing changes
  Simulation same(scene({"tracked.0.test_functions.1.from=1.9"}));
  simulation.save(folder_ + "/state");
  same.load(folder_ + "/state");
  same.setFunctions(0, "coarse");
  for (Simulation* each : {&simulation, &same})
    run(*each, 10);
  EXPECT_LT((simulation.state().cloths[0].x - same.state().cloths[0].x).cwiseAbs().maxCoeff(), 1e-5);
  // a blend of rounding errors, and of what velocities are not differences of positions
  EXPECT_LT(same.trackingError({ObjectRef::cloth, 0}).blend, 1e-5);

  const auto refused = [](Simulation& s, const std::string& set, std::optional<double> blend) -> std::string {
    const SceneState before = s.state();
    try
    {
      s.setFunctions(0, set, blend);
    }
    catch (const std::invalid_argument& error)
    {
      EXPECT_EQ(s.state().cloths[0].average_set, before.cloths[0].average_set);
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refused(simulation, "finer", {}).find("no test functions \"finer\"; cloth sheet has: coarse fine middle"),
            std::string::npos);
  EXPECT_NE(refused(simulation, "fine", -1.0).find("0 or more"), std::string::npos);
  EXPECT_NE(refused(simulation, "fine", NAN).find("0 or more"), std::string::npos);
  Simulation one(scene({"tracked.0.test_functions={basis: subdivision}"}));
  EXPECT_NE(refused(one, "", {}).find("one set"), std::string::npos);
  // on what is held by now
  Simulation held(scene({"tracked.0.grasps={left: {vertices: [0]}}"}));
  std::vector<int> all(81);
  for (int i = 0; i < 81; ++i)
    all[static_cast<std::size_t>(i)] = i;
  held.grasps().release(0);
  all.pop_back();
  held.grasps().attachVertices(0, all);
  EXPECT_NE(refused(held, "fine", {}).find("held"), std::string::npos);
}

TEST_F(TrackedFunctions, OfSeveralThatAreDueInAStepTheLatestActs)
{
  Simulation simulation(scene({"tracked.0.test_functions.1.from=0.604", "tracked.0.test_functions.2.from=0.602"}));
  run(simulation, 121);
  EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "coarse");
  run(simulation, 1);
  EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "fine");
}

TEST_F(TrackedFunctions, OneSetOfAListIsAsWithoutList)
{
  Simulation one(scene({"tracked.0.test_functions={basis: subdivision}"})),
      two(scene({"tracked.0.test_functions=[{name: only, basis: subdivision}]"}));
  run(one, 60);
  run(two, 60);
  EXPECT_TRUE(one.state().cloths[0].x == two.state().cloths[0].x);
  // and sets that do not act change nothing
  Simulation three(scene({"tracked.0.test_functions=[{name: all, basis: subdivision}, {name: one, vertices: [12]}]"}));
  run(three, 60);
  EXPECT_TRUE(one.state().cloths[0].x == three.state().cloths[0].x);
}

TEST_F(TrackedFunctions, FailedStepsLeaveTheSetAsItIs)
{
  Simulation simulation(scene());
  run(simulation, 120);
  const Matrix3Xd x = simulation.state().cloths[0].x, forces = simulation.state().cloth_guides[0].forces;
  SceneInputs bad = simulation.defaultInputs();
  bad.guides[0](1, 3) = NAN;
  EXPECT_FALSE(simulation.step(bad).ok);   // in which they were to change
  EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "coarse");
  EXPECT_TRUE(simulation.state().cloths[0].x == x && simulation.state().cloth_guides[0].forces == forces);
  run(simulation, 1);
  EXPECT_EQ(simulation.functions({ObjectRef::cloth, 0}).name, "fine");
}

TEST_F(TrackedFunctions, KeepTheirBoundsAndTouchThings)
{
  // a floor in the way of the waves, and forces that are not to be more than so much
  Simulation bounded(scene({"tracked.0.max_traction=3", "tracked.0.contact={thickness: 0.002}",
                            "obstacles=[{name: floor, shape: {plane: {}}, pose: {position: [0, 0, -0.1]}}]"}));
  int most = 0;
  for (int k = 0; k < 240; ++k)
  {
    const StepReport report = bounded.step(bounded.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_LT(report.tracking_error, 1e-11) << k;
    most = std::max(most, report.forces_at_bound);
    const FunctionSet& set = bounded.functions({ObjectRef::cloth, 0});
    const Eigen::VectorXd over =
        bounded.state().cloth_guides[0].forces.colwise().norm().transpose().array() / set.bounds.array();
    EXPECT_LT(over.maxCoeff(), 1.0011) << k;   // contact may go over by a thousandth
  }
  EXPECT_GT(most, 0);
}

TEST_F(TrackedFunctions, SayWhatIsWrong)
{
  const std::string f = "tracked.0.test_functions";
  const struct
  {
    std::string set;
    const char* expected;
  } cases[] = {
      {f + "=[]", "must have 1 to 100"},
      {f + "=[{basis: subdivision}]", "name: is missing"},
      {f + "=[{name: a, basis: subdivision}, {name: a, vertices: [1]}]", "names must differ"},
      {f + "=[{name: a, basis: subdivision}, {name: b, vertices: [1], from: 1}, {name: c, vertices: [2], from: 1}]",
       "times must differ"},
      {f + ".1.from=0", "(0, 10000000] s"},
      {f + ".1.blend=-1", "[0, 10000000] s"},
      {f + ".1.colour=red", "colour"},
      {f + "={name: a, basis: subdivision}", "name"},
      {f + "=[{name: a, basis: subdivision}, {name: b, regions: {l: {guide: [0, 1]}, m: {guide: [0, 1]}}}]",
       "test_functions.1"},
      {f + "=[{name: a, basis: subdivision}, {name: b, regions: {l: {guide: [0, 1]}, m: {guide: [0, 1]}}}]",
       "'m' depends on 'l'"},
      {f + "=[{name: a, basis: subdivision}, {name: b, regions: {l: {guide: []}}}]", "test_functions.1"},
      {"tracked.0.max_traction={top: 3}", "not there"},
  };
  for (const auto& c : cases)
  {
    // The functions of a cloth decide which contact it may have. The reader asks them even if they are wrong.
    for (const std::string& text : {problems({c.set}), problems({c.set, "tracked.0.contact={}"})})
      EXPECT_NE(text.find(c.expected), std::string::npos) << c.set << "\n -> " << text;
  }
  // bounds by names of functions of any set
  const SceneConfig bounded = scene({"tracked.0.max_traction={a: 3, vertex 12: 5}"});
  const auto& sets = bounded.cloths[0].tracking->sets;
  EXPECT_NEAR(sets[0].bounds[0], 3 * sets[0].constraints->measures()[0], 1e-12);
  EXPECT_TRUE(std::isinf(sets[1].bounds[0]));
  EXPECT_NEAR(sets[1].bounds[12], 5 * sets[1].constraints->measures()[12], 1e-12);
}

TEST_F(TrackedFunctions, AreNamedInWhatIsRecorded)
{
  {
    Simulation simulation(scene());
    const auto recorder = makeCsvRecorder(folder_ + "/csv");
    run(simulation, 119);
    for (int k = 0; k < 3; ++k)
    {
      recorder->record(simulation, StepReport());
      run(simulation, 1);
    }
  }
  std::ifstream file(folder_ + "/csv/tracking.csv");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("\n0.6,sheet,coarse/a,"), std::string::npos);
  EXPECT_NE(text.str().find("\n0.605,sheet,fine/vertex 0,"), std::string::npos);
  EXPECT_EQ(text.str().find("\n0.605,sheet,coarse/"), std::string::npos);
}

}   // namespace
}   // namespace slender
