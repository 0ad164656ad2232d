// What a scene of threads gets that says little; and what it is told.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/thread/thread_flow.h"
#include "slender_sim/thread/thread_group.h"
#include "test/support/scenes.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

/// No edges, no deposits, no break-up.
const char* const plain = R"(
time: {step: 0.002, duration: 1}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.07], diameter: 0.005, flow: 3.0e-7}
    floor: {height: 0}
)";

std::string joinedWarningsOf(const std::string& scene, const std::vector<std::string>& overrides = {})
{
  std::string all;
  for (const std::string& warning : parseScene(scene, "t", overrides).warnings)
    all += warning + "\n";
  return all;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Short pieces that lie on the floor, youngest first.
ThreadGroupState lyingPieces(int count)
{
  ThreadGroupState state;
  Random random(3);
  for (int k = 0; k < count; ++k)
  {
    ThreadState piece = wigglyThread(5, random);
    piece.deposited.assign(piece.x.size(), 1);
    state.threads.push_back(piece);
  }
  state.start_volume = state.volumeBalance();
  return state;
}

TEST(ThreadVolume, PiecesThatLieOnTheFloorAreKeptWithoutALimit)
{
  ThreadGroupState state = lyingPieces(6);
  dropThreads(state, ThreadLimits{});
  EXPECT_EQ(state.threads.size(), 6u);
  EXPECT_EQ(state.dropped_volume, 0.0);
}

TEST(ThreadVolume, AccountsForWhatIsDroppedAndWhatLeaves)
{
  ThreadGroupState state = lyingPieces(6);
  for (Eigen::Vector3d& x : state.threads[1].x)
    x.z() = -10.0;
  ThreadLimits limits;
  limits.max_deposited = 12;
  limits.scene = Eigen::AlignedBox3d(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9));
  const double leaving = state.threads[1].totalVolume();
  dropThreads(state, limits);
  EXPECT_LT(state.threads.size(), 5u);
  ThreadVolumes volumes;
  volumes.add(state);
  EXPECT_DOUBLE_EQ(volumes.left, leaving);
  EXPECT_GT(volumes.dropped, 0.0);
  EXPECT_NEAR(volumes.missing(), 0.0, 1e-14);
  state.threads.pop_back();   // fluid that vanishes is seen
  ThreadVolumes less;
  less.add(state);
  EXPECT_GT(less.missing(), ThreadVolumes::kMostMissing);
}

/// Thin oil that drips: before, everything but the youngest piece on the floor was taken away.
TEST(ThreadVolume, NothingVanishesFromAThreadThatBreaks)
{
  Simulation simulation(parseScene(
      plain, "t",
      {"threads.0.fluid.viscosity=0.5", "threads.0.breakup_radius=2e-4",
       "threads.0.edges={feed: 0.002, longest: 0.004, shortest: 0.0008}", "threads.0.nozzle.position=[0, 0, 0.15]"}));
  std::size_t most = 0;
  for (int k = 0; k < 900; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    most = std::max(most, simulation.state().threads[0].threads.size());
  }
  EXPECT_GT(most, 2u);
  ThreadVolumes volumes;
  volumes.add(simulation.state().threads[0]);
  EXPECT_GT(volumes.fed, 0.0);
  EXPECT_EQ(volumes.dropped, 0.0);
  EXPECT_EQ(volumes.left, 0.0);
  EXPECT_NEAR(volumes.missing(), 0.0, 1e-11);
}

TEST(ThreadFlow, LandingIsThatOfTheReferenceCoils)
{
  // height, speed and coil radius of stable coils (coiling_grid.csv), thesis units
  const double coils[][3] = {{0.507201, 0.547944, 0.122618}, {2.02881, 0.618819, 0.394542},
                             {5.07201, 0.693318, 0.518066},  {10.144, 0.928499, 0.419419},
                             {25.3601, 2.271, 0.438022},     {50.7201, 5.993, 0.280522}};
  const double area = 0.25 * M_PI * 0.09 * 0.09;
  for (const auto& coil : coils)
  {
    const Landing landing = estimateLanding({5e-4, 0.2, 9.81, 0.09, 0.615 * area, coil[0]});
    EXPECT_NEAR(landing.speed / coil[1], 1.0, 0.13) << coil[0];   // a tight coil also brakes the thread
    EXPECT_LT(landing.coil_radius, 1.02 * coil[2]) << coil[0];
    EXPECT_GT(landing.coil_radius, 0.35 * coil[2]) << coil[0];
  }
}

TEST(ThreadFlow, WithoutGravityTheThreadKeepsItsSpeed)
{
  // so viscous that inertia does not matter
  const Landing landing = estimateLanding({1000, 1e4, 0.0, 0.01, 1e-6, 0.1});
  EXPECT_NEAR(landing.speed, 1e-6 / (0.25 * M_PI * 1e-4), 1e-8);
  EXPECT_NEAR(landing.coil_radius, 0.24 * 0.1, 1e-3);   // the viscous law
}

TEST(ThreadFlow, AThinFluidFallsFreely)
{
  const Landing landing = estimateLanding({1000, 1e-4, 9.81, 0.005, 1e-5, 0.3});
  const double start = 1e-5 / (0.25 * M_PI * 25e-6);
  EXPECT_NEAR(landing.speed, std::sqrt(start * start + 2 * 9.81 * 0.3), 1e-2 * landing.speed);
  EXPECT_FALSE(landing.slender());
}

/// The fall of thesis 5.5 with its lengths and times scaled by those of another fluid: coils without surface tension
/// are similar then.
ThreadFall coilingFall(double height, double density = 5e-4, double viscosity = 0.2)
{
  const double time = std::cbrt(viscosity / density / 400.0), length = time * time;
  return {density,
          viscosity,
          9.81,
          0.09 * length,
          0.615 * 0.25 * M_PI * 0.09 * 0.09 * length * length * length / time,
          height * length};
}

TEST(ThreadFlow, SeveralCoilsExistBetweenTheFoldsOfTheReference)
{
  // coiling.csv: branches 2 and 3 begin at 8.11, branches 5 and 6 end at 18.54. The stable coils next to this range and
  // to the gap that follows it are those at 7.61 and 21.56.
  for (const double height : {0.507201, 5.07201, 7.60802, 21.5561, 25.3601, 50.7201})
    EXPECT_FALSE(estimateLanding(coilingFall(height)).several_coils) << height;
  for (const double height : {8.11, 8.87602, 10.144, 13.4408, 15.7232, 18.54, 20.2881})
    EXPECT_TRUE(estimateLanding(coilingFall(height)).several_coils) << height;
  EXPECT_FALSE(estimateLanding(coilingFall(7.60802, 1400, 10)).several_coils);
  EXPECT_TRUE(estimateLanding(coilingFall(15.7232, 1400, 10)).several_coils);
  EXPECT_FALSE(estimateLanding({1000, 1e4, 0.0, 0.01, 1e-6, 0.1}).several_coils);   // no pendulum without gravity
}

TEST(ThreadFlow, ThinFluidsDripFromSlowNozzles)
{
  // water from 3 mm: B = 0.613, We = 1.065
  EXPECT_NEAR(leastJettingSpeed({1000, 1e-3, 9.81, 0.003, 1e-6, 0.1}, 0.072), 0.1599, 1e-4);
  // We = 4
  EXPECT_NEAR(leastJettingSpeed({1000, 1e-3, 0.0, 0.003, 1e-6, 0.1}, 0.072), std::sqrt(4 * 0.072 / (1000 * 0.003)),
              1e-12);
  EXPECT_EQ(leastJettingSpeed({1400, 10, 9.81, 0.003, 1e-6, 0.1}, 0.05), 0.0);
}

TEST(ThreadDefaults, WhatDripsIsRefused)
{
  const std::string slow =
      problemsOf(plain, {"threads.0.fluid={density: 1000, viscosity: 0.001, surface_tension: 0.072}"});
  EXPECT_TRUE(contains(slow, "threads.0.nozzle.flow")) << slow;
  EXPECT_TRUE(contains(slow, "drips")) << slow;
  EXPECT_TRUE(contains(slow, "Must be at least 1.62")) << slow;
  EXPECT_EQ(problemsOf(plain, {"threads.0.fluid={density: 1000, viscosity: 0.001, surface_tension: 0.072}",
                               "threads.0.nozzle.flow=3e-6"}),
            "");
}

TEST(ThreadDefaults, EdgesResolveTheCoilThatForms)
{
  for (const double height : {0.02, 0.07, 0.122, 0.3})
  {
    const SceneConfig scene =
        parseScene(plain, "t", {"threads.0.nozzle.position=[0, 0, " + std::to_string(height) + "]"});
    const ThreadConfig& thread = scene.threads[0];
    const Landing landing = estimateLanding({1400, 20, 9.81, 0.005, 3e-7, height});
    EXPECT_GE(edgesPerTurn(landing, thread.longest_edge), 19.9) << height;
    EXPECT_LE(thread.feed_length, 0.1 * height);
    EXPECT_LE(landing.frequency * thread.longest_step, 0.061);
    EXPECT_LT(thread.breakup_radius, 0.1 * landing.radius);
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings.front();
  }
}

std::string coilingScene(double height, const std::string& motion)
{
  const ThreadFall fall = coilingFall(height);
  return "time: {step: 0.05, duration: 100}\nthreads:\n  - fluid: {density: " + std::to_string(fall.density) +
         ", viscosity: " + std::to_string(fall.viscosity) +
         ", surface_tension: 0}\n    nozzle: {diameter: " + std::to_string(fall.diameter) +
         ", flow: " + std::to_string(fall.flow) + ", " + motion + "}\n    floor: {height: 0}\n";
}

ThreadConfig standingNozzle(double height)
{
  return parseScene(coilingScene(height, "position: [0, 0, " + std::to_string(height) + "]"), "t").threads[0];
}

/// With edges of 0.7 or steps of 0.35 of the usual length the coil at 15.72, 1 % below the end of its branch, is lost.
TEST(ThreadDefaults, EdgesAndStepsAreFinerWhereSeveralCoilsExist)
{
  for (const double height : {10.144, 15.7232})
  {
    const ThreadConfig thread = standingNozzle(height);
    const Landing landing = estimateLanding(coilingFall(height));
    EXPECT_GE(edgesPerTurn(landing, thread.longest_edge), 39.9) << height;
    EXPECT_LE(landing.frequency * thread.longest_step, 0.01201) << height;
    EXPECT_LE(thread.feed_length, height / 49.9) << height;
    EXPECT_LE(thread.highest_edge, height / 49.9) << height;
    EXPECT_LE(thread.shortest_edge, 0.2001 * thread.longest_edge) << height;
  }
  for (const double height : {7.60802, 21.5561})
  {
    const ThreadConfig thread = standingNozzle(height);
    const Landing landing = estimateLanding(coilingFall(height));
    EXPECT_NEAR(edgesPerTurn(landing, thread.longest_edge), 20.0, 0.1) << height;
    EXPECT_NEAR(landing.frequency * thread.longest_step, 0.06, 1e-4) << height;
    EXPECT_NEAR(thread.feed_length, height / 25.0, 1e-3 * height) << height;
  }
}

/// At neither end of its way several coils exist, in between they do.
TEST(ThreadDefaults, ANozzleThatRisesGetsTheFinestOfAllItsHeights)
{
  const std::string down = "0, 0.7071067811865476, 0, 0.7071067811865476]";
  const ThreadConfig rising =
      parseScene(coilingScene(25.0, "motion: {table: [[0, 0, 0, 5, " + down + ", [100, 0, 0, 25, " + down + "]}"), "t")
          .threads[0];
  const Landing middle = estimateLanding(coilingFall(15.7232));
  EXPECT_GE(edgesPerTurn(middle, rising.longest_edge), 39.9);
  EXPECT_LE(middle.frequency * rising.longest_step, 0.01201);
  EXPECT_LT(rising.longest_step, 0.5 * standingNozzle(25.0).longest_step);
}

TEST(ThreadDefaults, WhatIsTooCoarseForTheCoilIsSaid)
{
  const std::string coarse = joinedWarningsOf(plain, {"threads.0.edges={feed: 0.005, longest: 0.01}"});
  EXPECT_TRUE(contains(coarse, "threads.0.edges.longest = 0.01: coils of a radius of about")) << coarse;
  EXPECT_TRUE(contains(coarse, "Use edges.longest: 0.0006")) << coarse;
  const std::string slow = joinedWarningsOf(plain, {"threads.0.edges={longest: 0.0006}", "time.step=0.01"});
  EXPECT_TRUE(contains(slow, "rad/s")) << slow;
  EXPECT_EQ(joinedWarningsOf(plain, {"threads.0.edges={longest: 0.0006}", "time.step=0.001"}), "");
}

TEST(ThreadDefaults, WhatIsNoThreadIsSaid)
{
  EXPECT_TRUE(
      contains(joinedWarningsOf(plain, {"threads.0.fluid.viscosity=0.001", "threads.0.fluid.surface_tension=0"}),
               "which is no thread"));
  EXPECT_TRUE(
      contains(joinedWarningsOf(plain, {"threads.0.nozzle.position=[0, 0, 0.008]"}), "less than two of its diameters"));
  for (const char* height : {"0.002", "0", "-0.01"})
    EXPECT_TRUE(contains(problemsOf(plain, {std::string("threads.0.nozzle.position=[0, 0, ") + height + "]"}),
                         "must be more than its radius 2.5 mm"))
        << height;
  EXPECT_TRUE(contains(problemsOf(plain, {"threads.0.edges={feed: 0.08}"}), "is more than half of the fall of 70 mm"));
  EXPECT_TRUE(contains(problemsOf(plain, {"threads.0.nozzle={diameter: 0.005, flow: 1e-7, motion: {table: [[0, 0, 0, "
                                          "0.05, 0, 0.7071067811865476, 0, 0.7071067811865476], "
                                          "[1, 0, 0, -0.01, 0, 0.7071067811865476, 0, 0.7071067811865476]]}}"}),
                       "threads.0.nozzle.motion"));
}

TEST(ThreadDefaults, WhatIsMissingIsSaid)
{
  const std::string text = R"(
threads:
  - nozzle: {position: [0, 0, 0.07], diameter: 0.005}
    floor: {height: 0}
)";
  const std::string all = joinedWarningsOf(text);
  EXPECT_TRUE(contains(all, "threads.0.fluid: is absent")) << all;
  EXPECT_TRUE(contains(all, "threads.0.nozzle.flow: is absent, so nothing flows")) << all;
}

TEST(ThreadDefaults, WhatThreadsIgnoreIsRefusedOrSaid)
{
  EXPECT_TRUE(
      contains(problemsOf(plain, {"time.error_tolerance=1e-5"}), "time.error_tolerance = 1e-5: is not for threads"));
  EXPECT_TRUE(contains(joinedWarningsOf(plain, {"wind={velocity: [1, 0, 0]}"}), "does not act on threads"));
  const std::string mixed = std::string(plain) + "rods: [{grasps: {left: {edges: [0]}}}]\n";
  EXPECT_EQ(problemsOf(mixed, {"time.error_tolerance=1e-5", "time.integrator=bdf2", "start=equilibrium"}), "");
  const std::string all =
      joinedWarningsOf(mixed, {"time.error_tolerance=1e-5", "time.integrator=bdf2", "start=equilibrium"});
  EXPECT_TRUE(contains(all, "whose steps are of fixed length")) << all;
  EXPECT_TRUE(contains(all, "which take implicit Euler steps")) << all;
  EXPECT_TRUE(contains(all, "they start as given")) << all;
}

TEST(ThreadDefaults, ANozzleThatGoesBelowItsFloorIsRefused)
{
  Simulation simulation(parseScene(plain, "t", {"threads.0.nozzle.motion={topic: true}"}));
  SceneInputs inputs = simulation.defaultInputs();
  inputs.threads[0].nozzle.position.z() = -0.001;
  const StepReport report = simulation.step(inputs);
  EXPECT_FALSE(report.ok);
  EXPECT_TRUE(contains(report.message, "keep it above")) << report.message;
}

/// Fed between a nozzle and a floor that are one edge apart, the edge can only grow thicker.
TEST(ThreadDefaults, AnEdgeThatGrowsIntoAPuddleIsRefused)
{
  ThreadModel m = honey();
  m.floor.present = true;
  Thread t = Thread::fromNozzle(m, {0, 0, 0.012}, 0.05);
  ThreadStepper stepper = t.stepper();
  StepReport report;
  for (int k = 0; k < 2000 && report.ok; ++k)
    report = stepper.step(t.state, t.inputs, 0.005);
  EXPECT_FALSE(report.ok);
  EXPECT_TRUE(contains(report.message, "raise the nozzle")) << report.message;
  for (int j = 0; j < t.state.edges(); ++j)
    EXPECT_LT(t.state.radius(j), 0.026);
}

TEST(ThreadDefaults, TouchingAtTheStartNamesBoth)
{
  const std::string text = std::string(plain) + R"(
    contact: {}
obstacles:
  - {name: table, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [0.051, 0, 0.05]}}
)";
  try
  {
    Simulation simulation(parseScene(text, "t"));
    FAIL();
  }
  catch (const SceneError& error)
  {
    EXPECT_TRUE(contains(error.what(), "thread 'honey' and obstacle 'table' cross by ")) << error.what();
  }
}

TEST(ThreadDefaults, AnObstacleThatRunsIntoTheNozzleIsRefusedAtOnce)
{
  const std::string text = std::string(plain) + R"(
    contact: {}
obstacles:
  - {name: table, shape: {box: {size: [0.1, 0.1, 0.02]}}, motion: {table: [[0, 0, 0, 0.02, 0, 0, 0, 1], [1, 0, 0, 0.07, 0, 0, 0, 1]]}}
)";
  Simulation simulation(parseScene(text, "t"));
  StepReport report;
  int steps = 0, iterations = 0;
  for (; report.ok && steps < 500; ++steps)
  {
    report = simulation.step(simulation.defaultInputs());
    iterations = report.ok ? iterations : report.iterations;
  }
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(iterations, 0);   // before, thousands of attempts
  EXPECT_TRUE(contains(report.message, "obstacle 'table' comes within")) << report.message;
  EXPECT_TRUE(contains(report.message, "of the nozzle of thread 'honey'")) << report.message;
}

TEST(ThreadDefaults, AThreadStartsWithoutAPlaneOfSymmetry)
{
  for (const char* direction : {"[0, 0, -1]", "[0.01, 0.02, -1]"})
  {
    const Simulation simulation(parseScene(plain, "t", {std::string("threads.0.nozzle.direction=") + direction}));
    const ThreadState& thread = simulation.state().threads[0].threads[0];
    const Eigen::Vector3d edge = thread.edge(0), v = thread.v[0], down(0, 0, -1),
                          axis = thread.ends[1].X_WE.orientation * Eigen::Vector3d::UnitX();
    EXPECT_GT(std::abs(edge.cross(v).dot(axis)), 1e-4 * edge.norm() * v.norm()) << direction;
  }
}

TEST(ThreadDefaults, ASwirlIsACircleThatEndsWhereTheNozzleStands)
{
  const SceneConfig scene = parseScene(plain, "t", {"threads.0.nozzle.swirl=0.3"});
  const auto* table = std::get_if<TableMotion>(&scene.threads[0].nozzle->motion);
  ASSERT_TRUE(table);
  const Eigen::Vector3d place(0, 0, 0.07);
  const double radius = 0.3 * estimateLanding({1400, 20, 9.81, 0.005, 3e-7, 0.07}).coil_radius;
  double most = 0.0;
  for (const Pose& pose : table->poses.poses())
    most = std::max(most, (pose.position - place).norm());
  EXPECT_NEAR(most, radius, 1e-9);
  EXPECT_LT((table->poses.poses().front().position - place).norm(), 1e-12);
  EXPECT_LT((table->poses.poses().back().position - place).norm(), 1e-12);
  EXPECT_TRUE(contains(problemsOf(plain, {"threads.0.nozzle.swirl=0.3", "threads.0.nozzle.motion={topic: true}"}),
                       "is for nozzles that stand"));
}

}   // namespace
}   // namespace slender::test
