#include <cstdio>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/scenes.h"

namespace slender {
namespace {

using test::problemsOf;

const char* const honey = R"(
name: honey
time: {step: 0.002, duration: 1}
threads:
  - name: honey
    fluid: {density: 1400, viscosity: 20, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.04], direction: [0.02, 0, -1], diameter: 0.005, flow: {table: [[0, 3.0e-7], [0.5, 9.0e-7]]}}
    floor: {height: 0, belt: {x: 0.01, y: {table: [[0, 0], [1, 0.02]]}}}
    edges: {feed: 0.001, longest: 0.002, shortest: 0.0005, deposited: 100}
    breakup_radius: 1.0e-5
    region: {from: [-1, -1, -1], to: [1, 1, 1]}
)";

TEST(ThreadReader, ReadsEverything)
{
  const SceneConfig scene = parseScene(honey, "t");
  ASSERT_EQ(scene.threads.size(), 1u);
  const ThreadConfig& t = scene.threads[0];
  EXPECT_EQ(t.viscosity, 20);
  EXPECT_EQ(t.surface_tension, 0.05);
  ASSERT_TRUE(t.nozzle && t.floor && t.region);
  EXPECT_LT((t.nozzle->pose.orientation * Eigen::Vector3d::UnitX() - Eigen::Vector3d(0.02, 0, -1).normalized()).norm(),
            1e-12);
  EXPECT_DOUBLE_EQ(t.nozzle->flow.table.at(-1), 3e-7);
  EXPECT_DOUBLE_EQ(t.nozzle->flow.table.at(0.25), 6e-7);
  EXPECT_DOUBLE_EQ(t.nozzle->flow.table.at(9), 9e-7);
  EXPECT_DOUBLE_EQ(t.floor->belt_x.table.at(3), 0.01);
  EXPECT_DOUBLE_EQ(t.floor->belt_y.table.at(0.5), 0.01);
  EXPECT_EQ(t.longest_edge, 0.002);
  EXPECT_EQ(t.most_deposited, 100);
  EXPECT_EQ(t.breakup_radius, 1e-5);
  EXPECT_EQ(parseScene(honey, "t", {"threads.0.breakup_radius=0"}).threads[0].breakup_radius, 0.0);
}

TEST(ThreadReader, NamesWhatIsWrong)
{
  const std::pair<const char*, const char*> cases[] = {
      {"threads.0.fluid.viscosity=-1",
       "threads.0.fluid.viscosity = -1: is out of range; must be a number in (0, 1e+12] Pa s"},
      {"threads.0.nozzle.diameter=0", "threads.0.nozzle.diameter = 0"},
      {"threads.0.nozzle.flow=-1e-7", "threads.0.nozzle.flow = -1e-7"},
      {"threads.0.nozzle.flow={topic: false}", "must be true"},
      {"threads.0.nozzle.flow={table: [[1, 0], [1, 2]]}", "times must rise"},
      {"threads.0.nozzle.flow=1",
       "is too much: over a thousand edges would leave the nozzle in one step; must be at most 0.0098"},
      {"threads.0.nozzle.flow={table: [[0, 0], [1, 1]]}", "is too much"},
      {"threads.0.nozzle.flow={topic: true, initial: 1}", "is too much"},
      {"threads.0.nozzle.spin=1", "unknown key"},
      {"threads.0.centerline={straight: {edges: 3}}", "must have either a nozzle"},
      {"threads.0.radius=0.1", "is for threads with a centerline"},
      {"threads.0.floor.belt=[1, 2, 3]", "must be [vx, vy]"},
      {"threads.0.floor.belt={x: {topic: true}, y: {table: [[0, 0], [1, 1]]}}", "sets both; write topic: true"},
      {"threads.0.edges.shortest=0.0019", "0.4 of edges.longest"},
      {"threads.0.region={from: [0, 0, 0], to: [1, 0, 1]}", "must be greater than region.from"},
      {"threads.0.breakup_radius=0.0025", "must be less than the nozzle's radius 0.0025 m"},
      {"time.integrator=symplectic_euler",
       "time.integrator = symplectic_euler: is not for threads; must be implicit_euler"},
      {"start=equilibrium", "is not for threads"},
  };
  for (const auto& [assignment, expected] : cases)
    EXPECT_NE(problemsOf(honey, {assignment}).find(expected), std::string::npos)
        << assignment << "\ngave: " << problemsOf(honey, {assignment});
}

TEST(ThreadScene, FeedsWhatTheTableSays)
{
  Simulation simulation(parseScene(honey, "t"));
  for (int k = 0; k < 400; ++k)
  {
    const StepReport report = simulation.step(simulation.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
  }
  const ThreadGroupState& state = simulation.state().threads[0];
  // trapezoid to 0.5 s, then constant; means over steps add up exactly
  EXPECT_NEAR(state.threads.front().fed_volume, 0.5 * 6e-7 + 0.3 * 9e-7, 1e-12 * 6e-7);
  EXPECT_NEAR(simulation.state().end_loads[0][1].force.z(), 0.0, 1.0);
  EXPECT_LT(simulation.state().end_loads[0][1].force.z(), 0.0);
}

TEST(ThreadScene, RestartsBitByBit)
{
  Simulation a(parseScene(honey, "t")), b(parseScene(honey, "t"));
  const auto run = [](Simulation& s, int steps) {
    for (int k = 0; k < steps; ++k)
      ASSERT_TRUE(s.step(s.defaultInputs()).ok);
  };
  run(a, 300);
  const std::string file = ::testing::TempDir() + "thread_state";
  a.save(file);
  b.load(file);
  run(a, 200);
  run(b, 200);
  const ThreadState &s = a.state().threads[0].threads[0], &r = b.state().threads[0].threads[0];
  EXPECT_TRUE(s.x == r.x && s.v == r.v && s.d1 == r.d1 && s.twist == r.twist && s.volume == r.volume && s.id == r.id &&
              s.deposited == r.deposited);
  EXPECT_EQ(a.state().end_loads[0][1].force, b.state().end_loads[0][1].force);
  Simulation other(parseScene(honey, "t", {"threads.0.fluid.viscosity=21"}));
  EXPECT_THROW(other.load(file), std::runtime_error);
  EXPECT_NE(a.state().end_loads[0][1].force.z(), 0.0);
  a.load(file);   // what was told of the last step comes back, too
  run(b, 1);
  b.load(file);
  EXPECT_EQ(a.state().end_loads[0][1].force, b.state().end_loads[0][1].force);
  b.reset();
  EXPECT_EQ(b.state().end_loads[0][1].force.norm(), 0.0);
  std::remove(file.c_str());
}

TEST(ThreadScene, ThreadsThatHaveLeftStayAway)
{
  Simulation simulation(parseScene(R"(
time: {step: 0.01}
threads:
  - {centerline: {straight: {to: [0.1, 0, 0], edges: 5}}, radius: 0.002, region: {from: [-1, -1, -0.05], to: [1, 1, 1]}}
)"));
  const auto run = [&simulation](int steps) {
    for (int k = 0; k < steps; ++k)
      ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  };
  run(30);
  EXPECT_TRUE(simulation.state().threads[0].threads.empty());
  const std::string file = ::testing::TempDir() + "no_thread";
  simulation.save(file);
  simulation.reset();
  EXPECT_EQ(simulation.state().threads[0].threads.size(), 1u);
  simulation.load(file);
  EXPECT_TRUE(simulation.state().threads[0].threads.empty());
  run(2);
  std::remove(file.c_str());
}

TEST(ThreadScene, AFilamentBetweenTwoHoldersSags)
{
  Simulation simulation(parseScene(R"(
time: {step: 0.01}
threads:
  - fluid: {density: 1000, viscosity: 100}
    centerline: {straight: {from: [0, 0, 0], to: [0.1, 0, 0], edges: 20}}
    radius: 0.002
    ends: {oldest: held, newest: held}
)"));
  const double before = simulation.state().threads[0].volumeBalance();
  const auto momentum = [&] {
    const ThreadState& t = simulation.state().threads[0].threads[0];
    double sum = 0.0;
    for (int i = 1; i + 1 < t.nodes(); ++i)
      sum += 500.0 * (t.volume[i - 1] + t.volume[i]) * t.v[i].z();
    return sum;
  };
  double last = 0.0;
  for (int k = 0; k < 50; ++k)
  {
    last = momentum();
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  }
  const ThreadState& thread = simulation.state().threads[0].threads[0];
  EXPECT_LT(thread.x[10].z(), -1e-3);
  EXPECT_EQ(thread.x[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_NEAR(simulation.state().threads[0].volumeBalance(), before, 1e-12 * before);
  // Newton's law: what the holders carry is the weight less what the fluid gains in momentum
  const double weight = 9.81 * 1000 * before, expected = -weight - (momentum() - last) / 0.01;
  EXPECT_NEAR(simulation.state().end_loads[0][0].force.z() + simulation.state().end_loads[0][1].force.z(), expected,
              1e-6 * weight);
}

const char* const touching = R"(
name: touching
time: {step: 0.002, duration: 1}
obstacles:
  - {name: tray, shape: {box: {size: [0.2, 0.2, 0.01]}}, pose: {position: [0, 0, -0.02]}, friction: 0.5}
threads:
  - name: nozzle
    fluid: {density: 1400, viscosity: 100, surface_tension: 0.05}
    nozzle: {position: [0, 0, 0.02], direction: [0.02, 0, -1], diameter: 0.008, flow: 4.0e-6}
    floor: {height: -0.01, friction: 0.2, belt: [0.01, 0]}
    edges: {feed: 0.003, longest: 0.004, shortest: 0.001}
    contact: {friction: 0.4, threads: true}
    merging: {until: 0.5}
  - name: bridge
    fluid: {viscosity: 1000}
    centerline: {straight: {from: [-0.05, 0.001, 0.005], to: [0.05, 0, 0.005], edges: 40}}
    radius: 0.002
    ends: {oldest: held, newest: held}
    contact: {self: false}
)";

std::string problemsOfTouching(const std::string& override_text)
{
  try
  {
    Simulation simulation(parseScene(touching, "t", {override_text}));
  }
  catch (const SceneError& error)
  {
    return error.what();
  }
  return "";
}

TEST(ThreadContactReader, ReadsWhatTouches)
{
  const SceneConfig scene = parseScene(touching, "t");
  const ThreadConfig &a = scene.threads[0], &b = scene.threads[1];
  ASSERT_TRUE(a.contact && b.contact && a.floor && a.floor->friction);
  EXPECT_TRUE(a.contact->self);
  EXPECT_EQ(a.contact->friction, 0.4);
  EXPECT_EQ(a.merging, 0.5);
  EXPECT_EQ(*a.floor->friction, 0.2);
  EXPECT_FALSE(b.contact->self);
  EXPECT_TRUE(b.contact->others);
  EXPECT_EQ(b.contact->friction, 0.3);
  EXPECT_EQ(b.merging, 0.0);
  EXPECT_DOUBLE_EQ(scene.contact.gap, 0.1 * 0.001);   // a quarter of the nozzle's radius is less than the bridge's
  EXPECT_EQ(parseScene(touching, "t", {"threads.0.merging=true"}).threads[0].merging, 0.6);
  EXPECT_EQ(parseScene(touching, "t", {"threads.0.merging=false"}).threads[0].merging, 0.0);
  EXPECT_FALSE(parseScene(honey, "t").threads[0].contact);
}

TEST(ThreadContactReader, NamesWhatIsWrong)
{
  const std::pair<const char*, const char*> cases[] = {
      {"threads.0.contact.friction=-0.1", "threads.0.contact.friction = -0.1"},
      {"threads.0.contact.rods=true", "unknown key"},
      {"threads.0.contact.self=3", "threads.0.contact.self"},
      {"threads.0.merging.until=1", "must be a number in [0.05, 0.95]"},
      {"threads.0.merging=0.5", "threads.0.merging"},
      {"threads.0.merging={from: 1}", "unknown key"},
      {"threads.0.floor.friction=-1", "threads.0.floor.friction = -1"},
      {"threads.0.floor.centreline_on_surface=true", "is for floors that the thread sticks to"},
      {"threads.0.contact.obstacles=false", "makes the floor an obstacle"},
      {"contact.gap=0", "contact.gap = 0"},
      {"threads.1.centerline.straight={from: [-0.05, 0, -0.0145], to: [0.05, 0, -0.0145], edges: 40}", " cross by "},
  };
  for (const auto& [assignment, expected] : cases)
    EXPECT_NE(problemsOfTouching(assignment).find(expected), std::string::npos)
        << assignment << "\ngave: " << problemsOfTouching(assignment);
  EXPECT_EQ(problemsOfTouching("name=touching"), "");
  // merging without anything that touches
  std::string text = touching;
  text.erase(text.find("    contact: {friction: 0.4"),
             std::string("    contact: {friction: 0.4, threads: true}\n").size());
  text.erase(text.find(", friction: 0.2"), std::string(", friction: 0.2").size());
  try
  {
    parseScene(text, "t");
    ADD_FAILURE() << "merging without contact was taken";
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("is for parts that touch"), std::string::npos) << error.what();
  }
}

TEST(ThreadContactScene, AThreadFallsOnAnotherAndOnATrayAndARestartIsExact)
{
  Simulation simulation(parseScene(touching, "t"));
  const auto advance = [](Simulation& s, int steps) {
    for (int k = 0; k < steps; ++k)
    {
      const StepReport report = s.step(s.defaultInputs());
      ASSERT_TRUE(report.ok) << k << " " << report.message;
    }
  };
  const double sag = simulation.state().threads[1].threads[0].x[20].z();
  advance(simulation, 250);
  EXPECT_GT(simulation.state().contact.threads[0].barrier.layers[0].stiffness, 0.0);
  EXPECT_FALSE(simulation.world().contacts().empty());
  const std::string file = ::testing::TempDir() + "touching.state";
  simulation.save(file);
  Simulation other(parseScene(touching, "t"));
  other.load(file);
  std::remove(file.c_str());
  advance(simulation, 100);
  advance(other, 100);
  for (int k = 0; k < 2; ++k)
  {
    const ThreadState &a = simulation.state().threads[k].threads[0], &b = other.state().threads[k].threads[0];
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.v, b.v);
    EXPECT_EQ(a.volume, b.volume);
  }
  EXPECT_LT(simulation.state().threads[1].threads[0].x[20].z(), sag - 1e-4);   // it carries the other one
  for (const Eigen::Vector3d& x : simulation.state().threads[0].threads[0].x)
    EXPECT_GT(x.z(), -0.01);
  simulation.reset();
  EXPECT_EQ(simulation.state().contact.threads[0].barrier.layers[0].stiffness, 0.0);
}

}   // namespace
}   // namespace slender
