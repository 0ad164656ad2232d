// Solids that move as prescribed, and pieces with held points: what is held is never a trap for what is free.
#include <cmath>

#include <gtest/gtest.h>

#include "contact/contact_potential.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

constexpr double kRadius = 0.1, kGap = 0.01, kHalf = 0.001;   // of the ball, of contact, of the thickness [m]

/// A triangle in the plane z = 0, whose corner at the origin is held, and a ball below.
struct HeldTriangle
{
  HeldTriangle()
  {
    ContactSurface surface;
    surface.points = 3;
    surface.triangles.push_back({{0, 1, 2}, kHalf, 0, 1});
    surface.objects.emplace_back();
    surface.solids.push_back({{Sphere{kRadius}, -1.0, "ball"}});
    x << 0, 1, 0, 0, 0, 1, 0, 0, 0;
    potential = std::make_unique<ContactPotential>(surface, ContactOptions{kGap});
  }
  /// The ball goes from one place to another. Returns the energy with the ball at the second one.
  double energy(const Vector3d& from, const Vector3d& to)
  {
    const std::vector<Pose> start{{from, Eigen::Quaterniond::Identity()}}, end{{to, Eigen::Quaterniond::Identity()}};
    potential->letPass(x, start, x, end);
    return potential->evaluate(x, end, false);
  }

  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, 3);
  std::unique_ptr<ContactPotential> potential;
};

TEST(HeldPieces, TouchWhatIsClearOfTheirHeldCorners)
{
  HeldTriangle t;
  const double touching = -kRadius - kHalf - 0.3 * kGap;
  EXPECT_GT(t.energy({0.3, 0.3, -1}, {0.3, 0.3, touching}), 0.0);
  EXPECT_TRUE(std::isinf(t.energy({0.3, 0.3, -0.5}, {0.3, 0.3, 0.0})));
}

TEST(HeldPieces, LetPassWhatPressesOnTheirHeldCorners)
{
  HeldTriangle t;
  const Vector3d far(0.05, 0.05, -0.5), near(0.05, 0.05, -0.08), above(0.05, 0.05, 0.5);
  EXPECT_EQ(t.energy(far, near), 0.0);                                         // near the corner at the end
  EXPECT_EQ(t.energy(near, near), 0.0);                                        // inside of it
  EXPECT_EQ(t.energy({0.3, 0.3, 0.0}, {0.3, 0.3, 0.0}), 0.0);                  // clear of it, but still in the triangle
  EXPECT_EQ(t.energy(far, above), 0.0);                                        // past it in one step
  EXPECT_GT(t.energy(above, {0.3, 0.3, kRadius + kHalf + 0.5 * kGap}), 0.0);   // apart again, on the other side
}

TEST(HeldPieces, ARopeThatIsPressedIntoATableStaysAboveItAndComesOut)
{
  Simulation s(parseScene(R"(
time: {step: 0.005, integrator: implicit_euler}
rods:
  - name: rope
    centerline: {straight: {from: [0, 0, 0.02], to: [0.1, 0, 0.02], edges: 10}}
    cross_section: {radius: 0.002}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.4}
    contact: {}
    grasps: {hand: {edges: [0], motion: {table: [[0, 0, 0, 0.02, 0, 0, 0, 1], [0.2, 0, 0, -0.02, 0, 0, 0, 1],
                                                 [0.4, 0, 0, 0.05, 0, 0, 0, 1]]}}}
obstacles:
  - {name: table, shape: {box: {size: [1, 1, 0.2]}}, pose: {position: [0, 0, -0.1]}}
)"));
  double lowest = 1.0;
  for (int k = 0; k < 100; ++k)
  {
    const StepReport report = s.step(s.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
    const auto free = s.state().rods[0].x.row(2).tail(9);
    ASSERT_GT(free.minCoeff(), 0.002);   // the radius
    lowest = std::min(lowest, s.state().rods[0].x(2, 0));
  }
  EXPECT_LT(lowest, -0.019);
  EXPECT_GT(s.state().rods[0].x(2, 1), 0.02);
}

/// Both ends of each edge are held. That must not let a simulated body through.
TEST(HeldPieces, ABodyRestsOnARodThatIsHeldAlongItsLength)
{
  Simulation s(parseScene(R"(
time: {step: 0.005, integrator: implicit_euler}
rods:
  - name: bar
    centerline: {straight: {from: [-0.1, 0, 0], to: [0.1, 0, 0], edges: 4}}
    cross_section: {radius: 0.01}
    contact: {friction: 0.5}
    grasps: {all: {edges: [0, 1, 2, 3]}}
bodies:
  - {name: ball, mass: 0.1, shape: {sphere: {radius: 0.03}}, pose: {position: [0, 0, 0.045]}}
)"));
  for (int k = 0; k < 40; ++k)
    ASSERT_TRUE(s.step(s.defaultInputs()).ok);
  EXPECT_GT(s.state().bodies[0].X_WB.position.z(), 0.04);   // both radii
}

}   // namespace
}   // namespace slender::test
