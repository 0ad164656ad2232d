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
  // friction holds by creeping slower than contact.slip_speed, 1e-4 m/s
  EXPECT_LT(std::abs(sticks.state().bodies[0].velocity.linear.x()), 1e-4);
  for (const double slope : {1.01 * kFriction, 2.0 * kFriction})
  {
    Simulation slips(parseScene(onIncline(slope, kBox, 0.0503)));
    const double angle = std::atan(slope), expected = kGravity * (std::sin(angle) - kFriction * std::cos(angle));
    // 1 % of the weight's share along the slope
    EXPECT_NEAR(acceleration(slips), expected, 0.01 * kGravity * std::sin(angle)) << slope;
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

TEST(BodyContact, ACylinderPassesThroughFloorsWithAWarning)
{
  const SceneConfig scene = parseScene(
      "time: {step: 0.005, duration: 1}\nbodies:\n  - {name: disc, mass: 1, shape: "
      "{cylinder: {radius: 0.1, length: 0.02}}, pose: {position: [0, 0, 0.2]}}\n" +
      kFloor);
  const auto warned = [&](const std::string& text) {
    return std::any_of(scene.warnings.begin(), scene.warnings.end(),
                       [&](const std::string& warning) { return warning.find(text) != std::string::npos; });
  };
  EXPECT_TRUE(warned("passes through obstacles"));
  EXPECT_TRUE(warned("are touched by nothing (floor)"));
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
