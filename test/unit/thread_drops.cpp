// Free pieces of thin fluids: surface tension draws them into drops.
#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/thread/thread_surface.h"
#include "test/support/threads.h"

namespace slender::test {
namespace {

using Eigen::Vector3d;

/// A straight piece with the given radii [m] and lengths [m] of its edges, at rest, without gravity.
Thread piece(const std::vector<double>& radii, const std::vector<double>& lengths, double viscosity)
{
  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, radii.size() + 1);
  for (std::size_t j = 0; j < lengths.size(); ++j)
    x.col(j + 1) = x.col(j) + lengths[j] * Vector3d(0.6, 0.8, 0.0);
  ThreadModel m = honey();
  m.nozzle_diameter = 0.0;
  m.density = 1000;
  m.viscosity = viscosity;
  m.surface_tension = 0.07;
  Thread t{m, makeThread(x, Eigen::Map<const Eigen::VectorXd>(radii.data(), radii.size())), {}};
  t.inputs.gravity.setZero();
  return t;
}

/// Of the motion and of the surface [J]. A straight piece does not spin.
double threadEnergy(const Thread& t)
{
  double energy = t.model.surface_tension * surfaceArea(t.state);
  for (int j = 0; j < t.state.edges(); ++j)
    for (const int i : {j, j + 1})
      energy += 0.25 * t.model.density * t.state.volume[j] * t.state.v[i].squaredNorm();
  return energy;
}

TEST(ThreadDrops, TheAreaIsThatOfTheEndsAndCaps)
{
  const double r = 1e-3;
  Thread t = piece({r, r, r}, {2e-3, 1e-3, 3e-3}, 1.0);
  const double side = 2 * M_PI * r * 6e-3, cap = M_PI * r * r;
  EXPECT_NEAR(surfaceArea(t.state), side + 2 * cap, 1e-12 * side);
  EXPECT_NEAR(surfaceArea(t.state, SurfaceShape::cylinder), side, 1e-12 * side);
  t.state.ends[1].held = true;
  EXPECT_NEAR(surfaceArea(t.state), side + cap, 1e-12 * side);
}

/// A disc, a rod and what is a drop already. Without caps all of them became discs of no length.
TEST(ThreadDrops, AnEdgeBecomesADropAndStays)
{
  const double r = 5e-4, volume = M_PI * r * r * 2 * r;
  for (const double length : {0.1 * r, 2 * r, 30 * r})
  {
    Thread t = piece({std::sqrt(volume / (M_PI * length))}, {length}, 0.1);
    ThreadStepper stepper = t.stepper();
    double energy = threadEnergy(t);
    for (int k = 0; k < 600; ++k)
    {
      const StepReport report = stepper.step(t.state, t.inputs, 2e-4);
      ASSERT_TRUE(report.ok) << length << " step " << k << ": " << report.message;
      const double now = threadEnergy(t);
      EXPECT_LE(now, energy * (1 + 1e-9)) << length << " step " << k;   // the tolerance is that of Newton's method
      energy = now;
    }
    EXPECT_NEAR(t.state.edge(0).norm(), 2 * r, 1e-5 * r) << length;
    EXPECT_NEAR(t.state.radius(0), r, 1e-5 * r) << length;
    EXPECT_LT(t.state.v[0].norm() + t.state.v[1].norm(), 1e-6);
  }
}

/// Water in which thick and thin edges alternate, and a piece whose ends are discs.
TEST(ThreadDrops, TheEnergyOfFreePiecesDoesNotGrow)
{
  const double r = 5e-4;
  const struct
  {
    std::vector<double> radii, lengths;
  } cases[] = {{{r, 1.5 * r, r, 0.7 * r, r}, {2 * r, 2 * r, 3 * r, 2 * r, r}},
               {{3 * r, r, r, 3 * r}, {0.1 * r, 2 * r, 2 * r, 0.1 * r}},
               {std::vector<double>(10, r), std::vector<double>(10, r)}};
  for (const auto& c : cases)
    for (const double step : {1e-5, 1e-4})
    {
      Thread t = piece(c.radii, c.lengths, 1e-3);
      ThreadStepper stepper = t.stepper();
      double energy = threadEnergy(t);
      for (int k = 0; k < 400; ++k)
      {
        const StepReport report = stepper.step(t.state, t.inputs, step);
        ASSERT_TRUE(report.ok) << "step " << k << ": " << report.message;
        const double now = threadEnergy(t);
        EXPECT_LE(now, energy * (1 + 1e-9)) << c.radii.size() << " edges, step " << step << ", " << k;
        energy = now;
      }
      EXPECT_LT((momentumOf(t.state)).norm(), 1e-9 * t.state.totalVolume());
    }
}

/// The end on the floor is an end like the other: without a cap it spread into a disc.
TEST(ThreadDrops, ADropOnTheFloorStaysADrop)
{
  const double r = 5e-4;
  Thread t = piece({r, r}, {r, r}, 0.1);
  t.model.floor.present = true;
  t.state = makeThread((Eigen::Matrix3Xd(3, 3) << 0, 0, 0, 0, 0, 0, r, 2 * r, 3 * r).finished(),
                       Eigen::VectorXd::Constant(2, r));
  t.state.deposited[0] = 1;
  ThreadStepper stepper = t.stepper();
  for (int k = 0; k < 500; ++k)
  {
    const StepReport report = stepper.step(t.state, t.inputs, 2e-4);
    ASSERT_TRUE(report.ok) << "step " << k << ": " << report.message;
  }
  EXPECT_NEAR((t.state.x[2] - t.state.x[0]).norm(), 2 * r, 0.2 * r);
}

/// A jet of water that is drawn out below its nozzle. Fluid comes without spin, so the angular momentum of the jet
/// stays what it was, up to what the viscous nozzle takes away. When fluid came with the spin of the edge at the
/// nozzle, the spin grew a thousandfold in a tenth of a second, and pours ended in puddles that flew about.
TEST(ThreadDrops, FluidLeavesTheNozzleWithoutSpin)
{
  ThreadModel m = honey();
  m.density = 1000;
  m.viscosity = 1e-3;
  m.limits.max_edge_length = 0.015;
  Thread t = Thread::fromNozzle(m, {0, 0, 1}, 0.1);
  t.state.spin[0] = 1.0;
  const auto momentum = [&] {
    double sum = 0.0;
    for (int j = 0; j < t.state.edges(); ++j)
      sum += t.state.volume[j] * t.state.radius(j) * t.state.radius(j) * t.state.spin[j];
    return sum;
  };
  const double start = momentum();
  ThreadStepper stepper = t.stepper();
  for (int k = 0; k < 100; ++k)
  {
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.002).ok) << k;
    EXPECT_LT(momentum(), start * (1 + 1e-9)) << k;
    EXPECT_GT(momentum(), 0.0) << k;
  }
  EXPECT_LT(t.state.spin.back(), 0.1);
}

/// The fluid in a nozzle that turns about its axis turns with it.
TEST(ThreadDrops, FluidLeavesATurningNozzleWithItsSpin)
{
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::symplectic_euler})
  {
    ThreadModel m = honey();
    m.viscosity = 1e-6;
    Thread t = Thread::fromNozzle(m, {0, 0, 1}, 0.1);
    t.inputs.gravity.setZero();
    ThreadStepper stepper(std::make_shared<ThreadModel>(m), NewtonConfig{}, integrator);
    const Eigen::Quaterniond start = t.inputs.ends[1].orientation;
    const double rate = 3.0;
    for (int k = 1; k <= 200; ++k)   // twenty times the edge at the nozzle
    {
      t.inputs.ends[1].orientation = Eigen::AngleAxisd(rate * k * 0.01, Vector3d::UnitZ()) * start;
      ASSERT_TRUE(stepper.step(t.state, t.inputs, 0.01).ok) << k;
    }
    // the edges run upwards into the nozzle, about whose axis z it turns
    EXPECT_NEAR(t.state.spin[t.state.edges() - 2], rate, 1e-2) << toString(integrator);
  }
}

/// A thread that stands in its own puddle and whose step fails.
TEST(ThreadDrops, AFailureInAPuddleSaysSo)
{
  const double r = 1e-3;
  Thread t = piece({5 * r, r, r, r}, {0.3 * r, 3 * r, 3 * r, 3 * r}, 1e-3);
  t.state = makeThread(
      (Eigen::Matrix3Xd(3, 5) << 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, r, 1.3 * r, 4.3 * r, 7.3 * r, 10.3 * r).finished(),
      Eigen::Vector4d(5 * r, r, r, r));
  t.state.deposited[0] = 1;
  t.state.thread_id = 4;
  NewtonConfig newton;
  newton.max_iterations = 1;
  newton.max_cuts = 0;
  for (const bool floor : {true, false})
  {
    t.model.floor.present = floor;
    t.state.deposited[0] = floor;
    ThreadStepper stepper(std::make_shared<ThreadModel>(t.model), newton);
    const StepReport report = stepper.step(t.state, t.inputs, 0.001);
    ASSERT_FALSE(report.ok);
    const auto says = [&](const char* text) { return report.message.find(text) != std::string::npos; };
    EXPECT_TRUE(says("piece 4")) << report.message;
    EXPECT_TRUE(says("Edge 0 beside it is a disc")) << report.message;
    EXPECT_EQ(says("in a puddle on the floor"), floor) << report.message;
    EXPECT_TRUE(says("edges.shortest")) << report.message;
    EXPECT_EQ(says("breakup_radius"), !floor) << report.message;
  }
}

}   // namespace
}   // namespace slender::test
