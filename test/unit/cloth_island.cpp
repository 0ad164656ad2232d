// Cloth in an island with what it touches, by the barrier of contact alone.
#include "test/support/cloth_island.h"

#include <gtest/gtest.h>

#include "test/support/cloths.h"
#include "test/support/rods.h"

namespace slender::test {
namespace {

constexpr double kIslandThickness = 2e-3;

/// Steps that succeed and keep the thickness, by the independent check.
void expectSound(ClothIsland& island, int steps)
{
  for (int k = 0; k < steps; ++k)
  {
    const StepReport report = island.step();
    ASSERT_TRUE(report.ok) << "step " << k << ": " << report.message;
    ASSERT_GT(island.clearance(), 0.0) << "step " << k;
  }
}

TEST(ClothIsland, DrapesOverASphereAndFoldsOnTheFloor)
{
  ClothIsland island(kIslandStep, kIslandGap);
  const auto model = cotton(0.5, 8);
  island.addCloth(model, centred(*model, {0, 0, 0}), kIslandThickness);
  island.addSolid(Sphere{0.1}, {{0.013, 0.007, -0.11}, Eigen::Quaterniond::Identity()});
  island.addSolid(Plane{}, {{0, 0, -0.2}, Eigen::Quaterniond::Identity()});
  expectSound(island, 60);
  EXPECT_GT(island.contact().terms().size(), 20u);
  EXPECT_LT(island.cloths[0].state.x.row(2).minCoeff(), -0.15);
  EXPECT_GT(island.cloths[0].state.x.row(2).maxCoeff(), -0.01);   // it lies on the sphere
}

/// In steps of 10 ms the ball moves 20 times its size.
TEST(ClothIsland, StopsASmallFastBallBetweenItsVertices)
{
  ClothIsland island(0.01, kIslandGap);
  const auto model = cotton(0.5, 5);
  island.addCloth(model, centred(*model, {0, 0, 0}), kIslandThickness, {0, 5, 30, 35});
  RigidBodyModel ball;
  ball.name = "ball";
  ball.mass = 1e-3;
  ball.inertia = 0.4 * ball.mass * 0.005 * 0.005 * Eigen::Matrix3d::Identity();
  island.addBody(ball, Sphere{0.005}, {{0.03, -0.04, 0.05}, Eigen::Quaterniond::Identity()});
  island.bodies[0].state.velocity.linear = {0, 0, -20};
  expectSound(island, 10);
  // The sheet is below it.
  EXPECT_GT(island.bodies[0].state.X_WB.position.z(), island.cloths[0].state.x.row(2).minCoeff());
  EXPECT_LT(island.bodies[0].state.velocity.linear.norm(), 15.0);
}

/// What one loses the other gains, up to Newton's tolerance.
TEST(ClothIsland, ExchangesMomentumWithBodiesAndRods)
{
  ClothIsland island(kIslandStep, kIslandGap);
  island.gravity.setZero();
  const auto model = cotton(0.3, 5);
  island.addCloth(model, centred(*model, {0, 0, 0}), kIslandThickness);
  RigidBodyModel box;
  box.name = "box";
  box.mass = 0.02;
  box.inertia = 1e-5 * Eigen::Matrix3d::Identity();
  island.addBody(box, Box{{0.05, 0.04, 0.03}},
                 {{0.05, 0.02, 0.03}, Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Vector3d(1, 2, 0).normalized()))});
  island.bodies[0].state.velocity.linear = {0.1, 0, -2};
  const Matrix3Xd nodes = straightNodes(8, 0.2, {-0.13, -0.06, -0.012});
  const auto rod = std::make_shared<RodModel>(openRod(nodes, roundSection(4e-3, 1e6, 1000.0)));
  RodState state = makeRodState(*rod, nodes, Vector3d::Zero());
  state.v.row(2).setConstant(1.5);
  island.addRod(rod, state);
  const auto momentum = [&] {
    Vector3d sum = box.mass * island.bodies[0].state.velocity.linear;
    for (Eigen::Index i = 0; i < model->mass.size(); ++i)
      sum += model->mass[i] * island.cloths[0].state.v.col(i);
    for (Eigen::Index i = 0; i < rod->mass.size(); ++i)
      sum += rod->mass[i] * island.rods[0].state.v.col(i);
    return sum;
  };
  const Vector3d before = momentum();
  const Vector3d of_body = box.mass * island.bodies[0].state.velocity.linear;
  expectSound(island, 12);
  const double exchanged = (box.mass * island.bodies[0].state.velocity.linear - of_body).norm();
  EXPECT_GT(exchanged, 0.01);
  EXPECT_LT((momentum() - before).norm(), 1e-4 * exchanged);
}

TEST(ClothIsland, LayersKeepTheirThickness)
{
  ClothIsland island(kIslandStep, kIslandGap);
  const auto model = cotton(0.3, 6);
  for (int k = 0; k < 3; ++k)
    island.addCloth(model, centred(*model, {0.02 * k, 0.011 * k, 0.004 * k}), kIslandThickness);
  island.addSolid(Plane{}, {{0, 0, -0.01}, Eigen::Quaterniond::Identity()});
  expectSound(island, 40);
  for (int k = 1; k < 3; ++k)
    EXPECT_GT(island.cloths[k].state.x.row(2).mean(),
              island.cloths[k - 1].state.x.row(2).mean() + 0.9 * kIslandThickness);
}

/// Vertices that are let go touch what they passed through while they were held.
TEST(ClothIsland, KnowsWhatIsHeld)
{
  ClothIsland island(kIslandStep, kIslandGap);
  const auto model = cotton(0.3, 4);
  ClothIsland::Cloth& cloth = island.addCloth(model, centred(*model, {0, 0, 0.05}), kIslandThickness, {0, 4});
  island.addSolid(Plane{}, {{0, 0, -0.3}, Eigen::Quaterniond::Identity()});
  expectSound(island, 10);
  cloth.state.pins.clear();
  cloth.inputs.pins.resize(3, 0);
  expectSound(island, 60);
  EXPECT_LT(cloth.state.x.row(2).maxCoeff(), 0.0);
  EXPECT_GT(cloth.state.x.row(2).minCoeff(), -0.3);
}

}   // namespace
}   // namespace slender::test
