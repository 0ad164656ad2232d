#include "slender_sim/rod/natural_frames.h"

#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"

/// `rest_twist`, `natural_curvature`, the default of `curvature`, and rings closed at any twist.
namespace slender {
namespace {

Simulation sceneOf(const std::string& rod, const std::string& more = "")
{
  return Simulation(
      parseScene("gravity: [0, 0, 0]\n" + more + "rods:\n  - {" + rod +
                 ", material: {linear_density: 1, stretch_modulus: 1e5, bend_modulus: 2, twist_modulus: 3}}\n"));
}

std::string problemOfRod(const std::string& rod)
{
  try
  {
    sceneOf(rod);
  }
  catch (const SceneError& error)
  {
    return error.what();
  }
  return "";
}

double elasticEnergy(const Simulation& simulation)
{
  const RodEnergies e = simulation.energies(0);
  return e.stretch + e.bend + e.twist;
}

const std::string held = ", grasps: {a: {edges: [0]}, b: {edges: [-1]}}";
const std::string arc =
    "centerline: {arc: {center: [0, 0, 0], start: [1, 0, 0], axis: [0, 0, 1], angle: 2, edges: 20}}, director: [0, 0, "
    "1]";
const double arc_turn = 2.0 / 20, arc_chord = 2 * std::sin(0.5 * arc_turn);   // of one edge [rad], [m]
// a curve out of its plane
const std::string bent = "centerline: {straight: {edges: 24}}, initial: {helix: {radius: 0.2, pitch: 0.3, turns: 0.7}}";

TEST(NaturalFrames, ATwistedRestShapeHasNoEnergyHoweverItIsHeld)
{
  for (const std::string curvature : {"auto", "tangent", "compensated"})
    for (const std::string& ends : {std::string(), held})
      for (const std::string twist : {"5", "-0.7"})
      {
        const std::string rod = arc + ", curvature: " + curvature + ", rest_twist: " + twist + ends;
        // strains of round-off size, squared; a wrong share of the twist or of the turned curvature shows at 1e-5 and
        // above
        EXPECT_LT(elasticEnergy(sceneOf(rod)), 1e-22) << rod;
      }
}

TEST(NaturalFrames, NaturalCurvatureIsThatOfTheArc)
{
  // the arc turns about z = d1: kappa b = -kappa2 d1
  const std::string k = std::to_string(arc_turn / arc_chord);
  for (const std::string curvature : {"auto", "tangent"})
    for (const std::string& ends : {std::string(), held})
    {
      const auto energy = [&](const std::string& natural) {
        return elasticEnergy(sceneOf(arc + ", curvature: " + curvature + ", natural_curvature: " + natural + ends));
      };
      const double straight = energy("[0, 0]");
      // alpha/2 k^2 over all joints, without the half edges at the ends
      EXPECT_NEAR(straight, 0.5 * 2 * 1 * (2 - arc_turn), 0.01 * straight);
      EXPECT_LT(energy("[0, -" + k + "]"), 1e-10 * straight);   // k has six decimals
      EXPECT_GT(energy("[0, " + k + "]"), 3 * straight);
      EXPECT_GT(energy("[" + k + ", 0]"), 1.5 * straight);
      std::string each;   // one entry per inner node
      for (int i = 1; i < 20; ++i)
        each += (i > 1 ? ", [0, -" : "[0, -") + k + "]";
      EXPECT_LT(energy("[" + each + "]"), 1e-10 * straight);
    }
}

TEST(NaturalFrames, RoundSectionsBendAlikeHoweverTheirFramesAreTurned)
{
  const auto bending = [](const std::string& curvature, const std::string& turn) {
    return sceneOf(bent + ", curvature: " + curvature + ", initial_twist: 3, rest_twist: " + turn).energies(0).bend;
  };
  const double plain = bending("auto", "0");
  EXPECT_GT(plain, 1.0);
  EXPECT_NEAR(bending("auto", "14"), plain, 1e-11 * plain);   // round-off of the turned frames
  EXPECT_NEAR(bending("auto", "-20"), plain, 1e-11 * plain);
  EXPECT_GT(std::abs(bending("tangent", "14") / bending("tangent", "0") - 1), 0.01);   // the thesis's joints feel it
}

TEST(NaturalFrames, CurvatureIsChosenBySectionsAndFormulation)
{
  const auto chosen = [](const std::string& section, const std::string& more = "") {
    return Simulation(
               parseScene(more + "rods:\n  - {centerline: {straight: {edges: 9}}, cross_section: " + section + "}\n"))
        .rodModel(0)
        .curvature;
  };
  EXPECT_EQ(chosen("{radius: 0.01}"), Curvature::compensated);
  EXPECT_EQ(chosen("{ellipse: [0.01, 0.01]}"), Curvature::compensated);
  EXPECT_EQ(chosen("{ellipse: [0.01, 0.02]}"), Curvature::tangent);
  // the isotropic formulation of explicit steps has no frames to depend on
  EXPECT_EQ(chosen("{radius: 0.01}", "time: {integrator: symplectic_euler, step: 1e-5}\n"), Curvature::tangent);
}

TEST(NaturalFrames, ARingMayBeClosedAtAnyTwist)
{
  for (const std::string& integrator : {"implicit_euler", "symplectic_euler"})
    for (const double twist : {1.0, M_PI, -2.5, 4.0, 9.3})
    {
      const std::string ring =
          "closed: true, naturally_straight: true, initial_twist: " + std::to_string(twist) +
          ", centerline: {arc: {start: [1, 0, 0], axis: [0, 0, 1], angle: 6.283185307179586, edges: 40}}";
      Simulation simulation = sceneOf(ring, "time: {step: 1e-4, integrator: " + std::string(integrator) + "}\n");
      const double length = simulation.rodModel(0).rest_length.sum(), rounded = std::stod(std::to_string(twist));
      const double expected = 0.5 * 3 * rounded * rounded / length;   // beta/2 (twist/L)^2 L
      EXPECT_NEAR(simulation.energies(0).twist, expected, 1e-9 * expected) << twist;
      const double flat =
          sceneOf(
              "closed: true, naturally_straight: true, centerline: {arc: {start: [1, 0, 0], axis: [0, 0, 1], "
              "angle: 6.283185307179586, edges: 40}}")
              .energies(0)
              .bend;
      // joints of 9 degrees: the two kinds of curvature differ by their turn squared over six, the twist's coupling by
      // less
      EXPECT_NEAR(simulation.energies(0).bend, flat, 0.02 * flat) << twist;
      for (int k = 0; k < 5; ++k)
      {
        const StepReport report = simulation.step(simulation.defaultInputs());
        ASSERT_TRUE(report.ok) << report.message;
      }
      EXPECT_NEAR(simulation.energies(0).twist, expected, 1e-4 * expected) << twist;   // it has hardly moved
    }
}

TEST(NaturalFrames, TheNaturalCurvatureOfARingTurnsWithItsFrames)
{
  const std::string ring =
      "closed: true, centerline: {arc: {start: [1, 0, 0], axis: [0, 0, 1], angle: 6.283185307179586, edges: 40}}";
  // whole turns of the natural frames alone are a change of names
  EXPECT_LT(elasticEnergy(sceneOf(ring + ", rest_twist: 6.283185307179586")), 1e-22);
  for (const double turn : {1.0, 3.0})
  {
    // Turned back by the initial twist, the frames are plane, and the direction of the natural curvature turns by so
    // much along the ring.
    const std::string both = ", rest_twist: " + std::to_string(turn) + ", initial_twist: -" + std::to_string(turn);
    // alpha times the integral of 1 - cos
    const double length = 2 * M_PI, smooth = 2 * length * (1 - std::sin(turn) / turn);
    // but for the joint of the seam: at most 2 alpha
    EXPECT_NEAR(sceneOf(ring + both).energies(0).bend, smooth, 2 * 2 * length / 40) << turn;
  }
}

TEST(NaturalFrames, WrongEntriesAreRefused)
{
  const std::string straight = "centerline: {straight: {edges: 10}}";
  EXPECT_NE(problemOfRod(straight + ", rest_twist: [1, 2]")
                .find("rods.0.rest_twist = [1, 2]: has 2 entries; must have 1 or 9 (one per inner node)"),
            std::string::npos);
  EXPECT_NE(problemOfRod(straight + ", natural_curvature: 3").find("natural_curvature"), std::string::npos);
  EXPECT_NE(problemOfRod(straight + ", natural_curvature: [1, 2, 3]").find("must be [kappa1, kappa2]"),
            std::string::npos);
  EXPECT_NE(problemOfRod(straight + ", natural_curvature: [[1, 2], [1, 2]]").find("has 2 entries; must have 1 or 9"),
            std::string::npos);
  EXPECT_NE(problemOfRod(straight + ", natural_curvature: [30, 0]").find("must be less than 2: use shorter edges"),
            std::string::npos);
  EXPECT_NE(problemOfRod(straight + ", natural_curvature: [1, 0], naturally_straight: true")
                .find("contradicts naturally_straight"),
            std::string::npos);
  const std::string ring =
      "closed: true, naturally_straight: true, initial_twist: 1, centerline: {arc: {start: [1, 0, 0], axis: [0, 0, 1], "
      "angle: 6.283185307179586, edges: 40}}, material: {bend_modulus: [1, 2], twist_modulus: 1, stretch_modulus: 1e5}";
  try
  {
    Simulation(parseScene("rods:\n  - {" + ring + "}\n"));
    FAIL() << "an elliptical ring whose sections do not meet";
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("do not meet where the loop is closed"), std::string::npos)
        << error.what();
  }
  RodModel model;
  EXPECT_THROW(addNaturalTwist(model, Eigen::VectorXd::Zero(1)), std::invalid_argument);
  EXPECT_THROW(setNaturalCurvature(model, Eigen::Matrix2Xd::Zero(2, 1)), std::invalid_argument);
}

}   // namespace
}   // namespace slender
