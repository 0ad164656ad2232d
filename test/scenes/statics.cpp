// Statics through scenes: point loads, equilibria under growing loads, paths through folds, critical loads, and the
// program `simulate --statics`.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/shell.h"

namespace slender {
namespace {

namespace fs = std::filesystem;

std::string number(double value)
{
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

/// A rod of B = L = 1 along x without weight; `more` are further keys of the rod, `scene` of the scene.
std::string rodScene(int edges, const std::string& more, const std::string& scene = "")
{
  return "gravity: [0, 0, 0]\n" + scene +
         "\nrods:\n  - name: rod\n    centerline: {straight: {edges: " + std::to_string(edges) +
         "}}\n    director: [0, 1, 0]\n    material: {linear_density: 1, stretch_modulus: 1e5, bend_modulus: 1, "
         "twist_modulus: 0.8}\n    " +
         more + "\n";
}

StaticsRun statics(const std::string& yaml, const std::vector<std::string>& overrides = {})
{
  Simulation simulation(parseScene(yaml, "t", overrides), false);
  return simulation.runStatics();
}

std::string problemsOf(const std::string& yaml, const std::vector<std::string>& overrides = {})
{
  try
  {
    Simulation simulation(parseScene(yaml, "t", overrides), false);
  }
  catch (const SceneError& error)
  {
    return error.what();
  }
  return "";
}

// ---------------------------------------------------------------- columns

struct Ends
{
  const char* name;
  const char* grasps;
  double critical;   ///< of B / L^2 [Timoshenko, Gere, Theory of Elastic Stability, 2.1-2.4]
};

class EulerColumn : public testing::TestWithParam<Ends>
{};

/// Both ends are held and squeezed together, so that the compression alone makes the load; the rod may buckle to any
/// side.
std::string squeezedColumn(const Ends& ends, double load)
{
  const double strain = load / 1e5;
  return rodScene(80, std::string("grasps: ") + ends.grasps + "\n    initial: {straight: {to: [" + number(1 - strain) +
                          ", 0, 0], edges: 80}}");
}

TEST_P(EulerColumn, isStraightBelowTheCriticalLoadAndBentAboveIt)
{
  // 80 edges: the load is off by second order, at most (2 pi / 80)^2 / 12 = 5e-4; the strain of 4e-4 changes the length
  // by as much. Both are far below the 2 % on either side.
  const StaticsRun below = statics(squeezedColumn(GetParam(), 0.98 * GetParam().critical));
  ASSERT_TRUE(below.end.ok) << below.end.message;
  ASSERT_EQ(below.rows.size(), 1u);
  EXPECT_TRUE(below.rows[0].report.stable);
  EXPECT_EQ(below.rows[0].report.escapes, 0);
  EXPECT_LT(below.rows[0].nodes[0].bottomRows(2).cwiseAbs().maxCoeff(), 1e-6);

  const StaticsRun above = statics(squeezedColumn(GetParam(), 1.02 * GetParam().critical));
  ASSERT_TRUE(above.end.ok) << above.end.message;
  EXPECT_TRUE(above.rows[0].report.stable);
  EXPECT_GE(above.rows[0].report.escapes, 1);
  // 2 % of a strain of 1e-4 and more, as a bow of the length
  EXPECT_GT(above.rows[0].nodes[0].bottomRows(2).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT(above.rows[0].report.residual, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(
    Ends, EulerColumn,
    testing::Values(Ends{"clamped_clamped", "{a: {edges: [0]}, b: {edges: [-1]}}", 4 * M_PI* M_PI},
                    Ends{"clamped_pinned", "{a: {edges: [0]}, b: {nodes: [-1], hold: position}}", 20.1907},
                    Ends{"pinned_pinned", "{a: {nodes: [0], hold: position}, b: {nodes: [-1], hold: position}}",
                         M_PI* M_PI}),
    [](const auto& info) { return info.param.name; });

std::string loadedColumn(int edges, const std::string& statics, const std::string& force = "[-1, 0, 0]")
{
  return rodScene(edges, "grasps: {foot: {edges: [0]}}\n    loads: [{at: end, force: " + force + "}]",
                  "statics: " + statics);
}

constexpr double kFree = M_PI * M_PI / 4;   // clamped and free

TEST(Columns, underADeadLoadOnTheFreeEnd)
{
  const StaticsRun run =
      statics(loadedColumn(80, "{factors: [" + number(0.98 * kFree) + ", " + number(1.02 * kFree) + "]}"));
  ASSERT_TRUE(run.end.ok) << run.end.message;
  ASSERT_EQ(run.rows.size(), 2u);
  EXPECT_TRUE(run.rows[0].report.stable && run.rows[1].report.stable);
  EXPECT_LT(run.rows[0].nodes[0].bottomRows(2).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT(run.rows[1].nodes[0].bottomRows(2).cwiseAbs().maxCoeff(), 0.1);   // elastica at 1.02 times the load: 0.22
}

double criticalError(int edges)
{
  const StaticsRun run = statics(loadedColumn(edges, "{buckling: true}"));
  EXPECT_TRUE(run.end.ok) << run.end.message;
  EXPECT_TRUE(run.rows.empty());
  EXPECT_FALSE(run.critical->fold);
  EXPECT_LT(run.critical->beyond - run.critical->factor, 1e-6 * run.critical->factor);
  // the mode is across: 1 - cos(pi x / 2)
  const Eigen::Matrix4Xd& mode = run.critical->at.modes[0];
  EXPECT_LT(mode.row(0).cwiseAbs().maxCoeff(), 1e-3 * mode.middleRows(1, 2).cwiseAbs().maxCoeff());
  const int middle = edges / 2;
  EXPECT_NEAR(mode.col(middle).segment<2>(1).norm() / mode.col(edges).segment<2>(1).norm(), 1 - std::cos(M_PI / 4),
              2.0 / (edges * edges));
  return run.critical->factor / kFree - 1;
}

TEST(Columns, theCriticalLoadInOneCallIsEulersToTheErrorOfTheMesh)
{
  // Second order in the edge's length: of a chain of rigid links with springs, clamped by half a link, (pi / (4 n))^2 /
  // 3 and less; and the strain P / (E A) = 2.5e-5 changes length and stiffness by as much.
  const double coarse = criticalError(10), fine = criticalError(40);
  EXPECT_LT(std::abs(coarse), std::pow(M_PI / 40, 2) + 1e-4);
  EXPECT_LT(std::abs(fine), std::pow(M_PI / 160, 2) + 1e-4);
}

TEST(Columns, aPerturbationRoundsTheBranchPointOff)
{
  const StaticsRun perfect = statics(loadedColumn(20, "{path: {to: 4, steps: 10}}")),
                   imperfect = statics(loadedColumn(20, "{path: {to: 4, steps: 10}, perturbation: 1e-3}"));
  ASSERT_TRUE(perfect.end.ok) << perfect.end.message;
  ASSERT_TRUE(imperfect.end.ok) << imperfect.end.message;
  EXPECT_FALSE(perfect.rows.back().report.stable);   // it stays straight, and says so
  EXPECT_LT(perfect.rows.back().nodes[0].bottomRows(2).cwiseAbs().maxCoeff(), 1e-6);
  for (const StaticsRow& row : imperfect.rows)
  {
    EXPECT_TRUE(row.report.stable) << row.factor;
    EXPECT_LT(row.report.residual, 1e-6);
  }
  EXPECT_NEAR(imperfect.rows.back().factor, 4.0, 1e-9);
  EXPECT_GT(imperfect.rows.back().displacement, 0.5);
}

TEST(Columns, aCriticalLoadThatIsNotThereIsSaid)
{
  const StaticsRun run = statics(loadedColumn(10, "{buckling: {up_to: 100}}", "[1, 0, 0]"));   // pulled
  EXPECT_FALSE(run.end.ok);
  EXPECT_NE(run.end.message.find("no critical load was found up to factor"), std::string::npos) << run.end.message;
}

// ---------------------------------------------------------------- end loads

TEST(PointLoads, bendACantileverLikeTheElastica)
{
  // Tip of a cantilever under a dead load across, P L^2 / B = 1, 2, 10 [Mattiasson, Int. J. Num. Meth. Eng. 17, 1981].
  // 100 edges: second order, 1e-4 of the deflection; stretching by 1e-4 at P = 10.
  const StaticsRun run = statics(loadedColumn(100, "{factors: [1, 2, 10]}", "[0, 0, -1]"));
  ASSERT_TRUE(run.end.ok) << run.end.message;
  const double down[] = {0.30172, 0.49346, 0.81061}, back[] = {0.05643, 0.16064, 0.55500};
  for (int k = 0; k < 3; ++k)
  {
    const Eigen::Vector3d tip = run.rows[k].nodes[0].col(100);
    EXPECT_NEAR(-tip.z(), down[k], 4e-4);
    EXPECT_NEAR(1 - tip.x(), back[k], 4e-4);
    EXPECT_NEAR(tip.y(), 0, 1e-9);
    EXPECT_LT(run.rows[k].report.residual, 1e-6);
  }
}

TEST(PointLoads, actBetweenNodesWithTheirMoment)
{
  // the force at 0.43 of an edge and its shares at the two nodes have the same sum and the same moment about the clamp
  const std::string held = "grasps: {foot: {edges: [0]}}\n    loads: ";
  Simulation between(parseScene(rodScene(10, held + "[{at: 0.543, force: [0, 0, -0.01]}]", "start: equilibrium")));
  const Wrench w = between.grasps().wrench(0);
  EXPECT_NEAR(w.force.z(), -0.01, 1e-9);
  EXPECT_NEAR(w.torque.y(), 0.01 * 0.543, 1e-6);   // the rod droops by 1e-3: of second order in the lever
  Simulation shares(parseScene(rodScene(
      10, held + "[{node: 5, force: [0, 0, -0.0057]}, {node: -5, force: [0, 0, -0.0043]}]", "start: equilibrium")));
  EXPECT_LT((between.state().rods[0].x - shares.state().rods[0].x).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(PointLoads, actInDynamics)
{
  for (const char* integrator :
       {"implicit_euler", "bdf2", "tr_bdf2", "implicit_midpoint", "generalized_alpha", "symplectic_euler"})
  {
    // nothing holds the rod: its momentum is force times time, to the tolerance of Newton's method
    Simulation free(parseScene(rodScene(10, "loads: [{at: end, force: [0.3, 0, 0]}, {at: start, force: [0, 0.1, 0]}]",
                                        std::string("time: {step: 1e-4, integrator: ") + integrator + "}")));
    for (int k = 0; k < 100; ++k)
    {
      const StepReport report = free.step(free.defaultInputs());
      ASSERT_TRUE(report.ok) << integrator << ": " << report.message;
    }
    const Eigen::Vector3d momentum = free.state().rods[0].v * free.rodModel(0).mass;
    EXPECT_LT((momentum - Eigen::Vector3d(0.3, 0.1, 0) * 0.01).norm(), 1e-7) << integrator;
  }
}

TEST(PointLoads, letADampedRodComeToRestAtTheirEquilibrium)
{
  const std::string rod =
      "grasps: {foot: {edges: [0]}}\n    damping: {mass: 7}\n    loads: [{at: end, force: [0, 0, -0.5]}]";
  Simulation moving(parseScene(rodScene(20, rod, "time: {step: 0.02}"))),
      resting(parseScene(rodScene(20, rod, "start: equilibrium")));
  for (int k = 0; k < 500; ++k)
    ASSERT_TRUE(moving.step(moving.defaultInputs()).ok);
  EXPECT_LT((moving.state().rods[0].x - resting.state().rods[0].x).cwiseAbs().maxCoeff(), 1e-6);
  ASSERT_TRUE(resting.startReport());
  EXPECT_GT(resting.startReport()->lowest_eigenvalue, 0);
}

/// Held at its start, and guided at its end by two pins that let it twist.
std::string twistedRod(const std::string& scene, const std::string& torque)
{
  return rodScene(20,
                  "grasps: {foot: {edges: [0]}, guide: {nodes: [-1], hold: position}, guide2: {nodes: [-2], hold: "
                  "position}}\n    loads: [{at: end, torque: " +
                      torque + "}]",
                  scene);
}

TEST(PointLoads, aTorqueAboutTheTangentTwistsTheRod)
{
  // twist M L / beta from the clamp to the middle of the last edge, which turns as a whole; the clamp bears M about x
  const double torque = 0.4, expected = torque / 0.8 * (1 - 0.5 / 20);
  for (const char* scene : {"start: equilibrium", "time: {integrator: implicit_euler}", "time: {integrator: bdf2}",
                            "time: {integrator: tr_bdf2}", "time: {integrator: symplectic_euler, step: 1e-5}"})
  {
    Simulation simulation(parseScene(twistedRod(scene, number(torque))));
    EXPECT_TRUE(simulation.config().warnings.empty());
    for (int k = 0; k < 3 && !simulation.startReport(); ++k)
    {
      const StepReport report = simulation.step(simulation.defaultInputs());
      ASSERT_TRUE(report.ok) << scene << ": " << report.message;
    }
    const Eigen::Vector3d d1 = simulation.state().rods[0].d1.col(19);
    EXPECT_NEAR(std::atan2(d1.z(), d1.y()), expected, 1e-6) << scene;   // d1 is y at the clamp, and turns about x
    EXPECT_LT((simulation.grasps().wrench(0).torque - Eigen::Vector3d(torque, 0, 0)).norm(), 1e-6) << scene;
  }
}

TEST(PointLoads, aTorqueBucklesAGuidedRodAtGreenhillsLoad)
{
  // clamped ends: M L / B = 8.9868 = 2 * 4.4934 [Greenhill 1883]. The end is guided, so that the torque has a potential
  // and the load is right.
  const StaticsRun run = statics(twistedRod("statics: {buckling: true}", "1"), {"rods.0.centerline.straight.edges=80"});
  ASSERT_TRUE(run.end.ok) << run.end.message;
  // the guide holds the last edge, 1/80 of the length, which then does not bend: that much shorter; and second order in
  // the edges
  EXPECT_NEAR(run.critical->factor * (1 - 1.0 / 80), 8.9868, 0.005 * 8.9868);
}

TEST(PointLoads, aTorqueThatIsNotGuidedIsWarnedOf)
{
  const std::string loads = "grasps: {foot: {edges: [0]}}\n    loads: [{at: end, torque: 0.1}]";
  const Simulation simulation(parseScene(rodScene(20, loads)));
  ASSERT_EQ(simulation.config().warnings.size(), 1u);
  EXPECT_NE(simulation.config().warnings[0].find("has no potential"), std::string::npos);
}

TEST(PointLoads, whatIsRefused)
{
  const auto loads = [](const std::string& text, const std::string& more = "grasps: {foot: {edges: [0]}}") {
    return problemsOf(rodScene(10, more + "\n    loads: " + text));
  };
  EXPECT_EQ(loads("[{at: end, force: [0, 0, 1]}]"), "");
  EXPECT_NE(loads("[{at: end, torque: [0, 1, 0]}]").find("has no potential"), std::string::npos);
  EXPECT_NE(loads("[{force: [0, 1, 0]}]").find("must have either at"), std::string::npos);
  EXPECT_NE(loads("[{at: end, node: 1, force: [0, 1, 0]}]").find("must have either at"), std::string::npos);
  EXPECT_NE(loads("[{at: middle, force: [0, 1, 0]}]").find("start or end"), std::string::npos);
  EXPECT_NE(loads("[{at: 1.5, force: [0, 1, 0]}]").find("beyond the end of the rod"), std::string::npos);
  EXPECT_NE(loads("[{node: 11, force: [0, 1, 0]}]").find("node = 11"), std::string::npos);
  EXPECT_NE(loads("[{at: end}]").find("neither force"), std::string::npos);
  EXPECT_NE(loads("[{at: end, torque: 1}]", "naturally_straight: true").find("nothing balances the torque"),
            std::string::npos);
  EXPECT_NE(problemsOf(twistedRod("time: {integrator: implicit_midpoint}", "1")).find("implicit_midpoint"),
            std::string::npos);
  EXPECT_NE(problemsOf(twistedRod("time: {integrator: symplectic_euler}", "1"), {"rods.0.formulation=isotropic"})
                .find("torque"),
            std::string::npos);
}

// ---------------------------------------------------------------- paths

/// A shallow arch between clamps that is pressed down in its middle, kept in its plane by a section that is stiff
/// across it.
std::string arch(const std::string& statics)
{
  const double half = 0.6, radius = 1 / (2 * half);
  return "gravity: [0, 0, 0]\nstatics: " + statics +
         "\nrods:\n  - name: arch\n    centerline: {arc: {center: [0, 0, 0], start: [" +
         number(-radius * std::sin(half)) + ", 0, " + number(radius * std::cos(half)) +
         "], axis: [0, 1, 0], angle: 1.2, edges: 60}}\n    director: [0, 1, 0]\n" +
         "    material: {linear_density: 1, stretch_modulus: 1e4, bend_modulus: [1000, 1], twist_modulus: 1000}\n" +
         "    grasps: {a: {edges: [0]}, b: {edges: [-1]}}\n    loads: [{node: 30, force: [0, 0, -1]}]\n";
}

TEST(Paths, goThroughTheFoldOfAShallowArch)
{
  const StaticsRun run = statics(arch("{path: {to: 300, steps: 50}, buckling: {up_to: 300}}"));
  ASSERT_TRUE(run.end.ok) << run.end.message;
  ASSERT_TRUE(run.critical);
  double highest = 0, lowest_after = 1e300, previous = -1;
  bool fell = false;
  int unstable = 0;
  Eigen::Matrix3Xd before = run.rows[0].nodes[0];
  for (const StaticsRow& row : run.rows)
  {
    // no step leaves a piece of the path out: 1.5 times a fiftieth of the length in the mean, twice that in the middle
    // of the arch
    EXPECT_LT((row.nodes[0] - before).colwise().norm().maxCoeff(), 2 * 1.5 / 50);
    before = row.nodes[0];
    unstable += row.report.stable ? 0 : 1;
    EXPECT_LT(row.report.residual, 1e-6) << row.factor;
    fell = fell || row.factor < previous;
    (fell ? lowest_after : highest) = fell ? std::min(lowest_after, row.factor) : std::max(highest, row.factor);
    previous = row.factor;
    // stable up to the critical load; the step that goes over the limit may end on the falling side, where it is not
    if (unstable == 0)
      EXPECT_LT(row.factor, run.critical->beyond);
  }
  EXPECT_TRUE(fell);
  EXPECT_GE(unstable, 4);                   // the load falls in steps of at most 1/50 of the path's length
  EXPECT_LT(lowest_after, 0.6 * highest);   // 16 after 33: followed down to the lower fold
  EXPECT_TRUE(run.critical->fold);
  EXPECT_LE(highest, run.critical->beyond);
  EXPECT_GT(highest, run.critical->factor - 300.0 / 50);   // within a step
  EXPECT_TRUE(run.rows.back().report.stable);
  EXPECT_NEAR(run.rows.back().factor, 300, 1e-6);                               // and came out on the other side
  EXPECT_LT(run.rows.back().nodes[0](2, 30), run.rows.back().nodes[0](2, 0));   // hanging below its ends
}

TEST(Paths, gravityOrLoadsAloneAreScaledOnRequest)
{
  const std::string rod = "grasps: {foot: {edges: [0]}}\n    loads: [{at: end, force: [0, 0, -0.02]}]";
  const auto root = [&](const std::string& scales) {
    Simulation simulation(parseScene(rodScene(10, rod, "statics: {factors: [2], scales: " + scales + "}"), "t",
                                     {"gravity=[0, 0, -0.01]"}),
                          false);
    EXPECT_TRUE(simulation.runStatics().end.ok);
    return -simulation.grasps().wrench(0).force.z();
  };
  EXPECT_NEAR(root("all"), 0.06, 1e-8);   // 2 (0.01 + 0.02)
  EXPECT_NEAR(root("gravity"), 0.04, 1e-8);
  EXPECT_NEAR(root("loads"), 0.05, 1e-8);
}

TEST(Paths, whatIsRefused)
{
  const auto refused = [](const std::string& statics, const std::vector<std::string>& more = {}) {
    return problemsOf(loadedColumn(10, statics), more);
  };
  EXPECT_EQ(refused("{factors: [1]}"), "");
  EXPECT_NE(refused("{factors: [1], path: {to: 2}}").find("leave one of them out"), std::string::npos);
  EXPECT_NE(refused("{path: {from: 1, to: 1}}").find("must differ"), std::string::npos);
  EXPECT_NE(refused("{factors: [1], scales: gravity}").find("nothing to scale"), std::string::npos);
  EXPECT_NE(refused("{buckling: true}", {"rods.0.contact={}"}).find("has contact"), std::string::npos);
  EXPECT_NE(refused("{factor: 1}").find("did you mean factors"), std::string::npos);
}

// ---------------------------------------------------------------- start

const char* const pendulum = R"(
start: {equilibrium: true}
rods:
  - name: rope
    centerline: {straight: {to: [0, 0, -1], edges: 10}}
    grasps: {top: {edges: [0]}}
bodies:
  - {name: bob, mass: 1, shape: {sphere: {radius: 0.05}}, pose: {position: [0, 0, -1.05]}, velocity: {linear: [0.2, 0, 0], angular: [0, 0.1, 0]}, welds: [{rod: rope, edge: -1}]}
)";

TEST(StartAtEquilibrium, bodiesKeepTheirVelocitiesWhenAsked)
{
  const Simulation resting(parseScene(pendulum));
  EXPECT_EQ(resting.state().bodies[0].velocity.linear.norm(), 0);
  Simulation moving(parseScene(pendulum, "t", {"start.keep_velocities=true"}));
  EXPECT_EQ(moving.state().bodies[0].velocity.linear, Eigen::Vector3d(0.2, 0, 0));
  EXPECT_EQ(moving.state().bodies[0].velocity.angular, Eigen::Vector3d(0, 0.1, 0));
  EXPECT_EQ(moving.state().bodies[0].X_WB.position, resting.state().bodies[0].X_WB.position);
  ASSERT_TRUE(moving.step(moving.defaultInputs()).ok);
  EXPECT_GT(moving.state().bodies[0].X_WB.position.x(),
            resting.state().bodies[0].X_WB.position.x() + 0.5 * 0.2 * 0.005);
  EXPECT_NE(problemsOf(pendulum, {"start={keep_velocities: true}"}).find("needs equilibrium: true"), std::string::npos);
}

TEST(StartAtEquilibrium, reportsWhatItFound)
{
  const Simulation simulation(parseScene(pendulum));
  ASSERT_TRUE(simulation.startReport());
  EXPECT_TRUE(simulation.startReport()->stable);
  EXPECT_LT(simulation.startReport()->residual, 1e-6);
  EXPECT_FALSE(Simulation(parseScene(pendulum, "t", {"start=as_given"})).startReport());
}

// ---------------------------------------------------------------- grasps

TEST(GraspFrames, aDirectionStandsInForTheQuaternion)
{
  // a quarter turn of the far end about y, once by direction and once by a quaternion
  const auto scene = [](const std::string& right) {
    return rodScene(30, "grasps: {left: {edges: [0]}, right: {edges: [-1], " + right + "}}", "start: equilibrium");
  };
  const std::string half = number(std::sqrt(0.5));
  Simulation by_direction(parseScene(scene("direction: [0, 0, -3], motion: {table: [[0, 0.8, 0, -0.2]]}")));
  Simulation by_quaternion(parseScene(scene("motion: {table: [[0, 0.8, 0, -0.2, 0, " + half + ", 0, " + half + "]]}")));
  EXPECT_LT((by_direction.state().rods[0].x - by_quaternion.state().rods[0].x).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((by_direction.grasps().pose(1).orientation * Eigen::Vector3d::UnitX() - Eigen::Vector3d(0, 0, -1)).norm(),
            1e-12);
  EXPECT_LT((by_direction.grasps().pose(1).orientation * Eigen::Vector3d::UnitY() - Eigen::Vector3d(0, 1, 0)).norm(),
            1e-12);

  // fixed where it is, and turned about its own tangent by a director, whose normal part counts
  Simulation turned(parseScene(scene("director: [5, 2, 2]")));
  EXPECT_LT((turned.grasps().pose(1).position - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT(
      (turned.grasps().pose(1).orientation * Eigen::Vector3d::UnitY() - Eigen::Vector3d(0, 1, 1).normalized()).norm(),
      1e-12);
  EXPECT_NEAR(turned.grasps().wrench(0).torque.x(), 0.8 * M_PI / 4, 1e-6);   // beta times the turn over the length

  // without statics the section would turn within one step
  const Simulation jumps(parseScene(scene("direction: [0, 0, -1]"), "t", {"start=as_given"}));
  ASSERT_EQ(jumps.config().warnings.size(), 1u);
  EXPECT_NE(jumps.config().warnings[0].find("90 degrees"), std::string::npos) << jumps.config().warnings[0];
}

TEST(GraspFrames, whatIsRefused)
{
  const auto refused = [](const std::string& right) {
    return problemsOf(rodScene(10, "grasps: {right: {edges: [-1], " + right + "}}"));
  };
  EXPECT_NE(refused("direction: [0, 0, 0]").find("must not be zero"), std::string::npos);
  EXPECT_NE(refused("director: [0, 0, 0]").find("must not be zero"), std::string::npos);
  EXPECT_NE(refused("direction: [0, 0, 1], director: [0, 0, 2]").find("is along direction"), std::string::npos);
  EXPECT_NE(refused("director: [1, 0, 0]").find("along the tangent"), std::string::npos);
  EXPECT_NE(refused("direction: [-1, 0, 0]").find("opposite to the tangent"), std::string::npos);
  EXPECT_NE(refused("direction: [0, 0, 1], motion: {table: [[0, 1, 0, 0, 0, 0, 0, 1]]}").find("has an orientation"),
            std::string::npos);
  EXPECT_NE(refused("direction: [0, 0, 1], motion: {topic: true}").find("must be left out"), std::string::npos);
  EXPECT_NE(refused("direction: [0, 0, 1], hold: position").find("needs hold: frame"), std::string::npos);
  EXPECT_NE(refused("direction: [0, 0, 1], attach: initial").find("needs attach: section"), std::string::npos);
  // as before
  EXPECT_NE(refused("motion: {table: [[0, 1, 0, 0]]}").find("[t, x, y, z, qx, qy, qz, qw]"), std::string::npos);
}

// ---------------------------------------------------------------- ranges

TEST(Ranges, arcsOfSeveralTurnsAndScaledGravity)
{
  const std::string coil = "gravity: [0, 0, -1e8]\nrods: [{centerline: {arc: {angle: 18.84955592153876, edges: 90}}}]";
  Simulation simulation(parseScene(coil), false);
  // chords: (2 pi / 30)^2 / 24
  EXPECT_NEAR(simulation.rodModel(0).rest_length.sum(), 6 * M_PI, 6 * M_PI * std::pow(2 * M_PI / 30, 2) / 20);
  EXPECT_NE(problemsOf(coil, {"rods.0.centerline.arc.edges=6"}).find("may turn by less than pi"), std::string::npos);
}

// ---------------------------------------------------------------- the program

using test::Result;

class SimulateStatics : public testing::Test
{
protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  Result run(const std::string& scene, const std::string& arguments)
  {
    std::ofstream(folder_ + "/scene.yaml") << scene;
    return test::shell(std::string(SLENDER_SIMULATE) + " " + folder_ + "/scene.yaml " + arguments);
  }
  std::vector<std::string> lines(const std::string& file)
  {
    std::ifstream in(folder_ + "/out/" + file);
    std::vector<std::string> all;
    for (std::string line; std::getline(in, line);)
      all.push_back(line);
    return all;
  }
  const std::string folder_ = testing::TempDir() + "/slender_sim_statics_" + std::to_string(getpid());
};

TEST_F(SimulateStatics, printsTheEquilibriumAndWritesTables)
{
  const Result result =
      run(loadedColumn(20, "{factors: [1, 3], buckling: true}"), "--statics --csv " + folder_ + "/out");
  EXPECT_EQ(result.status, 0) << result.output;
  for (const char* word : {"critical factor   2.46", "load factor       1\n", "load factor       3\n", "residual",
                           " J\n", "lowest eigenvalue", "1/s^2", "stable          yes, 1"})
    EXPECT_NE(result.output.find(word), std::string::npos) << word << " not in\n" << result.output;
  const std::vector<std::string> rows = lines("statics.csv"), modes = lines("statics_modes.csv");
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[0], "step,factor,residual,energy [J],lowest eigenvalue [1/s^2],stable,escapes,displacement [m]");
  EXPECT_EQ(rows[2].rfind("1,3,", 0), 0u) << rows[2];
  EXPECT_EQ(rows[3].rfind("-1,2.46", 0), 0u) << rows[3];
  EXPECT_EQ(modes.size(), 1u + 3 * 21);
  // a later run without statics leaves no table of this one
  EXPECT_EQ(run(loadedColumn(20, "{factors: [1, 3]}"), "--duration 0.01 --quiet --csv " + folder_ + "/out").status, 0);
  EXPECT_TRUE(lines("statics.csv").empty());
}

TEST_F(SimulateStatics, exitStatusAndMessages)
{
  // nothing holds it
  const Result nothing = run(rodScene(10, "naturally_straight: true"), "--statics --set 'gravity=[0, 0, -1]'");
  EXPECT_EQ(nothing.status, 3) << nothing.output;
  EXPECT_NE(nothing.output.find("drift"), std::string::npos) << nothing.output;
  EXPECT_EQ(nothing.output.find("shorter step"), std::string::npos) << nothing.output;
  EXPECT_EQ(run(loadedColumn(10, "{factors: [1]}"), "--statics --duration 1").status, 2);
  const Result unused = run(loadedColumn(10, "{factors: [1]}"), "--duration 0.01 --quiet");
  EXPECT_EQ(unused.status, 0) << unused.output;
  EXPECT_NE(unused.output.find("statics of the scene is for --statics"), std::string::npos) << unused.output;
  const std::string cloth =
      "cloths: [{grid: {corner: [0, 0, 0], sides: [[1, 0, 0], [0, 1, 0]], cells: 2}, contact: {}}]";
  const Result sheet = run(cloth, "--statics");
  EXPECT_EQ(sheet.status, 2) << sheet.output;
  EXPECT_NE(sheet.output.find("statics is not for cloth that has contact"), std::string::npos) << sheet.output;
}

}   // namespace
}   // namespace slender
