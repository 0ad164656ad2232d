// Equilibria against formulas: cantilever, catenary, arc, wrenches at the grasps, buckling.
#include <gtest/gtest.h>

#include "test/support/rods.h"

namespace slender::test {
namespace {

const Vector3d kDown(0, 0, -9.81);

void settle(Rod& rod, RodStepper& stepper)
{
  const StepReport report = stepper.solveEquilibrium(rod.state, rod.inputs);
  ASSERT_TRUE(report.ok) << report.message;
  ASSERT_TRUE(report.stable);
  EXPECT_LT(report.residual, 1e-6);
  EXPECT_EQ(rod.state.v.norm(), 0.0);
}

/// Tip of a rod clamped horizontally at one end under its weight.
Vector3d cantileverTip(int n, double length, const RodSection& section, double shear = 0.0)
{
  Rod rod = straightRod(n, length, section);
  if (shear != 0)
  {
    // unequal edges: a smooth change of spacing along the rod
    for (int i = 0; i < n; ++i)
    {
      const double s = static_cast<double>(i) / (n - 1);
      rod.state.x(0, i) = length * (s + shear * std::sin(2 * M_PI * s) / (2 * M_PI));
    }
    rod = Rod(openRod(rod.state.x, section), rod.state.x);
  }
  rod.inputs.gravity = kDown;
  rod.hold(0, 0);
  RodStepper stepper(rod.model, TimeConfig{});
  settle(rod, stepper);
  return rod.state.x.col(n - 1);
}

TEST(Cantilever, SmallDeflectionIsLinearTheory)
{
  // w L^4 / (8 B) [Timoshenko, Strength of Materials]; at deflections of 1e-3 L the nonlinear part is 1e-6 of it
  const double length = 1.0, r = 0.01, youngs = 2e9, density = 1000;
  const RodSection section = roundSection(r, youngs, density);
  const double weight = section.linear_density * 9.81, bend = section.bend_modulus(0, 0);
  const double expected = weight * std::pow(length, 4) / (8 * bend);
  ASSERT_LT(expected, 0.1 * length);
  for (int n : {11, 21, 41})
  {
    const double tip = -cantileverTip(n, length, section).z();
    // second order in the edge, h = L / (n - 1), the clamp included; nonlinear part (tip / L)^2
    EXPECT_NEAR(tip / expected, 1.0, 1.0 / ((n - 1) * (n - 1)) + std::pow(expected / length, 2)) << n;
  }
}

TEST(Cantilever, ClampIsSecondOrder)
{
  // Gamma = w L^3 / B = 20: bent by 60 degrees. Against the exact elastica by Richardson; 1e-5 from the published
  // (0.66234, -0.69540).
  const RodSection section = roundSection(0.002, 1e9, 1000);
  for (double shear : {0.0, 0.5})
  {
    const Vector3d finest = cantileverTip(641, 1.0, section, shear), fine = cantileverTip(321, 1.0, section, shear);
    const Vector3d exact = finest + (finest - fine) / 3.0;
    EXPECT_LT((exact - Vector3d(0.66234, 0, -0.69540)).norm(), 3e-5);
    double last = 1;
    for (int edges : {10, 20, 40, 80})
    {
      const double error = (cantileverTip(edges + 1, 1.0, section, shear) - exact).norm();
      // second order is reached from 40 edges on; unequal edges differ threefold in length
      EXPECT_GT(std::log2(last / error), edges == 10   ? -1
                                         : edges == 20 ? 1.3
                                         : edges == 40 ? 1.7
                                                       : 1.8)
          << edges << " edges, shear " << shear;
      last = error;
    }
    EXPECT_LT(last, shear > 0 ? 5e-4 : 3e-4);   // 80 edges
  }
}

TEST(Catenary, OfALongThinRod)
{
  // two pins at the same height, span half the length: y = a (cosh(x/a) - cosh(span/2a)), 2 a sinh(span/2a) = L
  const int n = 81;
  const double length = 2.0, span = 1.0;
  Rod rod = straightRod(n, length, roundSection(2e-4, 1e8, 1000));   // bending length (B/w)^(1/3) = 47 mm
  rod.inputs.gravity = kDown;
  rod.hold(0, 0, false);
  rod.hold(n - 1, n - 1, false);
  rod.inputs.grasps[1].X_WG.position.x() = span;
  RodStepper stepper(rod.model, TimeConfig{});
  settle(rod, stepper);
  double a = 0.3;
  for (int k = 0; k < 50; ++k)
  {
    const double f = 2 * a * std::sinh(0.5 * span / a) - length,
                 df = 2 * std::sinh(0.5 * span / a) - span / a * std::cosh(0.5 * span / a);
    a -= f / df;
  }
  const double lowest = rod.state.x.row(2).minCoeff();
  // polygon of 80 edges: h^2 / (8 a) = 0.4 mm of sag at the bottom; bending over 47 mm with a radius of 230 mm, some
  // 0.02 of that length
  EXPECT_NEAR(lowest, a - a * std::cosh(0.5 * span / a), 2e-3);
  for (int i = 0; i < n; ++i)
  {
    const double x = rod.state.x(0, i) - 0.5 * span;
    EXPECT_NEAR(rod.state.x(2, i), a * std::cosh(x / a) - a * std::cosh(0.5 * span / a), 5e-3) << i;
    EXPECT_NEAR(rod.state.x(1, i), 0.0, 1e-6);
  }
  // a pin carries no torque; the two share the weight, and the horizontal force is a times the weight per length
  const double weight = rod.weight();
  for (int g = 0; g < 2; ++g)
  {
    EXPECT_LT(stepper.wrenches()[g].torque.norm(), 1e-12);
    EXPECT_NEAR(stepper.wrenches()[g].force.z(), -0.5 * weight, 1e-6 * weight);
    EXPECT_NEAR(std::abs(stepper.wrenches()[g].force.x()), a * weight / length, 0.01 * weight);
  }
}

TEST(Catenary, IsFoundFromAnyStart)
{
  // Ropes from limp to stiff, from the stretched line and from a compressed arch the wrong length: one equilibrium
  // each.
  for (double r : {2e-4, 1e-3, 4e-3})
    for (double youngs : {1e6, 1e8})
    {
      double lowest[2];
      for (bool compressed : {false, true})
      {
        const int n = 61;
        Rod rod = straightRod(n, 2.0, roundSection(r, youngs, 1000));
        rod.inputs.gravity = kDown;
        if (compressed)
        {
          Matrix3Xd x(3, n);
          for (int i = 0; i < n; ++i)
          {
            const double s = static_cast<double>(i) / (n - 1);
            x.col(i) = Vector3d(s, 0, -0.6 * std::sin(M_PI * s));   // a fifth shorter than the rod
          }
          rod.state = makeRodState(*rod.model, x, Vector3d::UnitY());
        }
        rod.hold(0, 0, false);
        rod.hold(n - 1, n - 1, false);
        rod.inputs.grasps[1].X_WG.position = Vector3d(1, 0, 0);
        RodStepper stepper(rod.model, TimeConfig{});
        settle(rod, stepper);
        lowest[compressed] = rod.state.x.row(2).minCoeff();
      }
      EXPECT_NEAR(lowest[0], lowest[1], 1e-6) << "r " << r << " E " << youngs;
    }
}

TEST(Arc, BetweenClampsCarriesAPureMoment)
{
  // a straight rod held as an arc of angle phi: moment B phi / L everywhere, no force
  const int n = 41;
  const double length = 1.0, phi = 1.2, radius = length / phi, bend = 2.0;
  Rod rod = straightRod(n, length, modulusSection(bend, 1.5, 1e6, 1.0));
  rod.hold(0, 0);
  rod.hold(n - 1, n - 1);
  rod.inputs.grasps[1].X_WG.position = radius * Vector3d(std::sin(phi), 0, 1 - std::cos(phi));
  rod.inputs.grasps[1].X_WG.orientation =
      Eigen::AngleAxisd(-phi, Vector3d::UnitY()) * rod.inputs.grasps[1].X_WG.orientation;
  RodStepper stepper(rod.model, TimeConfig{});
  settle(rod, stepper);
  const double moment = bend * phi / length;
  // turns per edge of 0.03 rad: relative error phi_edge^2 / 12 times a few; force by a chord that is longer than the
  // rod by 4e-5
  EXPECT_NEAR(stepper.wrenches()[0].torque.y(), -moment, 2e-3 * moment);
  EXPECT_NEAR(stepper.wrenches()[1].torque.y(), moment, 2e-3 * moment);
  for (int i = 0; i < n; ++i)
  {
    const double s = phi * i / (n - 1);
    EXPECT_LT((rod.state.x.col(i) - radius * Vector3d(std::sin(s), 0, 1 - std::cos(s))).norm(), 2e-4 * length) << i;
  }
}

TEST(Wrench, OfAHangingRodIsItsWeight)
{
  for (const Vector3d& gravity : {Vector3d(0, 0, -9.81), Vector3d(9.81, 0, 0), Vector3d(-3, 5, 7)})
  {
    Rod rod = straightRod(25, 0.7, roundSection(0.003, 1e7, 1200));
    rod.inputs.gravity = gravity;
    rod.hold(0, 0);
    RodStepper stepper(rod.model, TimeConfig{});
    settle(rod, stepper);
    EXPECT_LT((stepper.wrenches()[0].force - rod.model->totalMass() * gravity).norm(), 1e-6 * rod.weight());
    // moment of the weights about the grasp; what Newton leaves unbalanced is 1e-9 of the stretching forces
    Vector3d moment = Vector3d::Zero();
    for (int i = 0; i < 25; ++i)
      moment += (rod.state.x.col(i) - rod.state.grasps[0].X_WG.position).cross(rod.model->mass[i] * gravity);
    EXPECT_LT((stepper.wrenches()[0].torque - moment).norm(), 1e-6 * rod.weight() * 0.7);
  }
}

TEST(Wrench, OfAWideGraspAndAPinBalancesTheRod)
{
  // held edges, a clamp in the middle and a pin: all forces together are the weight, all torques its moment
  Random random(71);
  const int n = 30;
  const Matrix3Xd nodes = helixNodes(n, 0.2, 0.15, 0.9);
  RodSection section = roundSection(0.004, 1e7, 1100);
  section.bend_modulus(1, 1) *= 0.4;
  Rod rod(openRod(nodes, section), nodes);
  rod.inputs.gravity = Vector3d(1, -2, -9);
  rod.inputs.forces = Matrix3Xd::Zero(3, n);
  for (int i = 0; i < n; ++i)
    rod.inputs.forces.col(i) = random.vector(2e-3);
  rod.hold(0, 2);
  rod.hold(17, 17);
  rod.hold(25, 25, false);
  RodStepper stepper(rod.model, TimeConfig{});
  settle(rod, stepper);
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero(), load = Vector3d::Zero(), load_moment = Vector3d::Zero();
  for (std::size_t g = 0; g < 3; ++g)
  {
    const Wrench& w = stepper.wrenches()[g];
    force += w.force;
    moment += w.torque + rod.state.grasps[g].X_WG.position.cross(w.force);
  }
  for (int i = 0; i < n; ++i)
  {
    const Vector3d f = rod.model->mass[i] * rod.inputs.gravity + rod.inputs.forces.col(i);
    load += f;
    load_moment += rod.state.x.col(i).cross(f);
  }
  EXPECT_LT((force - load).norm(), 1e-6 * load.norm());
  EXPECT_LT((moment - load_moment).norm(), 1e-6 * load.norm());
  EXPECT_GT(stepper.wrenches()[1].torque.norm(), 1e-4);   // the clamps do carry torque
  EXPECT_LT(stepper.wrenches()[2].torque.norm(), 1e-12);
}

TEST(Wrench, OfASettledRunIsTheStaticOne)
{
  for (Integrator integrator : implicitIntegrators())
  {
    const int n = 16;
    Rod rod = straightRod(n, 0.5, roundSection(0.005, 2e6, 1100));
    rod.model->mass_damping = 8.0;
    rod.model->stiffness_damping = 0.02;
    rod.inputs.gravity = kDown;
    rod.hold(0, 0);
    rod.hold(n - 1, n - 1);
    rod.inputs.grasps[1].X_WG.position += Vector3d(-0.1, 0.05, 0);
    Rod fixed = rod;
    RodStepper stepper(rod.model, withIntegrator(integrator)), statics(fixed.model, TimeConfig{});
    settle(fixed, statics);
    // carried over slowly, then left alone until it rests
    const Pose start = rod.state.grasps[1].X_WG, end = rod.inputs.grasps[1].X_WG;
    for (int k = 1; k <= 1000; ++k)
    {
      rod.inputs.grasps[1].X_WG.position = start.position + std::min(1.0, k / 100.0) * (end.position - start.position);
      ASSERT_TRUE(stepper.step(rod.state, rod.inputs, 0.01).ok);
    }
    // damped by exp(-4 * 9) and more
    EXPECT_LT((rod.state.x - fixed.state.x).cwiseAbs().maxCoeff(), 1e-6) << toString(integrator);
    // stretching that the step does not resolve hardly dies away with the midpoint rule
    const double tolerance = integrator == Integrator::implicit_midpoint ? 5e-4 : 1e-5;
    for (int g = 0; g < 2; ++g)
    {
      EXPECT_LT((stepper.wrenches()[g].force - statics.wrenches()[g].force).norm(), tolerance * rod.weight())
          << toString(integrator);
      EXPECT_LT((stepper.wrenches()[g].torque - statics.wrenches()[g].torque).norm(), tolerance * rod.weight() * 0.5)
          << toString(integrator);
    }
  }
}

TEST(Grasps, AttachAndRelease)
{
  for (Integrator integrator : allIntegrators())
  {
    Rod rod = straightRod(20, 0.5, roundSection(0.004, 1e6, 1100));
    rod.model->mass_damping = 1.0;
    rod.model->stiffness_damping = 1e-4;
    rod.inputs.gravity = kDown;
    rod.hold(0, 0);
    RodStepper stepper(rod.model, withIntegrator(integrator));
    const bool fine = integrator == Integrator::symplectic_euler;
    const double h = fine ? 5e-5 : 2e-3;
    const int steps = fine ? 2000 : 50;
    const auto run = [&] {
      for (int k = 0; k < steps; ++k)
        ASSERT_TRUE(stepper.step(rod.state, rod.inputs, h).ok);
    };
    run();
    // take hold of the middle as it is: at that instant nothing moves, and then the section stays
    const Matrix3Xd before = rod.state.x;
    const int grasp = rod.hold(10, 11);
    rod.state.forgetHistory();
    EXPECT_EQ(rod.state.x, before);
    run();
    EXPECT_LT((rod.state.x.col(10) - before.col(10)).norm() + (rod.state.x.col(11) - before.col(11)).norm(), 1e-13);
    EXPECT_GT(stepper.wrenches()[grasp].force.norm(), 0.05 * rod.weight());
    // let everything go: the centre falls freely (with its mass damping)
    for (GraspState& g : rod.state.grasps)
      g.active = false;
    rod.state.forgetHistory();
    const double mass = rod.model->totalMass(), v0 = rod.momentum().z() / mass, t = steps * h;
    run();
    const double expected = -9.81 + (v0 + 9.81) * std::exp(-t);   // v' = g - v
    // first order: h / 2 of the damped part
    EXPECT_NEAR(rod.momentum().z() / mass, expected, 2 * h) << toString(integrator);
    EXPECT_EQ(stepper.wrenches()[0].force.norm() + stepper.wrenches()[grasp].force.norm(), 0.0);
  }
}

/// A column of length 1 between clamps, pushed together by `shortening`: axial force at a grasp and largest deflection.
std::pair<double, double> column(int n, double bend, double stretch, double shortening)
{
  Rod rod = straightRod(n, 1.0, modulusSection(bend, 0.8 * bend, stretch, 1.0));
  rod.hold(0, 0);
  rod.hold(n - 1, n - 1);
  rod.inputs.grasps[1].X_WG.position.x() -= shortening;
  RodStepper stepper(rod.model, TimeConfig{});
  settle(rod, stepper);
  return {-stepper.wrenches()[0].force.x(), rod.state.x.bottomRows(2).colwise().norm().maxCoeff()};
}

TEST(Column, BucklesAtEulersLoad)
{
  // clamped at both ends: P = 4 pi^2 B / L^2 [Euler]. Stretch stiff enough that the column shortens by 1e-3 before it
  // buckles.
  const double bend = 1.0, critical = 4 * M_PI * M_PI * bend, stretch = critical / 1e-3;
  const int n = 41;
  const auto [below, straight] = column(n, bend, stretch, 0.97e-3);
  EXPECT_LT(straight, 1e-6);
  EXPECT_NEAR(below, 0.97 * critical, 1e-6 * critical);
  // just beyond, it deflects at the critical load: slightly changed by the discrete model (4 pi^2 / 12 h^2) and by
  // compression (1e-3)
  for (double shortening : {1.01e-3, 1.1e-3, 2e-3, 1e-2})
  {
    const auto [load, deflection] = column(n, bend, stretch, shortening);
    EXPECT_GT(deflection, 1e-3);
    // the elastica stiffens by half the shortening
    EXPECT_NEAR(load / critical, 1.0, 4 * M_PI * M_PI / 12 / ((n - 1) * (n - 1)) + 1e-3 + 0.5 * shortening)
        << shortening;
    // y = A/2 (1 - cos 2 pi x): shortening by bending pi^2 A^2 / 4, with A the largest deflection
    const double bent = shortening - load / stretch;
    ASSERT_GT(bent, 0);
    // at 1 % beyond, the load's own error counts double
    EXPECT_NEAR(deflection, 2 / M_PI * std::sqrt(bent), 0.02 * deflection) << shortening;
  }
}

}   // namespace
}   // namespace slender::test
