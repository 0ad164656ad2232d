#include "slender_sim/scene/simulation.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>

#include <gtest/gtest.h>

#include "slender_sim/dynamics/integrator.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/state_bytes.h"
#include "test/support/scenes.h"

namespace slender {
namespace {

using test::runSteps;

const char* const two_rods = R"(
time: {step: 0.01}
rods:
  - name: a
    centerline: {straight: {edges: 20}}
    grasps:
      left: {edges: [0]}
      right: {edges: [-1], attach: initial, motion: {table: [[0, 5, 0, 0], [1, 5, 0, 1], [2, 5, 0.5, 1]]}}
  - name: b
    centerline: {straight: {from: [0, 1, 0], to: [1, 1, 0], edges: 30}}
    grasps: {b_left: {nodes: [3], hold: position}}
)";

Simulation twoRodSimulation(const std::vector<std::string>& overrides = {})
{
  return Simulation(parseScene(two_rods, "t", overrides));
}

void expectSameBits(const SceneState& a, const SceneState& b) { EXPECT_TRUE(stateBytes(a) == stateBytes(b)); }

TEST(StepsUntil, CountsWholeStepsAndHasAnEnd)
{
  EXPECT_EQ(stepsUntil(1.0, 0.005), 200);
  EXPECT_EQ(stepsUntil(0.3, 0.1), 3);   // 0.3 / 0.1 is less than 3, 0.7 / 0.1 less than 7
  EXPECT_EQ(stepsUntil(0.7, 0.1), 7);
  EXPECT_EQ(stepsUntil(0.7001, 0.1), 8);
  EXPECT_EQ(stepsUntil(0.001, 0.1), 1);
  EXPECT_EQ(stepsUntil(1e7, 1e-300), 1000000000000000);
}

TEST(Simulation, buildsWhatTheSceneSays)
{
  const Simulation simulation = twoRodSimulation();
  ASSERT_EQ(simulation.grasps().size(), 3u);
  EXPECT_EQ(simulation.grasps()[2].object.index, 1);
  EXPECT_EQ(simulation.grasps()[2].index, 0);
  EXPECT_EQ(simulation.grasps()[2].config->name, "b_left");
  EXPECT_NEAR(simulation.rodModel(0).totalMass(), 1000 * M_PI * 0.005 * 0.005, 1e-12);
  EXPECT_EQ(simulation.rodModel(1).nodes(), 31);
  EXPECT_EQ(simulation.state().time, 0.0);
}

TEST(Simulation, dragIsSpreadOverTheNodes)
{
  const Simulation simulation = twoRodSimulation({"rods.0.damping.drag=0.3"});
  EXPECT_NEAR(simulation.rodModel(0).drag.sum(), 0.3, 1e-12);   // 0.3 N s/m^2 times 1 m
  EXPECT_NEAR(simulation.rodModel(0).drag[0], 0.5 * simulation.rodModel(0).drag[1], 1e-15);
}

TEST(Simulation, timeIsStepsTimesStep)
{
  Simulation simulation = twoRodSimulation({"gravity=[0, 0, 0]", "rods.0.grasps.right.motion=fixed"});
  runSteps(simulation, 30);
  EXPECT_EQ(simulation.state().time, 30 * 0.01);
}

TEST(Simulation, anInitialAttachmentKeepsItsOffset)
{
  Simulation simulation = twoRodSimulation();
  runSteps(simulation, 100);   // the gripper rose by 1 m
  const RodState& rod = simulation.state().rods[0];
  EXPECT_LT((rod.x.col(20) - Eigen::Vector3d(1, 0, 1)).norm(), 1e-12);
  EXPECT_LT((rod.x.col(0) - Eigen::Vector3d(0, 0, 0)).norm(), 1e-12);
}

TEST(Simulation, offsetsCarryTheVelocityOfTheirLever)
{
  Simulation simulation = twoRodSimulation();
  const double c = std::cos(0.3), s = std::sin(0.3);
  const Pose X_WM{{1, 1, 0}, Eigen::Quaterniond(c, 0, 0, s)};
  simulation.grasps().setOffset(
      1, {{1, 1, 0}, Eigen::Quaterniond::Identity()});   // the section is at (1, 0, 0): 1 m along -y
  const GraspTarget target = simulation.grasps().targetOf(1, X_WM, Twist{{0.1, 0, 0}, {0, 0, 2}});
  EXPECT_LT((target.X_WG.position - (X_WM.position + X_WM.orientation * Eigen::Vector3d(0, -1, 0))).norm(), 1e-14);
  const Eigen::Vector3d arm = target.X_WG.position - X_WM.position;
  EXPECT_LT((target.velocity->linear - (Eigen::Vector3d(0.1, 0, 0) + Eigen::Vector3d(0, 0, 2).cross(arm))).norm(),
            1e-14);
  EXPECT_EQ(simulation.grasps().targetOf(0, X_WM).X_WG.position, X_WM.position);   // attach: section
}

TEST(Simulation, refusesInputsOfTheWrongSize)
{
  Simulation simulation = twoRodSimulation();
  SceneInputs inputs = simulation.defaultInputs();
  inputs.grasps.pop_back();
  EXPECT_THROW(simulation.step(inputs), std::invalid_argument);
}

TEST(Simulation, aFailedStepTouchesNothing)
{
  Simulation simulation = twoRodSimulation();
  runSteps(simulation, 3);
  const SceneState before = simulation.state();
  SceneInputs inputs = simulation.defaultInputs();
  inputs.grasps[1].X_WG.position.x() = std::nan("");
  const StepReport report = simulation.step(inputs);
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("rod 'a'"), std::string::npos) << report.message;
  expectSameBits(simulation.state(), before);
  runSteps(simulation, 1);   // and it goes on
}

TEST(Simulation, threadsDoNotChangeResults)
{
  Simulation one = twoRodSimulation(), many = twoRodSimulation();
  one.setThreads(1);
  many.setThreads(2);
  runSteps(one, 40);
  runSteps(many, 40);
  expectSameBits(one.state(), many.state());
  EXPECT_THROW(one.setThreads(0), std::invalid_argument);
}

TEST(Simulation, resetStartsAgain)
{
  Simulation simulation = twoRodSimulation();
  const SceneState start = simulation.state();
  runSteps(simulation, 20);
  const SceneState first = simulation.state();
  simulation.reset();
  expectSameBits(simulation.state(), start);
  runSteps(simulation, 20);
  expectSameBits(simulation.state(), first);
}

TEST(Simulation, attachAndRelease)
{
  Simulation simulation = twoRodSimulation({"rods.0.grasps.right.motion=fixed"});
  runSteps(simulation, 5);
  simulation.grasps().release(1);
  EXPECT_EQ(simulation.grasps().wrench(1).force, Eigen::Vector3d(0, 0, 0));
  runSteps(simulation, 20);
  EXPECT_LT(simulation.state().rods[0].x(2, 20), -0.05);   // the released end falls
  const Eigen::Vector3d caught = simulation.state().rods[0].x.col(10);
  simulation.grasps().attach(1, 10, 12, Hold::frame);
  runSteps(simulation, 20);
  EXPECT_LT((simulation.state().rods[0].x.col(10) - caught).norm(), 1e-12);
}

TEST(Simulation, refusesToAttachWhatCannotBeHeld)
{
  Simulation simulation = twoRodSimulation();
  EXPECT_THROW(simulation.grasps().attach(3, 0, 0, Hold::frame), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attach(-1, 0, 0, Hold::frame), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attach(1, -1, 0, Hold::frame), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attach(1, 20, 21, Hold::frame), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attach(1, 6, 5, Hold::frame), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attach(1, 5, 6, Hold::position), std::invalid_argument);
  EXPECT_THROW(simulation.grasps().attach(1, 0, 3, Hold::frame), std::invalid_argument);   // node 0 belongs to `left`
  EXPECT_THROW(simulation.grasps().release(7), std::invalid_argument);
  simulation.grasps().release(0);
  EXPECT_NO_THROW(simulation.grasps().attach(1, 0, 3, Hold::frame));
}

TEST(Simulation, equilibriumHangsStill)
{
  Simulation simulation =
      twoRodSimulation({"start=equilibrium", "rods.1.grasps.b_left={edges: [0]}", "rods.0.grasps.right.motion=fixed"});
  const Eigen::Matrix3Xd start = simulation.state().rods[1].x;
  EXPECT_LT(start(2, 30), -0.1);
  EXPECT_NEAR(simulation.grasps().wrench(2).force.z(), -simulation.rodModel(1).totalMass() * 9.81, 1e-6);
  runSteps(simulation, 10);
  EXPECT_LT((simulation.state().rods[1].x - start).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Simulation, explainsARodThatCannotBeBuilt)
{
  SceneConfig config = parseScene(two_rods);
  config.rods[1].cross_section.a = {-1.0};
  try
  {
    Simulation simulation(config);
    FAIL() << "a negative radius was accepted";
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("rods.1 (b)"), std::string::npos) << error.what();
  }
}

class SavedState : public testing::TestWithParam<const char*>
{
protected:
  void SetUp() override
  {
    path_ = testing::TempDir() + "/slender_sim_state_" +
            std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + GetParam();
  }
  void TearDown() override { std::remove(path_.c_str()); }

  std::string read() const
  {
    std::ifstream file(path_, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  void write(const std::string& bytes) const { std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes; }

  std::string path_;
};

TEST_P(SavedState, loadAndStepIsBitEqual)
{
  const std::vector<std::string> settings{
      std::string("time.integrator=") + GetParam(), "rods.0.damping.stiffness=0.001",
      std::string("time.step=") + (std::string(GetParam()) == "symplectic_euler" ? "1e-5" : "0.01")};
  Simulation through = twoRodSimulation(settings);
  runSteps(through, 25);
  through.save(path_);
  runSteps(through, 25);

  Simulation again = twoRodSimulation(settings);
  again.load(path_);
  runSteps(again, 25);
  expectSameBits(again.state(), through.state());

  runSteps(through, 3);
  through.load(path_);   // back in the same object as well
  runSteps(through, 25);
  expectSameBits(again.state(), through.state());
}

TEST_P(SavedState, refusesWhatDoesNotFit)
{
  Simulation simulation = twoRodSimulation({std::string("time.integrator=") + GetParam()});
  const auto refusal = [&](Simulation& target) {
    const SceneState before = target.state();
    std::string reason;
    try
    {
      target.load(path_);
    }
    catch (const std::runtime_error& error)
    {
      reason = error.what();
    }
    expectSameBits(target.state(), before);
    return reason;
  };
  EXPECT_NE(refusal(simulation).find("cannot be opened"), std::string::npos);
  simulation.save(path_);
  const std::string good = read();
  EXPECT_EQ(refusal(simulation), "");

  for (std::size_t size :
       {std::size_t{0}, std::size_t{5}, std::size_t{20}, std::size_t{40}, good.size() / 2, good.size() - 1})
  {
    write(good.substr(0, size));
    EXPECT_NE(refusal(simulation), "") << "cut to " << size << " bytes";
  }
  for (std::size_t at = 0; at < good.size(); at += 97)   // prime, so that all parts of numbers are hit
  {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x10);
    write(bad);
    EXPECT_NE(refusal(simulation), "") << "byte " << at << " changed";
  }
  write(good + "x");
  EXPECT_NE(refusal(simulation), "");
  write("not a state at all, but long enough to hold a header of forty bytes");
  EXPECT_NE(refusal(simulation).find("is not a saved state"), std::string::npos);

  write(good);
  for (const char* change : {"rods.0.material.youngs_modulus=2e6", "rods.1.centerline.straight.edges=31",
                             "time.step=0.02", "gravity=[0, 0, -1]", "rods.1.name=c"})
  {
    Simulation other = twoRodSimulation({std::string("time.integrator=") + GetParam(), change});
    EXPECT_NE(refusal(other).find("belongs to another scene"), std::string::npos) << change;
  }
  Simulation same = twoRodSimulation({std::string("time.integrator=") + GetParam(), "record.every=7", "name=other"});
  EXPECT_EQ(refusal(same), "");
}

INSTANTIATE_TEST_SUITE_P(Integrators, SavedState,
                         testing::Values("implicit_euler", "bdf2", "tr_bdf2", "implicit_midpoint", "generalized_alpha",
                                         "symplectic_euler"));

TEST(SavedStateFile, belongsToTheFormulationToo)
{
  const std::string path = testing::TempDir() + "/slender_sim_formulation";
  const auto scene = [](const std::string& traits) {
    return Simulation(parseScene("time: {step: 1e-4, integrator: symplectic_euler}\nrods: [{" + traits + "}]\n"));
  };
  scene("formulation: isotropic").save(path);
  for (const char* other : {"formulation: general", "stretching: projected"})
    EXPECT_THROW(scene(other).load(path), std::runtime_error) << other;
  EXPECT_NO_THROW(scene("formulation: auto").load(path));
  std::remove(path.c_str());
}

TEST(SavedStateFile, restartsRodsWithoutFramesBitEqual)
{
  const std::string path = testing::TempDir() + "/slender_sim_frameless";
  const auto scene = [] {
    return Simulation(
        parseScene("time: {step: 1e-4, integrator: symplectic_euler}\nrods: [{name: rope, grasps: {pin: {nodes: [0], "
                   "hold: position}}}]\n"));
  };
  Simulation through = scene(), again = scene();
  runSteps(through, 25);
  through.save(path);
  EXPECT_FALSE(through.state().rods[0].framed());
  again.load(path);
  for (Simulation* s : {&through, &again})
  {
    s->grasps().attach(0, 0, 0, Hold::frame);
    runSteps(*s, 25);
    EXPECT_TRUE(s->state().rods[0].framed());
  }
  expectSameBits(again.state(), through.state());
  std::remove(path.c_str());
}

TEST(SavedStateFile, sayWhyItCannotBeWritten)
{
  const Simulation simulation = twoRodSimulation();
  try
  {
    simulation.save("/nonexistent/folder/state");
    FAIL();
  }
  catch (const std::runtime_error& error)
  {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/folder/state"), std::string::npos);
  }
}

TEST(Simulation, AGraspThatFollowsABodyTakesItsOffsetAnewWhenAttached)
{
  Simulation simulation(parseScene(R"(
time: {step: 0.01}
gravity: [0, 0, 0]
bodies: [{name: hand, pose: {position: [0, 0, 1]}, motion: {topic: true}}]
rods:
  - centerline: {straight: {edges: 20}}
    grasps: {g: {edges: [0], motion: {body: hand}, attach: initial}}
)"));
  const auto step = [&](double x) {
    SceneInputs inputs = simulation.defaultInputs();
    inputs.bodies[0].X_WG.position << x, 0, 1;
    ASSERT_TRUE(simulation.step(inputs).ok);
  };
  step(0.01);
  EXPECT_NEAR(simulation.state().rods[0].x(0, 0), 0.01, 1e-12);   // goes with the hand
  simulation.grasps().release(0);
  step(0.02);
  const Eigen::Vector3d node = simulation.state().rods[0].x.col(3);
  simulation.grasps().attach(0, 3, 3, Hold::frame);
  step(0.02);
  EXPECT_LT((simulation.state().rods[0].x.col(3) - node).norm(), 1e-12);   // the hand stands still: nothing jumps
}

/// `attach: section` tells where the held section begins; one that is taken elsewhere, later, stays where it is.
TEST(Simulation, NothingJumpsWhenAGraspIsAttachedElsewhere)
{
  for (const std::string motion : {"{body: hand}", "{table: [[0, 1, 0, 0, 0, 0, 0, 1], [1, 1, 0, 0, 0, 0, 0, 1]]}"})
  {
    Simulation simulation(parseScene(R"(
time: {step: 0.01}
bodies: [{name: hand, pose: {position: [1, 0, 0]}, motion: {topic: true}}]
rods: [{centerline: {straight: {edges: 20}}, grasps: {left: {edges: [0]}, right: {edges: [-1], motion: )" +
                                     motion + "}}}]\n"));
    runSteps(simulation, 2);
    EXPECT_EQ(simulation.state().rods[0].x(0, 20), 1.0);
    simulation.grasps().release(1);
    runSteps(simulation, 20);
    const Eigen::Matrix3Xd fallen = simulation.state().rods[0].x;
    ASSERT_LT(fallen(2, 10), -0.05);
    simulation.grasps().attach(1, 10, 10, Hold::frame);
    runSteps(simulation, 10);
    EXPECT_LT((simulation.state().rods[0].x.col(10) - fallen.col(10)).norm(), 1e-12) << motion;
    simulation.reset();
    runSteps(simulation, 2);
    EXPECT_EQ(simulation.state().rods[0].x(0, 20), 1.0);   // the section itself again
  }
}

TEST(Simulation, SaysWhereInTheFileARodCannotBeComposed)
{
  const auto refusal = [](const std::vector<std::string>& overrides) -> std::string {
    try
    {
      Simulation simulation(parseScene(two_rods, "two.yaml", overrides));
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal({"rods.1.stretching=projected"})
                .find("two.yaml:9: rods.1 (b): stretching: projected takes explicit steps"),
            0u)
      << refusal({"rods.1.stretching=projected"});
  EXPECT_EQ(
      refusal({"rods.0.formulation=isotropic"}).find("two.yaml:4: rods.0 (a): formulation: isotropic does not apply"),
      0u);
  const std::string touching = refusal(
      {"rods.0.contact={}", "rods.1.contact={}", "rods.1.centerline.straight={from: [0.5, -1, 0], to: [0.5, 1, 0]}"});
  EXPECT_EQ(touching.find("two.yaml: rod 'a' and rod 'b' cross by "), 0u) << touching;
  try
  {
    Simulation(
        parseScene("bodies: [{name: ball, mass: 1, shape: {sphere: {radius: 0.1}}, pose: {position: [0, 0, 0.1]}}]\n"
                   "obstacles: [{name: floor, shape: {plane: {}}}]"));
    FAIL();
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("body 'ball' and obstacle 'floor' touch as the scene starts"),
              std::string::npos)
        << error.what();
  }
}

TEST(Simulation, AGapBelowRoundingErrorsIsNamed)
{
  try
  {
    Simulation(
        parseScene("contact: {gap: 1e-12}\nbodies: [{name: ball, mass: 1, shape: {sphere: {radius: 0.1}}, pose: "
                   "{position: [0, 0, 0.2]}}]\nobstacles: [{name: floor, shape: {plane: {}}}]"));
    FAIL();
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("contact.gap is 1e-12 m"), std::string::npos) << error.what();
  }
}

TEST(Simulation, FormulationIsChosenWhereItApplies)
{
  const auto build = [](const std::vector<std::string>& overrides) {
    return Simulation(parseScene(R"(
time: {step: 1e-4, integrator: symplectic_euler}
rods: [{centerline: {straight: {edges: 20}}, material: {bend_modulus: 1e-4, twist_modulus: 1e-4, stretch_modulus: 10}, grasps: {a: {edges: [0]}}}]
)",
                                 "t", overrides));
  };
  const auto refusal = [&](const std::vector<std::string>& overrides) {
    try
    {
      build(overrides);
    }
    catch (const SceneError& error)
    {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(build({}).rodModel(0).isotropic);
  EXPECT_FALSE(build({"rods.0.formulation=general"}).rodModel(0).isotropic);
  EXPECT_FALSE(build({"rods.0.damping.stiffness=0.1"}).rodModel(0).isotropic);
  EXPECT_FALSE(build({"rods.0.material.bend_modulus=[1e-4, 2e-4]"}).rodModel(0).isotropic);
  EXPECT_FALSE(build({"time.integrator=implicit_euler"}).rodModel(0).isotropic);
  EXPECT_FALSE(build({"rods.0.curvature=compensated"}).rodModel(0).isotropic);
  EXPECT_EQ(build({"rods.0.curvature=compensated"}).rodModel(0).curvature, Curvature::compensated);
  EXPECT_TRUE(build({"rods.0.stretching=projected"}).rodModel(0).inextensible);
  EXPECT_NE(refusal({"rods.0.formulation=isotropic", "rods.0.material.bend_modulus=[1e-4, 2e-4]"})
                .find("depends on the direction"),
            std::string::npos);
  EXPECT_NE(refusal({"rods.0.formulation=isotropic", "time.integrator=bdf2"}).find("symplectic_euler"),
            std::string::npos);
  EXPECT_NE(refusal({"rods.0.stretching=projected", "time.integrator=bdf2"}).find("material.inextensible"),
            std::string::npos);

  // and a projected run holds its lengths, also after saving and loading
  Simulation a = build({"rods.0.stretching=projected"}), b = build({"rods.0.stretching=projected"});
  runSteps(a, 50);
  const std::string file = ::testing::TempDir() + "projected_state";
  a.save(file);
  b.load(file);
  runSteps(a, 20);
  runSteps(b, 20);
  expectSameBits(a.state(), b.state());
  Simulation stiff = build({}), general = build({"rods.0.stretching=projected", "rods.0.formulation=general"});
  EXPECT_THROW(stiff.load(file), std::runtime_error);   // other equations: not the same run going on
  EXPECT_THROW(general.load(file), std::runtime_error);
}

}   // namespace
}   // namespace slender
