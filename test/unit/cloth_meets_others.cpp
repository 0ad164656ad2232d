// Cloth that meets rods, threads and bodies by the barrier of contact.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/contact/distance.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

constexpr double kClothThickness = 0.002, kRopeRadius = 0.004, kBallRadius = 0.03;   // [m]
constexpr double kBallMass = 0.02;                                                   // [kg]

const std::string kSheet = R"(
time: {step: 0.004, duration: 1, integrator: implicit_euler}
contact: {gap: 0.001}
cloths:
  - name: sheet
    grid: {corner: [-0.15, -0.15, 0], sides: [[0.3, 0, 0], [0, 0.3, 0]], cells: 8, pattern: alternating}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 2.0e5, poissons_ratio: 0.3}
    bending: {modulus: 2.0e-6}
    contact: {friction: 0.3, thickness: 0.002}
)";

const std::string kRope = R"(
rods:
  - name: rope
    centerline: {straight: {from: [-0.25, 0.03, -0.012], to: [0.25, 0.02, -0.012], edges: 24}}
    cross_section: {radius: 0.004}
    material: {density: 1100, youngs_modulus: 1.0e6, poissons_ratio: 0.45}
    grasps:
      left: {edges: [0]}
      right: {edges: [-1]}
    contact: {friction: 0.3}
)";

const std::string kThrownBall = R"(
bodies:
  - name: ball
    mass: 0.02
    shape: {sphere: {radius: 0.03}}
    pose: {position: [0.02, 0.01, 0.04]}
    velocity: {linear: [0, 0, -1]}
)";

/// The corners of a triangle of the first cloth.
std::array<Vector3d, 3> corners(const Simulation& s, Eigen::Index t)
{
  const Eigen::Matrix3Xi& triangles = s.clothModel(0).rest.triangles;
  const Eigen::Matrix3Xd& x = s.state().cloths[0].x;
  return {x.col(triangles(0, t)), x.col(triangles(1, t)), x.col(triangles(2, t))};
}

/// Smallest distance of the first rod, and of the ball, from the sheet, less thickness and radii [m]. Many places of
/// each segment stand for its inside.
double roomOnSheet(const Simulation& s)
{
  constexpr int kPlaces = 20;
  double least = 1.0;
  for (Eigen::Index t = 0; t < s.clothModel(0).rest.triangles.cols(); ++t)
  {
    const auto [a, b, c] = corners(s, t);
    for (const RodState& rod : s.state().rods)
      for (Eigen::Index j = 0; j + 1 < rod.x.cols(); ++j)
        for (int k = 0; k <= kPlaces; ++k)
        {
          const double u = static_cast<double>(k) / kPlaces;
          const Vector3d p = (1 - u) * rod.x.col(j) + u * rod.x.col(j + 1);
          least = std::min(least, pointTriangleDistance(p, a, b, c) - kRopeRadius - 0.5 * kClothThickness);
        }
    for (const RigidBodyState& body : s.state().bodies)
      least = std::min(least, pointTriangleDistance(body.X_WB.position, a, b, c) - kBallRadius - 0.5 * kClothThickness);
  }
  return least;
}

TEST(ClothMeetsOthers, RopeAndBallKeepTheThickness)
{
  Simulation s(parseScene(kSheet + kRope + kThrownBall, "all"));
  std::size_t most = 0;
  for (int k = 0; k < 50; ++k)
  {
    const StepReport report = s.step(s.defaultInputs());
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    most = std::max(most, s.world().contacts().size());
    ASSERT_GT(roomOnSheet(s), 0.0) << k;
  }
  EXPECT_GE(most, 10u);
  // The ball has not passed the sheet, which the rope carries. Without them it would have fallen by 0.39 m.
  EXPECT_GT(s.state().bodies[0].X_WB.position.z(), -0.2);
  EXPECT_LT(s.world().contactForces({ObjectRef::rod, 0}).row(2).sum(), 0.0);
}

/// Momentum is kept, whether the equations are solved by factors or by sweeps.
class ClothAndBall : public testing::TestWithParam<const char*>
{};

TEST_P(ClothAndBall, WhatOneLosesTheOtherGets)
{
  Simulation s(
      parseScene(kSheet + kThrownBall, "free", {"gravity=[0, 0, 0]", "cloths.0.contact.friction=0", GetParam()}));
  const auto momentum = [&] {
    Vector3d sum = kBallMass * s.state().bodies[0].velocity.linear;
    for (Eigen::Index i = 0; i < s.state().cloths[0].v.cols(); ++i)
      sum += s.clothModel(0).mass[i] * s.state().cloths[0].v.col(i);
    return sum;
  };
  const Vector3d before = momentum();
  for (int k = 0; k < 25; ++k)
  {
    const Vector3d ball_before = s.state().bodies[0].velocity.linear;
    ASSERT_TRUE(s.step(s.defaultInputs()).ok) << k;
    const Vector3d gained = kBallMass * (s.state().bodies[0].velocity.linear - ball_before);
    const Vector3d lost = 0.004 * s.world().contactForces({ObjectRef::cloth, 0}).rowwise().sum();
    // Newton's increments of 1e-6 of an edge leave this much of the forces of a stiff sheet
    EXPECT_LT((gained + lost).norm(), 1e-5 * kBallMass)
        << k << " " << gained.transpose() << " lost " << lost.transpose() << " terms " << s.world().contacts().size();
  }
  EXPECT_GT(s.state().bodies[0].velocity.linear.z(), -0.9);   // it has been braked
  // The same, summed over the steps of the collision. Newton's method ends at increments of 1e-3 of the gap.
  EXPECT_LT((momentum() - before).norm(), 1e-6 * before.norm());
}

INSTANTIATE_TEST_SUITE_P(ClothMeetsOthers, ClothAndBall,
                         testing::Values("cloths.0.grid.cells=8", "cloths.0.grid.cells=14"));

/// Cloth and bodies are solved by sweeps over points. The motion is the same as with a factorisation.
TEST(ClothMeetsOthers, SweepsAgreeWithFactors)
{
  const std::vector<std::string> fine{"cloths.0.grid.cells=12", "gravity=[0, 0, 0]"};
  std::vector<std::string> factors = fine;
  factors.push_back("time.newton.linear=cholesky");
  Simulation swept(parseScene(kSheet + kThrownBall, "swept", fine)),
      factored(parseScene(kSheet + kThrownBall, "factored", factors));
  int sweeps = 0;
  for (int k = 0; k < 25; ++k)
  {
    const StepReport report = swept.step(swept.defaultInputs()), other = factored.step(factored.defaultInputs());
    ASSERT_TRUE(report.ok && other.ok) << k;
    if (!swept.world().contacts().empty())
      sweeps += report.linear_iterations;
    // Newton's method ends at increments of a thousandth of the gap of 1 mm, in each step.
    const double apart = (swept.state().cloths[0].x - factored.state().cloths[0].x).colwise().norm().maxCoeff();
    EXPECT_LT(apart, 5e-6) << k;
  }
  EXPECT_GT(sweeps, 100);
  EXPECT_GT(swept.state().bodies[0].velocity.linear.z(), -0.9);   // the sheet has braked it
}

TEST(ClothMeetsOthers, SavedStatesGoOnBitByBit)
{
  const SceneConfig config = parseScene(kSheet + kRope + kThrownBall, "all");
  Simulation first(config), second(config);
  second.setThreads(2);
  for (int k = 0; k < 12; ++k)
    ASSERT_TRUE(first.step(first.defaultInputs()).ok);
  const std::string file = std::filesystem::temp_directory_path() / "cloth_meets_others.state";
  first.save(file);
  second.load(file);
  std::filesystem::remove(file);
  for (int k = 0; k < 8; ++k)
  {
    ASSERT_TRUE(first.step(first.defaultInputs()).ok);
    ASSERT_TRUE(second.step(second.defaultInputs()).ok);
  }
  EXPECT_EQ(first.state().cloths[0].x, second.state().cloths[0].x);
  EXPECT_EQ(first.state().rods[0].x, second.state().rods[0].x);
  EXPECT_EQ(first.state().bodies[0].X_WB.position, second.state().bodies[0].X_WB.position);
}

/// An edge of the sheet is held, and an obstacle moves onto it: the held vertices do not stop it.
TEST(ClothMeetsOthers, HeldVerticesPassThroughWhatMovesAsPrescribed)
{
  const std::string held = kSheet + "    grasps: {edge: {vertices: [0..8]}}\n" +
                           "obstacles:\n  - {name: post, shape: {sphere: {radius: 0.05}}, motion: {table: [[0, 0, "
                           "-0.22, 0], [0.1, 0, -0.12, 0]]}}\n";
  Simulation s(parseScene(held, "held", {"cloths.0.contact.method=barrier"}));
  std::size_t most = 0;
  for (int k = 0; k < 20; ++k)
  {
    const StepReport report = s.step(s.defaultInputs());
    ASSERT_TRUE(report.ok) << k << " " << report.message;
    most = std::max(most, s.world().contacts().size());
  }
  EXPECT_GE(most, 1u);   // it has reached the free vertices
}

TEST(ClothMeetsOthers, TheMethodFollowsFromWhatThereIs)
{
  const auto method = [](const std::string& text, const std::vector<std::string>& changes = {}) {
    return parseScene(text, "t", changes).cloths[0].contact->method;
  };
  std::string alone = kSheet;
  alone.erase(alone.find("contact: {gap: 0.001}\n"), std::string("contact: {gap: 0.001}\n").size());
  EXPECT_EQ(method(alone), ContactMethod::impulses);
  EXPECT_EQ(method(alone, {"cloths.0.contact.method=barrier"}), ContactMethod::barrier);
  EXPECT_EQ(method(kSheet + kRope), ContactMethod::barrier);
  EXPECT_EQ(method(kSheet + kThrownBall), ContactMethod::barrier);
  std::string untouched = kRope;
  untouched.erase(untouched.find("    contact:"));
  EXPECT_EQ(method(alone + untouched), ContactMethod::impulses);
  EXPECT_NEAR(parseScene(alone, "t", {"cloths.0.contact.method=barrier"}).contact.gap, 0.5 * kClothThickness, 1e-15);
  const SceneConfig mixed = parseScene(kSheet + kRope, "t", {"cloths.0.contact.method=impulses"});
  EXPECT_TRUE(std::any_of(mixed.warnings.begin(), mixed.warnings.end(), [](const std::string& warning) {
    return warning.find("pass through the rods") != std::string::npos;
  }));
  try
  {
    parseScene(kSheet + kThrownBall, "t", {"cloths.0.contact.method=impulses"});
    ADD_FAILURE() << "a ball that the sheet cannot push";
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("method: barrier"), std::string::npos) << error.what();
  }
}

TEST(ClothMeetsOthers, SurfacesThatCrossAtTheStartAreRefusedByName)
{
  try
  {
    Simulation(parseScene(kSheet + kRope, "crossing", {"cloths.0.grid.corner=[-0.15, -0.15, -0.012]"}));
    ADD_FAILURE() << "they cross";
  }
  catch (const std::exception& error)
  {
    const std::string text = error.what();
    EXPECT_NE(text.find("rod 'rope'"), std::string::npos) << text;
    EXPECT_NE(text.find("cloth 'sheet'"), std::string::npos) << text;
  }
}

}   // namespace
}   // namespace slender::test
