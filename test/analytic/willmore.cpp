#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/fairing/willmore_flow.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

TEST(WillmoreEnergy, OfSpheresConvergesTo8Pi)
{
  double last = 0.0;
  for (const int levels : {2, 3, 4})
  {
    const TriangleMesh mesh = icosphere(3.0, levels);
    WillmoreEnergy energy(mesh.triangles, std::vector<char>(mesh.vertices.cols(), 1));
    const double error = energy.energy(pointsOf(mesh.vertices).data()) / (8 * M_PI) - 1;
    EXPECT_NEAR(last / error, levels == 2 ? 0.0 : 4.0, 0.2) << levels;   // second order in the edges, which halve
    last = error;
  }
  EXPECT_LT(std::abs(last), 0.002);
}

/// A sheet of right-angled triangles lies on the cylinder; 1/2 int H^2 = area / (2 R^2).
TEST(WillmoreEnergy, OfCylinders)
{
  TriangleMesh mesh = gridMesh(1.0, 1.0, 60, 60, GridPattern::one_diagonal);
  const double radius = 0.5;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
  {
    const double angle = mesh.vertices(0, v) / radius;
    mesh.vertices(0, v) = radius * std::sin(angle);
    mesh.vertices(2, v) = radius * (1 - std::cos(angle));
  }
  std::vector<char> counted = meshTopology(mesh).on_boundary;
  double area = 0.0;
  const VectorXd areas = vertexAreas(mesh);
  for (std::size_t v = 0; v < counted.size(); ++v)
  {
    counted[v] = !counted[v];
    area += counted[v] * areas[static_cast<Eigen::Index>(v)];
  }
  WillmoreEnergy energy(mesh.triangles, counted);
  const double expected = area / (2 * radius * radius);
  EXPECT_NEAR(energy.energy(pointsOf(mesh.vertices).data()), expected, 1e-3 * expected);   // (cell / R)^2 = 1.1e-3
}

/// Small waves on a plane: x' = -Laplacian^2 x, so an implicit Euler step divides those of wave number q by 1 + h q^4.
TEST(WillmoreFlow, StepDividesWavesByTheirWaveNumber)
{
  constexpr int kCells = 96;
  for (const double cells : {16.0, 32.0})   // per wave along each axis
    for (const double strength : {0.1, 1.0, 10.0})
    {
      TriangleMesh mesh = gridMesh(1.0, 1.0, kCells, kCells, GridPattern::one_diagonal);
      const double k = 2 * M_PI * kCells / cells, q = std::sqrt(2.0) * k, height = 1e-6;
      const auto wave = [&](Eigen::Index v) {
        return height * std::cos(k * (mesh.vertices(0, v) - 0.5)) * std::cos(k * (mesh.vertices(1, v) - 0.5));
      };
      for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
        mesh.vertices(2, v) = wave(v);
      WillmoreFlow flow(mesh, meshTopology(mesh), strength / std::pow(q, 4));
      ASSERT_TRUE(flow.step(mesh.vertices).ok);
      // in the middle, away from the held boundary
      double product = 0.0, square = 0.0;
      for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
        if ((mesh.vertices.col(v).head<2>() - Eigen::Vector2d(0.5, 0.5)).norm() < 0.15)
        {
          product += mesh.vertices(2, v) * wave(v);
          square += wave(v) * wave(v);
        }
      // the Laplacian of the grid is off by (k cell)^2 / 12, 1.3 % for 16 cells, and comes squared; lumping adds as
      // much
      EXPECT_NEAR(product / square * (1 + strength), 1.0,
                  0.05 * 256 / (cells * cells) * strength / (1 + strength) + 0.01)
          << cells << " cells, strength " << strength;
    }
}

/// Iterated steps are those of the implicit Euler method, of first order where h resolves the mesh's own motions within
/// the surface, whose times are about edge^4 = 5e-4 m^4.
TEST(WillmoreFlow, StepsConvergeWithTheTimeStep)
{
  TriangleMesh start = icosphere(1.0, 3);
  for (Eigen::Index v = 0; v < start.vertices.cols(); ++v)
    start.vertices(0, v) *= 1.3;
  const MeshTopology t = meshTopology(start);
  const auto after = [&](int steps) {
    Matrix3Xd x = start.vertices;
    WillmoreFlow flow(start, t, 2e-4 / steps, 50);
    for (int k = 0; k < steps; ++k)
    {
      const FairingReport report = flow.step(x);
      EXPECT_TRUE(report.ok) << report.message;
    }
    return x;
  };
  const Matrix3Xd one = after(4), two = after(8), four = after(16);
  // differences halve, up to second order and what the iterations leave
  EXPECT_NEAR((one - two).norm() / (two - four).norm(), 2.0, 0.3);
}

}   // namespace
}   // namespace slender::test
