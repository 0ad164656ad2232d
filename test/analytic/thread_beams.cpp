// Viscous beams under their weight: the elastic beam's deflections with velocities in place of displacements and 3 mu
// in place of E.
#include <cmath>

#include <gtest/gtest.h>

#include "test/support/threads.h"

namespace slender::test {
namespace {

constexpr double kMu = 1e5, kBeamGravity = 981, kRadius = 0.1;

/// Speed of a node after the inertia has died away and before the beam has sagged.
double sagSpeed(int edges, bool second_end, int node)
{
  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, edges + 1);
  x.row(0) = Eigen::RowVectorXd::LinSpaced(edges + 1, 0.0, 1.0);
  Thread t{honey(), makeThread(x, Eigen::VectorXd::Constant(edges, kRadius), Eigen::Vector3d::UnitY()), {}};
  t.model.density = 1.0;
  t.model.viscosity = kMu;
  t.model.nozzle_diameter = 0.0;   // No nozzle: its radius would limit that of the edges.
  t.inputs.gravity = {0, 0, -kBeamGravity};
  t.inputs.ends[0] = Pose{};
  // x into the thread, y along d1
  t.inputs.ends[1] = {{1, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY()))};
  t.state.ends[0] = {true, t.inputs.ends[0]};
  t.state.ends[1] = {second_end, t.inputs.ends[1]};
  ThreadStepper stepper = t.stepper();
  for (int k = 0; k < 8; ++k)
    EXPECT_TRUE(stepper.step(t.state, t.inputs, 5e-4).ok);
  return -t.state.v[node].z();
}

TEST(ThreadBeams, CantileverAndClampedBeamSagAtTheirSpeeds)
{
  const double tip = kBeamGravity / (6 * kMu * kRadius * kRadius);   // rho g A L^4 / (8 . 3 mu I)
  const double middle = tip * 8 / 384;
  EXPECT_NEAR(sagSpeed(40, false, 40), tip, 5e-3 * tip);
  EXPECT_NEAR(sagSpeed(40, true, 20), middle, 5e-3 * middle);
  // second order in the edge length: the clamps lie where the holders end
  const double coarse = sagSpeed(10, false, 10), fine = sagSpeed(20, false, 20), finest = sagSpeed(40, false, 40);
  EXPECT_NEAR((coarse - fine) / (fine - finest), 4.0, 0.4);
}

TEST(ThreadBeams, HoldersBearTheWeight)
{
  const int edges = 20;
  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, edges + 1);
  x.row(0) = Eigen::RowVectorXd::LinSpaced(edges + 1, 0.0, 1.0);
  Thread t{honey(), makeThread(x, Eigen::VectorXd::Constant(edges, kRadius), Eigen::Vector3d::UnitY()), {}};
  t.model.density = 1.0;
  t.model.viscosity = kMu;
  t.model.nozzle_diameter = 0.0;   // No nozzle: its radius would limit that of the edges.
  t.inputs.gravity = {0, 0, -kBeamGravity};
  t.state.ends[0].held = true;
  ThreadStepper stepper = t.stepper();
  for (int k = 0; k < 8; ++k)
    ASSERT_TRUE(stepper.step(t.state, t.inputs, 5e-4).ok);
  const double weight = M_PI * kRadius * kRadius * kBeamGravity;
  EXPECT_NEAR(stepper.endLoads()[0].force.z(), -weight, 5e-3 * weight);
  EXPECT_NEAR(stepper.endLoads()[0].torque.y(), 0.5 * weight, 5e-3 * weight);
  EXPECT_EQ(stepper.endLoads()[1].force.norm(), 0.0);
}

}   // namespace
}   // namespace slender::test
