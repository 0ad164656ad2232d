// Simulated bodies that touch obstacles and each other, against formulas.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.81, kFriction = 0.3;

const std::string kFloor = R"(
obstacles:
  - {name: floor, shape: {plane: {point: [0, 0, 0], normal: [0, 0, 1]}}, friction: 0.3}
)";

/// A body on the floor, with the gravity of an incline of this slope downhill along x.
std::string onIncline(double slope, const std::string& shape, double height)
{
  const double angle = std::atan(slope);
  std::ostringstream text;
  text.precision(17);
  text << "time: {step: 0.005, duration: 2, integrator: implicit_euler}\ngravity: [" << kGravity * std::sin(angle)
       << ", 0, " << -kGravity * std::cos(angle)
       << "]\ncontact: {gap: 0.0004}\nbodies:\n  - {name: body, mass: 2, shape: {" << shape
       << "}, pose: {position: [0, 0, " << height << "]}, friction: 0.3}\n"
       << kFloor;
  return text.str();
}

void runFor(Simulation& s, double seconds)
{
  const int steps = static_cast<int>(std::round(seconds / 0.005));
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = s.step(s.defaultInputs());
    ASSERT_TRUE(report.ok) << "step " << k << ": " << report.message;
  }
}

/// Mean acceleration downhill over a second, after half a second in which the body settles [m/s^2].
double acceleration(Simulation& s)
{
  runFor(s, 0.5);
  const double before = s.state().bodies[0].velocity.linear.x();
  runFor(s, 1.0);
  return s.state().bodies[0].velocity.linear.x() - before;
}

const std::string kBox = "box: {size: [0.2, 0.2, 0.1]}", kBall = "sphere: {radius: 0.1}";

TEST(BodyContact, ABoxSlipsWhereTheSlopeExceedsTheFriction)
{
  Simulation sticks(parseScene(onIncline(0.99 * kFriction, kBox, 0.0503)));
  runFor(sticks, 1.5);
  const double settled = sticks.state().bodies[0].X_WB.position.x();
  runFor(sticks, 5.0);
  // What friction holds does not creep; a viscous friction of contact.slip_speed, 1e-4 m/s, would leave 5e-4 m.
  EXPECT_NEAR(sticks.state().bodies[0].X_WB.position.x(), settled, 1e-10);
  for (const double slope : {1.01 * kFriction, 2.0 * kFriction})
  {
    Simulation slips(parseScene(onIncline(slope, kBox, 0.0503)));
    const double angle = std::atan(slope), expected = kGravity * (std::sin(angle) - kFriction * std::cos(angle));
    // 1 % of the weight's share along the slope
    EXPECT_NEAR(acceleration(slips), expected, 0.01 * kGravity * std::sin(angle)) << slope;
  }
}

/// The springs of friction go with the objects when these are stepped together with others for a while, and they are
/// part of a saved state.
TEST(BodyContact, WhatSticksStaysWhenIslandsChangeAndInSavedStates)
{
  // The ball falls past an upright edge of the box: their bounding boxes overlap, but they do not touch.
  const std::string text = onIncline(0.95 * kFriction, kBox, 0.0503), floor = "obstacles:";
  const std::string ball =
      "  - {name: ball, mass: 1, shape: {sphere: {radius: 0.1}}, pose: {position: [0.18, 0.18, 0.8]}, friction: 0.3}\n";
  Simulation s(parseScene(std::string(text).insert(text.find(floor), ball)));
  runFor(s, 0.25);
  const double settled = s.state().bodies[0].X_WB.position.x();
  const std::string path = testing::TempDir() + "what_sticks.state";
  s.save(path);
  Simulation again(s.config());
  runFor(again, 0.1);
  EXPECT_FALSE(again.world().contacts().empty());
  again.load(path);
  EXPECT_TRUE(again.world().contacts().empty());   // of the last step, which there is none
  runFor(s, 1.0);
  runFor(again, 1.0);
  EXPECT_GT(s.state().bodies[1].X_WB.position.x(), 0.3);               // The ball has passed.
  EXPECT_NEAR(s.state().bodies[0].X_WB.position.x(), settled, 1e-9);   // Unstretched springs would give way by 1e-7 m.
  EXPECT_EQ(s.state().bodies[0].X_WB.position, again.state().bodies[0].X_WB.position);
  EXPECT_EQ(s.state().bodies[1].X_WB.position, again.state().bodies[1].X_WB.position);
}

/// A box on a turntable, at 90 % of what friction holds, stays where it is on the table.
TEST(BodyContact, ABoxStaysOnATurntable)
{
  constexpr double kDistance = 0.5;
  const double turn = std::sqrt(0.9 * kFriction * kGravity / kDistance);   // [rad/s]
  std::ostringstream text;
  text.precision(17);
  text << "time: {step: 0.005, duration: 10, integrator: implicit_euler}\ncontact: {gap: 0.0004}\nbodies:\n"
       << "  - {name: box, mass: 1, shape: {" << kBox << "}, pose: {position: [" << kDistance
       << ", 0, 0.0503]}, velocity: {linear: [0, " << turn * kDistance << ", 0], angular: [0, 0, " << turn
       << "]}, friction: 0.3}\nobstacles:\n  - name: table\n    shape: {cylinder: {radius: 1, length: 0.2}}\n"
       << "    friction: 0.3\n    pose: {position: [0, 0, -0.1]}\n    motion: {topic: true}\n";
  Simulation s(parseScene(text.str()));
  double settled = 0.0;
  for (int k = 1; k <= 2000; ++k)
  {
    SceneInputs inputs = s.defaultInputs();
    const Eigen::Quaterniond table(Eigen::AngleAxisd(turn * 0.005 * k, Vector3d::UnitZ()));
    inputs.obstacles[0].X_WG.orientation = table;
    const StepReport report = s.step(inputs);
    ASSERT_TRUE(report.ok) << k << ": " << report.message;
    const Vector3d place = table.conjugate() * s.state().bodies[0].X_WB.position;
    if (k == 400)
      settled = std::atan2(place.y(), place.x());
    // Springs that did not turn with the table would let the box creep by slip_speed * step * turn = 1e-6 m/s.
    if (k > 400)
    {
      ASSERT_NEAR(std::atan2(place.y(), place.x()), settled, 1e-8) << k;
    }
  }
}

/// A cube of 0.1 m in a shaft of four walls with this clearance on each side [m], falling from a height.
std::string inShaft(double clearance, double height, const std::string& velocity)
{
  std::ostringstream text;
  text.precision(17);
  text << "time: {step: 0.005, duration: 1, integrator: implicit_euler}\ncontact: {gap: 0.0005}\nbodies:\n  - {name: "
          "cube, "
          "mass: 1, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [0, 0, "
       << height << "]}, velocity: {" << velocity << "}, friction: 0.5}\nobstacles:\n";
  const double at = 0.15 + clearance;
  for (int k = 0; k < 4; ++k)
    text << "  - {name: wall" << k << ", shape: {box: {size: [" << (k < 2 ? "0.2, 1, 4" : "1, 0.2, 4")
         << "]}}, pose: {position: ["
         << (k == 0   ? -at
             : k == 1 ? at
                      : 0.0)
         << ", "
         << (k == 2   ? -at
             : k == 3 ? at
                      : 0.0)
         << ", 0]}, friction: 0.5}\n";
  return text.str();
}

double energyOf(const RigidBodyState& cube)
{
  constexpr double kMoment = 0.1 * 0.1 / 6;   // [kg m^2]
  return 0.5 * cube.velocity.linear.squaredNorm() + 0.5 * kMoment * cube.velocity.angular.squaredNorm() +
         kGravity * cube.X_WB.position.z();
}

/// Clearances far below the gap press nothing: the cube falls freely, in spite of the friction.
TEST(BodyContact, ABodyFallsThroughANarrowShaft)
{
  for (const double share : {1.0, 0.3, 0.1, 0.01, 1e-4})
  {
    Simulation straight(parseScene(inShaft(share * 0.0005, 0.5, "linear: [0, 0, -100]")));
    for (int k = 0; k < 4; ++k)
      ASSERT_TRUE(straight.step(straight.defaultInputs()).ok) << share;
    EXPECT_NEAR(straight.state().bodies[0].velocity.linear.z(), -100 - kGravity * 0.02, 1e-9) << share;

    Simulation wobbles(parseScene(inShaft(share * 0.0005, 0.5, "linear: [0.1, 0.05, 0], angular: [0.5, 1, 0.3]")));
    double energy = energyOf(wobbles.state().bodies[0]);
    for (int k = 0; k < 40; ++k)
    {
      const StepReport report = wobbles.step(wobbles.defaultInputs());
      ASSERT_TRUE(report.ok) << share << ": " << report.message;
      const double now = energyOf(wobbles.state().bodies[0]);
      EXPECT_LE(now, energy + 1e-9) << share << ", step " << k;
      energy = now;
    }
    EXPECT_LT(wobbles.state().bodies[0].velocity.linear.z(), -0.9 * kGravity * 0.2) << share;
  }
}

/// An equilibrium leaves a body where it started: nearer to the floor than the gap.
TEST(BodyContact, AnEquilibriumKeepsWhatStartsNearTogether)
{
  const std::string text = "start: equilibrium\ncontact: {gap: 0.0005}\nbodies:\n  - {name: body, mass: 1, shape: {" +
                           kBox + "}, pose: {position: [0, 0, 0.0500001]}}\n" + kFloor;
  Simulation s(parseScene(text));
  EXPECT_NEAR(s.state().bodies[0].X_WB.position.z(), 0.05, 1.1e-7);   // the gap: 5e-4
  runFor(s, 0.1);
  EXPECT_NEAR(s.state().bodies[0].X_WB.position.z(), 0.05, 1.1e-7);
}

/// A shaft that is narrower than the gap, and is entered at 6 m/s, gives no energy.
TEST(BodyContact, ABodyThatEntersANarrowShaftGainsNoEnergy)
{
  for (const double share : {1.0, 0.3, 0.1, 0.03})
  {
    Simulation s(parseScene(inShaft(share * 0.0005, 4.0, "linear: [0, 0, 0]")));
    const double start = energyOf(s.state().bodies[0]);
    for (int k = 0; k < 140; ++k)
    {
      const StepReport report = s.step(s.defaultInputs());
      ASSERT_TRUE(report.ok) << share << ", step " << k << ": " << report.message;
      // The barrier may give back what it holds: less than a thousandth of what the fall has released.
      EXPECT_LT(energyOf(s.state().bodies[0]), start + 0.02) << share << ", step " << k;
    }
  }
}

TEST(BodyContact, ABallRollsAndSlipsBeyondSevenHalvesOfTheFriction)
{
  Simulation rolls(parseScene(onIncline(0.2, kBall, 0.1003)));
  const double rolling = 5.0 / 7.0 * kGravity * std::sin(std::atan(0.2));
  EXPECT_NEAR(acceleration(rolls), rolling, 0.005 * rolling);
  const RigidBodyState& ball = rolls.state().bodies[0];
  EXPECT_NEAR(ball.velocity.angular.y() * 0.1, ball.velocity.linear.x(), 0.005 * ball.velocity.linear.x());
  const double slope = 1.2 * 3.5 * kFriction, angle = std::atan(slope);
  Simulation slips(parseScene(onIncline(slope, kBall, 0.1003)));
  const double expected = kGravity * (std::sin(angle) - kFriction * std::cos(angle));
  EXPECT_NEAR(acceleration(slips), expected, 0.005 * expected);
}

/// What rolls keeps its speed, and what spins gets the speed of rolling, also when a step turns it by several radians.
TEST(BodyContact, FastRollingNeedsNoShortSteps)
{
  for (const double turn : {0.1, 1.0, 2.0, 5.0})   // per step [rad]
  {
    const double radius = 0.01, rate = turn / 0.005;
    const auto scene = [&](double speed) {
      std::ostringstream text;
      text << "time: {step: 0.005, duration: 2, integrator: implicit_euler}\nbodies:\n  - {name: ball, density: 1000, "
              "shape: {sphere: {radius: 0.01}}, pose: {position: [0, 0, 0.01001]}, friction: 0.3, velocity: {linear: ["
           << speed << ", 0, 0], angular: [0, " << rate << ", 0]}}\n"
           << kFloor;
      return text.str();
    };
    Simulation rolls(parseScene(scene(rate * radius))), spins(parseScene(scene(0.0)));
    runFor(rolls, 0.5);
    runFor(spins, 2.0);
    EXPECT_NEAR(rolls.state().bodies[0].velocity.linear.x(), rate * radius, 1e-6 * rate * radius) << turn;
    // Lands within a step: friction acts a little earlier or later.
    EXPECT_NEAR(spins.state().bodies[0].velocity.linear.x(), 2.0 / 7.0 * rate * radius, 1e-3 * rate * radius) << turn;
  }
}

/// Plates that close on a body press on it along their normals, and its friction keeps nothing that turns it.
TEST(BodyContact, SqueezedBodiesFeelNoForceAcross)
{
  for (const char* shape : {"box: {size: [0.03, 0.03, 0.03]}", "cylinder: {radius: 0.015, length: 0.03}"})
  {
    std::ostringstream text;
    text << "time: {step: 0.01, duration: 1}\ngravity: [0, 0, 0]\ncontact: {gap: 0.001}\nbodies:\n  - {name: body, "
            "mass: "
            "0.1, friction: 0.5, shape: {"
         << shape << "}}\nobstacles:\n";
    for (const int side : {-1, 1})
      text << "  - {name: plate" << side + 1
           << ", shape: {box: {size: [0.1, 0.1, 0.02]}}, friction: 0.5, motion: {table: "
           << "[[0, 0, 0, " << side * 0.0271 << ", 1, 0, 0, 0], [0.2, 0, 0, " << side * 0.0251 << ", 1, 0, 0, 0]]}}\n";
    Simulation s(parseScene(text.str()));
    for (int k = 0; k < 100; ++k)
    {
      const StepReport report = s.step(s.defaultInputs());
      ASSERT_TRUE(report.ok) << report.message;
      const Vector3d force = s.world().contactLoads().obstacles[0].force;
      if (k == 40)
        EXPECT_LT(force.z(), -10.0) << shape;
      EXPECT_LE(force.head<2>().norm(), 1e-6 * std::abs(force.z()) + 1e-9) << shape << " " << k;
    }
  }
}

/// Friction holds in statics below the cone, with the force of equilibrium, and nowhere above it.
TEST(BodyContact, EquilibriaOnASlopeHoldBelowTheCone)
{
  const auto scene = [](double slope) {
    std::ostringstream text;
    text << "start: equilibrium\ntime: {step: 0.005}\ngravity: [" << slope
         << ", 0, -10]\nbodies:\n  - {name: box, mass: 1, "
         << "friction: 0.3, shape: {box: {size: [0.2, 0.2, 0.1]}}, pose: {position: [0, 0, 0.0502]}}\n"
         << "obstacles: [{name: floor, shape: {plane: {}}, friction: 0.3}]\n";
    return parseScene(text.str());
  };
  for (const double slope : {0.5, 2.9})
  {
    Simulation s(scene(slope));
    const Vector3d at = s.state().bodies[0].X_WB.position, force = s.world().contactLoads().obstacles[0].force;
    EXPECT_LT((at - Vector3d(0, 0, 0.0502)).norm(), 2e-4) << slope;   // it starts 0.2 mm above the floor
    // Friction keeps normal forces that have changed by less than 1 % since. Near the cone, some corners then slip.
    EXPECT_LT((force - Vector3d(slope, 0, -10)).norm(), slope < 1.0 ? 1e-6 : 0.01 * slope) << slope;
    runFor(s, 0.1);
    EXPECT_LT((s.state().bodies[0].X_WB.position - at).norm(), 1e-6) << slope;
  }
  EXPECT_THROW(Simulation(scene(3.1)), SimulationError);
}

/// The plane of a small face cuts a wide plate that is hardly tilted. Steps were refused because of it.
TEST(BodyContact, ABoxStandsAnywhereOnAWidePlate)
{
  for (const char* place : {"-0.2, 0.03", "-0.1, 0", "0.07, -0.05"})
  {
    Simulation s(parseScene(
        "time: {step: 0.005, duration: 1, integrator: implicit_euler}\nbodies:\n  - {name: plate, mass: 2, shape: "
        "{box: {size: [0.5, 0.3, 0.05]}}, pose: {position: [0, 0, 0.0251]}, friction: 0.3}\n  - {name: box, mass: 1, "
        "shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [" +
        std::string(place) + ", 0.1003]}, friction: 0.3}\n" + kFloor));
    runFor(s, 0.5);
    EXPECT_NEAR(s.state().bodies[1].X_WB.position.z(), 0.1, 1e-3) << place;
    EXPECT_LT(s.state().bodies[1].velocity.linear.norm(), 1e-6) << place;
  }
}

TEST(BodyContact, AStackOfTenBoxesStands)
{
  constexpr double kSide = 0.1, kGap = 0.0004;
  std::ostringstream text;
  text << "time: {step: 0.005, duration: 10, integrator: implicit_euler}\ncontact: {gap: " << kGap << "}\nbodies:\n";
  for (int k = 0; k < 10; ++k)
    text << "  - {name: box" << k << ", mass: 1, shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [0, 0, "
         << 0.5 * kSide + 0.5 * kGap + (kSide + 0.5 * kGap) * k << "]}, friction: 0.3}\n";
  Simulation s(parseScene(text.str() + kFloor));
  runFor(s, 0.5);   // until the gaps carry the weight
  const WorldState settled = s.state();
  runFor(s, 9.5);
  for (std::size_t k = 0; k < 10; ++k)
  {
    const Vector3d moved = s.state().bodies[k].X_WB.position - settled.bodies[k].X_WB.position;
    EXPECT_LT(moved.norm(), 1e-4) << k;
    // Each box stands on the one below, at less than the gap.
    const double height = s.state().bodies[k].X_WB.position.z(),
                 below = k ? s.state().bodies[k - 1].X_WB.position.z() + 0.5 * kSide : 0.0;
    EXPECT_GT(height - 0.5 * kSide, below) << k;
    EXPECT_LT(height - 0.5 * kSide, below + kGap) << k;
  }
}

TEST(BodyContact, TwoBallsExchangeMomentum)
{
  Simulation s(parseScene(R"(
time: {step: 0.005, duration: 1, integrator: implicit_euler}
gravity: [0, 0, 0]
contact: {gap: 0.0004}
bodies:
  - {name: fast, mass: 1, shape: {sphere: {radius: 0.1}}, pose: {position: [-0.3, 0.02, 0]}, velocity: {linear: [4, 0, 0]}}
  - {name: slow, mass: 3, shape: {sphere: {radius: 0.1}}, pose: {position: [0.1, 0, 0]}}
)"));
  const auto momentum = [&] {
    return Vector3d(s.state().bodies[0].velocity.linear + 3.0 * s.state().bodies[1].velocity.linear);
  };
  const Vector3d before = momentum();
  runFor(s, 0.5);
  EXPECT_GT(s.state().bodies[1].velocity.linear.x(), 0.5);   // it was hit
  EXPECT_LT((momentum() - before).norm(), 1e-12 * before.norm());
}

std::vector<Vector3d> corners(const Shape& shape)
{
  const TriangleMesh& mesh = *std::get<std::shared_ptr<const TriangleMesh>>(shape);
  return {mesh.vertices.colwise().begin(), mesh.vertices.colwise().end()};
}

/// Total energy of a body of unit mass [J].
double energyOf(const RigidBodyState& body, const Vector3d& inertia)
{
  const Vector3d w = body.X_WB.orientation.conjugate() * body.velocity.angular;
  return kGravity * body.X_WB.position.z() + 0.5 * body.velocity.linear.squaredNorm() +
         0.5 * w.dot(inertia.cwiseProduct(w));
}

/// A box that comes down on something much smaller than its face rests on it, or rolls off it. It never gains energy.
TEST(BodyContact, ABoxTouchesWhatIsSmallerThanItsFaces)
{
  for (const std::string obstacle : {"shape: {sphere: {radius: 0.03}}", "shape: {box: {size: [0.03, 0.02, 0.06]}}",
                                     "shape: {capsule: {radius: 0.03, length: 0.05}}, pose: {rpy: [1.5707963, 0, 0]}",
                                     "shape: {cylinder: {radius: 0.03, length: 0.06}}"})
  {
    Simulation s(parseScene(R"(
time: {step: 0.005, duration: 2}
contact: {gap: 0.0004}
bodies:
  - {name: box, mass: 1, shape: {box: {size: [0.2, 0.2, 0.2]}}, pose: {position: [0.008, 0.005, 0.1305]}}
obstacles:
  - {name: small, )" + obstacle +
                            "}\n"));
    const RigidBodyState& box = s.state().bodies[0];
    const Vector3d inertia = Vector3d::Constant(0.04 / 6.0);
    const double start = energyOf(box, inertia);
    for (int k = 0; k < 60; ++k)
    {
      ASSERT_TRUE(s.step(s.defaultInputs()).ok) << obstacle;
      EXPECT_LT(energyOf(box, inertia), start) << obstacle << k;
      // The lowest point of the box above the middle of the obstacle, on the axis of the obstacle.
      const Vector3d down = box.X_WB.orientation.conjugate() * (-box.X_WB.position);
      EXPECT_LT(down.z(), -0.1) << obstacle << k;
    }
  }
}

TEST(BodyContact, CylindersStandAndRoll)
{
  Simulation s(parseScene(R"(
time: {step: 0.005, duration: 2}
contact: {gap: 0.0004}
bodies:
  - {name: disc, mass: 1, shape: {cylinder: {radius: 0.2, length: 0.04}}, pose: {position: [0, 0, 0.0203]}}
  - {name: lid, mass: 1, shape: {cylinder: {radius: 0.1, length: 0.04}}, pose: {position: [0.02, 0, 0.0607]}}
  - {name: roller, mass: 1, shape: {cylinder: {radius: 0.1, length: 0.04}}, velocity: {linear: [0, 1, 0], angular: [-10, 0, 0]},
     pose: {position: [1, 0, 0.1003], rpy: [0, 1.57079633, 0]}}
  - {name: ball, mass: 1, shape: {sphere: {radius: 0.05}}, pose: {position: [0.02, 0, 0.1311]}}
)" + kFloor));
  runFor(s, 1.0);
  const auto height = [&](int body) { return s.state().bodies[body].X_WB.position.z(); };
  // Each stands on the one below, at less than the gap.
  const double tops[] = {0.0, height(0) + 0.02, height(1) + 0.02};
  EXPECT_NEAR(height(0), tops[0] + 0.0202, 2e-4);
  EXPECT_NEAR(height(1), tops[1] + 0.0202, 2e-4);
  EXPECT_NEAR(height(3), tops[2] + 0.0502, 2e-4);
  // 64 sides: the wheel loses some of its speed at each edge.
  EXPECT_GT(s.state().bodies[2].X_WB.position.y(), 0.8);
  EXPECT_NEAR(height(2), 0.1, 4e-4);
}

/// Meshes fall onto a floor, onto an obstacle and onto each other, and come to rest outside all of them.
TEST(BodyContact, MeshesComeToRestOnSolids)
{
  const std::string mesh = "shape: {mesh: {file: " SLENDER_SOURCE_DIR "/config/meshes/wedge.obj}}";
  Simulation s(parseScene(R"(
time: {step: 0.004, duration: 4}
contact: {gap: 0.0004}
bodies:
  - {name: lower, mass: 1, inertia: [2.0e-3, 2.0e-3, 2.0e-3], pose: {position: [0, 0, 0.3], rpy: [0.3, 0.2, 0.1]}, )" +
                          mesh + R"(}
  - {name: upper, mass: 1, inertia: [2.0e-3, 2.0e-3, 2.0e-3], pose: {position: [0.02, 0.01, 0.7], rpy: [-0.5, 0.1, 1]}, )" +
                          mesh + "}\n" + kFloor));
  runFor(s, 4.0);
  for (const RigidBodyState& body : s.state().bodies)
  {
    EXPECT_LT(body.velocity.linear.norm(), 1e-4);
    for (const Vector3d& corner : corners(*s.config().bodies[0].shape))
      EXPECT_GT((body.X_WB * corner).z(), 0.0);
  }
}

/// The floor turns slowly under a cube, until the cube tips about its lower edge.
TEST(BodyContact, ACubeTipsAtFortyFiveDegrees)
{
  constexpr double kFirst = 43.0, kRate = 0.2, kDegree = M_PI / 180;   // degrees, per second
  const auto tilted = [](double degrees) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * kDegree, Vector3d::UnitY()));
  };
  std::ostringstream text;
  text.precision(17);
  const Vector3d middle = tilted(kFirst) * Vector3d(0, 0, 0.05005);
  text << "time: {step: 0.005, duration: 40}\ncontact: {gap: 0.0001}\nbodies:\n  - {name: cube, mass: 1, friction: 3, "
       << "shape: {box: {size: [0.1, 0.1, 0.1]}}, pose: {position: [" << middle.x() << ", 0, " << middle.z()
       << "], rpy: [0, " << kFirst * kDegree
       << ", 0]}}\nobstacles:\n  - {name: floor, shape: {plane: {}}, friction: 3, "
       << "pose: {rpy: [0, " << kFirst * kDegree << ", 0]}, motion: {topic: true}}\n";
  Simulation s(parseScene(text.str()));
  SceneInputs inputs = s.defaultInputs();
  double angle = kFirst;
  for (; angle < 47.0; angle += kRate * 0.005)
  {
    inputs.obstacles[0].X_WG.orientation = tilted(angle);
    ASSERT_TRUE(s.step(inputs).ok) << angle;
    if (s.state().bodies[0].X_WB.orientation.angularDistance(tilted(angle)) > 1.0 * kDegree)
      break;
  }
  EXPECT_NEAR(angle, 45.0, 0.2);
}

/// In a step the ball moves as far as it is wide.
TEST(BodyContact, NothingPassesThroughAtTwentyMetresPerSecond)
{
  for (const char* target :
       {"box: {size: [0.3, 0.3, 0.01]}", "sphere: {radius: 0.05}", "capsule: {radius: 0.02, length: 0.2}"})
  {
    Simulation s(parseScene(std::string(R"(
time: {step: 0.005, duration: 1, integrator: implicit_euler}
gravity: [0, 0, 0]
contact: {gap: 0.0004}
bodies:
  - {name: ball, mass: 0.1, shape: {sphere: {radius: 0.05}}, pose: {position: [0, 0, 0.5]}, velocity: {linear: [0, 0, -20]}}
  - {name: target, mass: 10, shape: {)") +
                            target + "}}\n"));
    runFor(s, 0.1);
    const double apart = s.state().bodies[0].X_WB.position.z() - s.state().bodies[1].X_WB.position.z();
    EXPECT_GT(apart, 0.05) << target;
  }
}

}   // namespace
}   // namespace slender::test
