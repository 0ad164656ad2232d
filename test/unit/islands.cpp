// Rods, threads and bodies that meet: nothing passes through anything, and what one loses the other gets.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/contact/distance.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/allocations.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

const char* const kCable = R"(
rods:
  - name: cable
    centerline: {straight: {from: [-0.02, 0, 0], to: [0.02, 0, 0], edges: 20}}
    cross_section: {radius: 0.001}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.3}
    contact: {friction: 0.3}
)";

const char* const kSyrup = R"(
time: {step: 0.001, duration: 1}
gravity: [0, 0, 0]
contact: {gap: 5.0e-5}
threads:
  - name: syrup
    fluid: {density: 1300, viscosity: 10, surface_tension: 0.03}
    radius: 0.001
    centerline: {straight: {from: [0.001, -0.02, 0.0028], to: [0.001, 0.02, 0.0028], edges: 20}}
    contact: {friction: 0.3}
)";

const char* const kFallingBall = R"(
bodies:
  - name: ball
    shape: {sphere: {radius: 0.004}}
    mass: 0.0002
    pose: {position: [0.001, 0.0005, 0.0084]}
    velocity: {linear: [0, 0, -0.3]}
    friction: 0.3
)";

const std::string kCrossing = std::string(kSyrup) + kCable + kFallingBall;

/// Smallest distance between the surfaces of the rod, the thread and the ball [m].
double roomBetweenAll(const Simulation& s)
{
  const RodState& rod = s.state().rods[0];
  const ThreadState& thread = s.state().threads[0].threads[0];
  const Vector3d ball = s.state().bodies[0].X_WB.position;
  double least = 1.0;
  for (int j = 0; j < thread.edges(); ++j)
  {
    least = std::min(least, pointSegmentDistance(ball, thread.x[j], thread.x[j + 1]) - 0.004 - thread.radius(j));
    for (Eigen::Index i = 0; i + 1 < rod.x.cols(); ++i)
      least = std::min(least, segmentDistance(rod.x.col(i), rod.x.col(i + 1), thread.x[j], thread.x[j + 1]) - 0.001 -
                                  thread.radius(j));
  }
  return least;
}

Vector3d momentumOfAll(const Simulation& s)
{
  const RodState& rod = s.state().rods[0];
  Vector3d sum = 0.0002 * s.state().bodies[0].velocity.linear;
  for (Eigen::Index i = 0; i < rod.x.cols(); ++i)
    sum += s.rodModel(0).mass[i] * rod.v.col(i);
  const ThreadState& thread = s.state().threads[0].threads[0];
  for (int j = 0; j < thread.edges(); ++j)
    sum += 0.5 * s.threadModel(0).density * thread.volume[j] * (thread.v[j] + thread.v[j + 1]);
  return sum;
}

/// A ball falls onto a thread, which falls onto a rod.
TEST(IslandScheduler, ContactBetweenKindsKeepsMomentumAndDistance)
{
  Simulation s(parseScene(kCrossing, "crossing"));
  const Vector3d before = momentumOfAll(s);
  std::size_t most = 0;
  for (int k = 0; k < 60; ++k)
  {
    const StepReport report = s.step(s.defaultInputs());
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    most = std::max(most, s.world().contacts().size());
    ASSERT_GT(roomBetweenAll(s), 0.0) << k;
  }
  EXPECT_GE(most, 2u);
  EXPECT_LT(s.state().rods[0].v.row(2).mean(), -0.01);   // the ball pushes the rod through the thread
  // Newton's tolerance leaves forces of 1e-6 of the largest one unbalanced
  EXPECT_LT((momentumOfAll(s) - before).norm(), 1e-5 * before.norm());
}

TEST(IslandScheduler, WhatIsFarApartMovesAsOnItsOwn)
{
  std::vector<std::string> apart = {"threads.0.centerline.straight={from: [1, -0.02, 0], to: [1, 0.02, 0], edges: 20}",
                                    "gravity=[0, 0, -9.81]"};
  Simulation alone(parseScene(kSyrup, "alone", apart));
  apart.emplace_back("bodies.0.pose.position=[0, 1, 0]");
  Simulation together(parseScene(kCrossing, "together", apart));
  for (int k = 0; k < 50; ++k)
  {
    ASSERT_TRUE(together.step(together.defaultInputs()).ok);
    ASSERT_TRUE(alone.step(alone.defaultInputs()).ok);
  }
  const ThreadState &a = together.state().threads[0].threads[0], &b = alone.state().threads[0].threads[0];
  for (int i = 0; i < a.nodes(); ++i)   // islands share nothing
    EXPECT_EQ(a.x[i], b.x[i]) << i;
  EXPECT_NEAR(together.state().bodies[0].X_WB.position.z(), -0.3 * 0.05 - 9.81 * 0.05 * 0.051 / 2, 1e-12);
}

/// A light rope lies across a floor. The box around it contains a heavy body, which is then in its island, and which
/// does not touch the rope.
TEST(IslandScheduler, BystandersDoNotStiffenTheBarrier)
{
  const std::string rope = R"(
time: {step: 0.005, duration: 1, integrator: implicit_euler}
contact: {gap: 0.001}
rods:
  - name: rope
    centerline: {straight: {from: [-0.1, -0.1, 0.0045], to: [0.1, 0.1, 0.0045], edges: 20}}
    cross_section: {radius: 0.004}
    material: {density: 100, youngs_modulus: 1.0e5, poissons_ratio: 0.4}
    contact: {friction: 0.3}
obstacles:
  - {name: floor, shape: {plane: {}}}
)";
  Simulation alone(parseScene(rope));
  Simulation beside(parseScene(rope + "bodies: [{name: weight, mass: 20, shape: {box: {size: [0.04, 0.04, 0.04]}}, "
                                      "pose: {position: [0.06, -0.06, 0.0203]}}]\n"));
  for (int k = 0; k < 60; ++k)
  {
    ASSERT_TRUE(alone.step(alone.defaultInputs()).ok);
    ASSERT_TRUE(beside.step(beside.defaultInputs()).ok);
  }
  EXPECT_GT(beside.state().contact.bodies[0].barrier.layers[0].stiffness,
            100.0 * beside.state().contact.rods[0].barrier.layers[0].stiffness);
  const double apart = (beside.state().rods[0].x - alone.state().rods[0].x).cwiseAbs().maxCoeff();
  EXPECT_LT(apart, 1e-6 * 0.001);   // of the gap; tolerances of Newton's method are of the island
}

/// A rod without contact and a body without a shape, welded together, keep their integrator beside a thread that
/// touches.
TEST(IslandScheduler, ThreadsLeaveTheIntegratorToWhatTheyCannotMeet)
{
  std::string rod = kCable;
  rod.erase(rod.find("    contact: {friction: 0.3}\n"));
  const std::string hanging = std::string(kSyrup) + rod +
                              "bodies: [{name: bob, mass: 0.001, inertia: [1.0e-8, 1.0e-8, 1.0e-8], "
                              "pose: {position: [0.02, 0, 0]}, welds: [{rod: cable, edge: -1}]}]\n";
  EXPECT_EQ(parseScene(hanging).time.integrator, Integrator::tr_bdf2);
  Simulation s(parseScene(hanging));
  EXPECT_TRUE(s.step(s.defaultInputs()).ok);
  const std::string ball =
      "bodies.0={name: bob, mass: 0.001, shape: {sphere: {radius: 0.004}}, pose: {position: "
      "[0.02, 0, 0]}, welds: [{rod: cable, edge: -1}]}";
  EXPECT_EQ(parseScene(hanging, "ball", {ball}).time.integrator, Integrator::implicit_euler);
  EXPECT_ANY_THROW(Simulation(parseScene(hanging, "ball", {ball, "time.integrator=bdf2"})));
}

/// The ball stands still 2 mm above the rod. Its force moves it by 11 mm in one step, which its velocity does not tell.
TEST(IslandScheduler, IslandsThatMeetUnexpectedlyMakeTheirStepAgain)
{
  Simulation s(parseScene(std::string(kCable) + kFallingBall, "falling",
                          {"bodies.0.pose.position=[0.001, 0, 0.007]", "bodies.0.velocity.linear=[0, 0, 0]",
                           "bodies.0.force=[0, 0, -0.002]", "gravity=[0, 0, 0]", "time={step: 0.0333, duration: 1}",
                           "contact={gap: 5.0e-5}"}));
  for (int k = 0; k < 10; ++k)
  {
    const StepReport report = s.step(s.defaultInputs());
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    const RodState& rod = s.state().rods[0];
    double least = 1.0;
    for (Eigen::Index i = 0; i + 1 < rod.x.cols(); ++i)
      least = std::min(least,
                       pointSegmentDistance(s.state().bodies[0].X_WB.position, rod.x.col(i), rod.x.col(i + 1)) - 0.005);
    ASSERT_GT(least, 0.0) << k;
    if (k < 3)   // then it slips off, and both are islands of their own again
      EXPECT_GT(s.state().bodies[0].X_WB.position.z(), rod.x(2, 10)) << k;
  }
}

/// Eight rods of 100 edges, each above a ball of its own which it falls onto. `list`: bodies or obstacles.
std::string rodsAboveBalls(const std::string& list = "bodies")
{
  const std::string mass = list == "bodies" ? "mass: 0.01, gravity: false, " : "";
  std::string rods = "time: {step: 0.002, duration: 1}\ncontact: {gap: 5.0e-5}\nrods:\n", bodies = list + ":\n";
  for (int k = 0; k < 8; ++k)
  {
    const std::string y = std::to_string(0.1 * k), number = std::to_string(k);
    rods +=
        "  - {name: rod" + number + ", centerline: {straight: {from: [-0.05, " + y + ", 0.0065], to: [0.05, " + y +
        ", 0.0065], edges: 100}}, cross_section: {radius: 0.001}, material: {density: 1100, youngs_modulus: 1.0e6, " +
        "poissons_ratio: 0.3}, contact: {friction: 0.3}}\n";
    bodies += "  - {name: ball" + number + ", shape: {sphere: {radius: 0.005}}, " + mass + "pose: {position: [0, " + y +
              ", 0]}}\n";
  }
  return rods + bodies;
}

TEST(IslandScheduler, IslandsDoNotDependOnTheNumberOfThreads)
{
  Simulation one(parseScene(rodsAboveBalls(), "one")), many(parseScene(rodsAboveBalls(), "many"));
  one.setThreads(1);
  many.setThreads(3);
  for (int k = 0; k < 25; ++k)
  {
    ASSERT_TRUE(one.step(one.defaultInputs()).ok);
    ASSERT_TRUE(many.step(many.defaultInputs()).ok);
  }
  EXPECT_GE(one.world().contacts().size(), 8u);
  for (std::size_t r = 0; r < 8; ++r)
  {
    EXPECT_EQ(one.state().rods[r].x, many.state().rods[r].x) << r;
    EXPECT_TRUE(one.state().contact.rods[r].barrier == many.state().contact.rods[r].barrier) << r;
    // all islands are alike but for their place
    Eigen::Matrix3Xd from_first = one.state().rods[r].x - one.state().rods[0].x;
    from_first.row(1).array() -= 0.1 * static_cast<double>(r);
    EXPECT_LT(from_first.cwiseAbs().maxCoeff(), 1e-7) << r;   // rounding, which contact amplifies
    EXPECT_GT(one.world().contactForces({ObjectRef::rod, static_cast<int>(r)}).row(2).sum(), 0.0) << r;
  }
}

/// Rods along y land on rods along x, which lie on the floor. All are one island, which is large enough for several
/// threads.
std::string twoLayersOfRods()
{
  std::string scene =
      "name: layers\ntime: {step: 0.002, duration: 1, integrator: implicit_euler}\n"
      "obstacles: [{name: floor, shape: {plane: {}}}]\nrods:\n";
  for (int k = 0; k < 40; ++k)
  {
    const std::string at = std::to_string(0.01 * (k / 2) + 0.005);
    const auto point = [&](const char* along) {
      return k % 2 == 0 ? std::string("[") + along + ", " + at + ", 0.0011]" : "[" + at + ", " + along + ", 0.0034]";
    };
    scene += "  - {name: rod" + std::to_string(k) + ", centerline: {straight: {from: " + point("0") +
             ", to: " + point("0.2") + ", edges: 100}}, cross_section: {radius: 0.001}, material: {density: 1100, " +
             "youngs_modulus: 1.0e6, poissons_ratio: 0.3}, contact: {friction: 0.3}}\n";
  }
  return scene;
}

TEST(IslandScheduler, ALargeIslandDoesNotDependOnTheNumberOfThreads)
{
  Simulation one(parseScene(twoLayersOfRods(), "one")), many(parseScene(twoLayersOfRods(), "many"));
  one.setThreads(1);
  many.setThreads(3);
  for (int k = 0; k < 12; ++k)   // The upper layer lands after about eight steps.
  {
    ASSERT_TRUE(one.step(one.defaultInputs()).ok);
    ASSERT_TRUE(many.step(many.defaultInputs()).ok);
  }
  EXPECT_GE(one.world().contacts().size(), 100u);
  for (std::size_t r = 0; r < 40; ++r)
    EXPECT_EQ(one.state().rods[r].x, many.state().rods[r].x) << r;
}

#ifdef SLENDER_COUNTS_ALLOCATIONS
TEST(IslandScheduler, WarmIslandsTakeNoMemory)
{
  Simulation s(parseScene(rodsAboveBalls("obstacles"), "warm"));
  s.setThreads(1);
  for (int k = 0; k < 60; ++k)
    ASSERT_TRUE(s.step(s.defaultInputs()).ok);
  EXPECT_GE(s.world().contacts().size(), 8u);
  const SceneInputs inputs = s.defaultInputs();
  long least = 1000;   // lists of near pairs still grow in some steps, while the rods bend around the balls
  for (int k = 0; k < 20; ++k)
  {
    const long before = allocations;
    ASSERT_TRUE(s.step(inputs).ok);
    least = std::min<long>(least, allocations - before);
  }
  EXPECT_EQ(least, 0);
}
#endif

TEST(IslandScheduler, SavedIslandsGoOnBitByBit)
{
  Simulation run(parseScene(rodsAboveBalls(), "run")), other(parseScene(rodsAboveBalls(), "other"));
  const std::string file = testing::TempDir() + "islands.state";
  for (int k = 0; k < 40; ++k)
  {
    if (k == 20)
    {
      run.save(file);
      other.load(file);
    }
    ASSERT_TRUE(run.step(run.defaultInputs()).ok);
    if (k >= 20)
      ASSERT_TRUE(other.step(other.defaultInputs()).ok);
  }
  for (std::size_t r = 0; r < 8; ++r)
    EXPECT_EQ(run.state().rods[r].x, other.state().rods[r].x) << r;
}

TEST(IslandScheduler, RefusesIntegratorsThatThreadsDoNotHave)
{
  EXPECT_THROW(Simulation(parseScene(kCrossing, "bdf2", {"time.integrator=bdf2"})), SceneError);
}

TEST(IslandScheduler, NamesWhatCrossesAtTheStart)
{
  try
  {
    Simulation(parseScene(kCrossing, "t", {"bodies.0.pose.position=[0.001, 0, 0.0065]"}));
    FAIL() << "was accepted";
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("thread 'syrup' and body 'ball' cross by "), std::string::npos)
        << error.what();
  }
}

/// Cloth that impulses keep apart does not meet rods, and a scene with both is warned of.
TEST(IslandScheduler, WarnsOfClothsThatPassThroughOthers)
{
  const std::string cloth =
      "cloths=[{name: sheet, grid: {corner: [0, 0, -1], sides: [[0.1, 0, 0], [0, 0.1, 0]], "
      "cells: 2}, contact: {obstacles: false, method: impulses}}]";
  const SceneConfig scene = parseScene(kCrossing, "t", {cloth});
  EXPECT_TRUE(std::any_of(scene.warnings.begin(), scene.warnings.end(), [](const std::string& text) {
    return text.find("pass through the rods, threads, simulated bodies") != std::string::npos;
  }));
}

}   // namespace
}   // namespace slender::test
