// Friction turns rods and threads about their tangents.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "test/support/contact.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

/// Two rods that cross, with friction that turns them. `surface` and x of ContactPotential.
struct CrossingRods
{
  CrossingRods()
  {
    Eigen::Matrix3Xd a(3, 3), b(3, 3);
    a << -0.5, 0.1, 0.5, 0, 0, 0, 0, 0, 0;
    b << 0.02, 0.02, 0.02, -0.6, 0.2, 0.5, height(), height(), height();
    for (const Eigen::Matrix3Xd& nodes : {a, b})
      addCurve(surface, x, nodes, kCurveRadius, 0.5);
    for (ContactObject& object : surface.objects)
      object.turns = true;
  }
  static double height() { return 2 * kCurveRadius + 0.4 * kContactGap; }
  ContactPotential potential() const
  {
    ContactOptions options;
    options.gap = kContactGap;
    ContactPotential made(surface, options);
    made.setStiffness(1.0);
    made.begin(x, {}, 0.01);
    return made;
  }

  ContactSurface surface;
  Eigen::Matrix3Xd x;
};

/// Torque of friction on the turn of the segment that begins at a point [N m].
double torqueOn(const ContactPotential& potential, int point)
{
  double torque = 0.0;
  for (const ContactTerm& term : potential.terms())
    for (const ContactTerm::Turn& turn : term.turn)
      if (turn.point == point)
        torque += turn.column.dot(term.force);
  return torque;
}

TEST(RollingCurves, TorqueIsTheDerivativeOfTheEnergy)
{
  const CrossingRods rods;
  ContactPotential potential = rods.potential();
  for (const double scale : {1e-7, 3e-6, 1e-4})   // sticks, nearly slips, slips
  {
    Eigen::Matrix3Xd x = rods.x;
    x.rightCols(3).colwise() += scale * Vector3d(0.3, 0.8, 0.0);
    Eigen::VectorXd turns = Eigen::VectorXd::Zero(6);
    turns[0] = 20 * scale;   // of the segments that touch
    turns[3] = -9 * scale;
    for (const int point : {0, 3})
    {
      const double step = 1e-4 * scale;
      const auto energyAt = [&](double change) {
        Eigen::VectorXd there = turns;
        there[point] += change;
        return potential.evaluate(x, {}, false, &there);
      };
      const double slope = (energyAt(step) - energyAt(-step)) / (2 * step);
      potential.evaluate(x, {}, true, &turns);
      const double torque = torqueOn(potential, point);
      EXPECT_GT(std::abs(torque), 1e-4) << scale;
      EXPECT_NEAR(-torque, slope, 1e-4 * std::abs(torque)) << scale << " " << point;   // round-off of the energy
    }
  }
}

/// The levers of both rods add up to the distance of their centrelines, so that no angular momentum is lost.
TEST(RollingCurves, LeversReachFromOneCentrelineToTheOther)
{
  const CrossingRods rods;
  ContactPotential potential = rods.potential();
  Eigen::Matrix3Xd x = rods.x;
  x.rightCols(3).colwise() += Vector3d(1e-4, 2e-4, 0.0);
  potential.evaluate(x, {}, true);
  int found = 0;
  for (const ContactTerm& term : potential.terms())
    if (term.turns())
    {
      ++found;
      const double a = term.turn[0].column.norm(), b = term.turn[1].column.norm();
      EXPECT_NEAR(a + b, CrossingRods::height(), 1e-3 * CrossingRods::height());
      EXPECT_NEAR(a, b, 1e-3 * CrossingRods::height());
    }
  EXPECT_EQ(found, 1);
}

/// A rod between two grasps, under a box that comes down onto it and is then dragged across it.
TEST(RollingCurves, GraspsFeelTheTorqueOfWhatIsRubbed)
{
  const std::string scene =
      "time: {step: 0.002, duration: 1}\ngravity: [0, 0, 0]\ncontact: {gap: 0.0002}\n"
      "rods: [{name: rod, centerline: {straight: {from: [0, -0.05, 0], to: [0, 0.05, 0], edges: 20}}, "
      "cross_section: {radius: 0.005}, material: {density: 1000, youngs_modulus: 1e9, poissons_ratio: 0.3}, "
      "grasps: {left: {edges: [0]}, right: {edges: [-1]}}, contact: {friction: 0.4}}]\n"
      "obstacles: [{name: box, shape: {box: {size: [0.2, 0.04, 0.02]}}, friction: 0.4, "
      "motion: {table: [[0, 0, 0, 0.0153, 0, 0, 0, 1], [0.1, 0, 0, 0.01508, 0, 0, 0, 1], [1.1, 0.05, 0, 0.01508, 0, "
      "0, 0, 1]]}}]\n";
  Simulation s(parseScene(scene));
  for (int k = 0; k < 150; ++k)
  {
    const StepReport report = s.step(s.defaultInputs());
    ASSERT_TRUE(report.ok) << report.message;
  }
  double force = 0.0, torque = 0.0, lift = 0.0;
  const auto& wrenches = s.world().rodWrenches(0);
  for (const Wrench& wrench : wrenches)
  {
    force += wrench.force.x();
    lift += wrench.force.z();
    torque += wrench.torque.y();   // about the centreline
  }
  EXPECT_LT(lift, -0.1);
  EXPECT_NEAR(force, -0.4 * lift, 0.01 * std::abs(force));
  EXPECT_NEAR(torque, 0.005 * force, 0.02 * std::abs(torque));   // the rod bends by a hundredth of its radius
}

/// What a rod that turns starts with, and a rod whose frames have no inertia.
TEST(RollingCurves, SpinsAreKeptAndSaved)
{
  const std::string text =
      "time: {step: 0.002, duration: 1}\ngravity: [3, 0, -9]\ncontact: {gap: 0.0005}\n"
      "rods: [{name: rod, centerline: {straight: {from: [0, 0, 0.0052], to: [0, 0.1, 0.0052], "
      "edges: 5}}, cross_section: {radius: 0.005}, contact: {friction: FRICTION}}]\n"
      "obstacles: [{shape: {plane: {}}}]\n";
  for (const std::string friction : {"0", "0.4"})
  {
    std::string scene = text;
    scene.replace(scene.find("FRICTION"), 8, friction);
    Simulation s(parseScene(scene));
    for (int k = 0; k < 50; ++k)
      ASSERT_TRUE(s.step(s.defaultInputs()).ok);
    const RodState& rod = s.state().rods[0];
    if (friction == "0")
    {
      EXPECT_EQ(rod.spin.size(), 0);
      continue;
    }
    ASSERT_EQ(rod.spin.size(), 5);
    // it rolls about the horizontal axis along the rod; the surface does not slip
    EXPECT_NEAR(std::abs(rod.spin[2]) * 0.005, rod.v(0, 2), 0.02 * rod.v(0, 2));
    EXPECT_GT(s.energies(0).kinetic, 0.7 * s.rodModel(0).totalMass() * rod.v(0, 2) * rod.v(0, 2));
  }
}

}   // namespace
}   // namespace slender::test
