// Bending with a Poisson's ratio of its own: its energy, its matrix, and which meshes it is exact on.
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "slender_sim/energy/plate_bending.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

constexpr double kRatios[] = {-0.9, -1.0 / 3, 0.0, 0.35, 0.5, 0.9};

TriangleMesh latticeOf(GridPattern pattern, int cells)
{
  const double height = pattern == GridPattern::equilateral ? cells * std::sqrt(0.75) : cells;
  return gridMesh(cells, height, cells, cells, pattern);
}

/// E = 1/2 sum_T theta^T w theta with the angles of the mesh in space.
double energyOfAngles(const std::vector<PlateTriangle>& triangles, const MeshTopology& t, const Matrix3Xd& x)
{
  const VectorXd none = VectorXd::Zero(t.hingeCount());
  const HingeTerm hinges(t.hinges, none, none);
  VectorXd angles(hinges.paddedCount());
  hinges.angles(pointsOf(x).data(), angles.data());
  double energy = 0;
  for (const PlateTriangle& triangle : triangles)
    for (int i = 0; i < triangle.count; ++i)
      for (int j = 0; j < triangle.count; ++j)
        energy += 0.5 * triangle.form(i, j) * angles[triangle.hinges[i]] * angles[triangle.hinges[j]];
  return energy;
}

TEST(PlateBendingRatio, MatrixIsTheHessianOfTheEnergyOfAngles)
{
  Random random(71);
  for (const GridPattern pattern : {GridPattern::equilateral, GridPattern::one_diagonal, GridPattern::irregular})
    for (const double nu : {-0.3, 0.35})
    {
      const TriangleMesh mesh = gridMesh(3, 3, 3, 3, pattern);
      const MeshTopology t = meshTopology(mesh);
      const auto triangles = plateTriangles(mesh, t, nu, 0.8);
      const MatrixXd K = plateBending(mesh, t, nu, 0.8).toEigen();
      // second differences along random normal displacements: the energy is a quadratic form of them to fourth order in
      // their size
      for (int k = 0; k < 5; ++k)
      {
        const VectorXd w = random.numbers(static_cast<int>(mesh.vertices.cols()), 1.0);
        const double h = 1e-4;
        Matrix3Xd up = mesh.vertices;
        up.row(2) += h * w.transpose();
        const double expected = 0.5 * w.dot(K * w), energy = energyOfAngles(triangles, t, up) / (h * h);
        ASSERT_GT(expected, 1e-3);
        // the angles' own cubic terms are of order h^2 = 1e-8
        EXPECT_NEAR(energy / expected, 1.0, 1e-6) << toString(pattern) << " " << nu;
      }
    }
}

TEST(PlateBendingRatio, IsSemidefiniteAndLeavesAffineMapsAloneButNothingElse)
{
  for (const GridPattern pattern :
       {GridPattern::equilateral, GridPattern::one_diagonal, GridPattern::alternating, GridPattern::irregular})
    for (const double nu : kRatios)
    {
      const TriangleMesh mesh = gridMesh(1.0, 1.2, 6, 0, pattern);
      const MatrixXd K = plateBending(mesh, meshTopology(mesh), nu, 2.0).toEigen();
      const double size = K.norm();
      EXPECT_EQ(K, K.transpose());
      EXPECT_LT((K * VectorXd::Ones(K.rows())).norm(), 1e-12 * size);
      EXPECT_LT((K * mesh.vertices.transpose()).norm(), 1e-12 * size);
      const VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<MatrixXd>(K).eigenvalues();
      EXPECT_GT(eigenvalues[0], -1e-12 * size);
      EXPECT_LT(std::abs(eigenvalues[2]), 1e-12 * size);
      EXPECT_GT(eigenvalues[3], 1e-6 * size) << toString(pattern) << " " << nu;
    }
}

/// In triangles without a vertex on the boundary (equilateral grids end in halves of triangles), of the surface z = (a
/// x^2 + 2 b x y + c y^2) / 2.
TEST(PlateBendingRatio, EnergyOfQuadraticSurfacesIsExactOnLattices)
{
  for (const GridPattern pattern : {GridPattern::equilateral, GridPattern::one_diagonal})
    for (const double nu : kRatios)
      for (const Vector3d& q : {Vector3d(1, 0, 0), Vector3d(0, 0, 1), Vector3d(0, 1, 0), Vector3d(0.7, -0.4, 1.2)})
      {
        const TriangleMesh mesh = latticeOf(pattern, 12);
        const MeshTopology t = meshTopology(mesh);
        const VectorXd z = 0.5 * (q[0] * mesh.vertices.row(0).array().square() +
                                  2 * q[1] * mesh.vertices.row(0).array() * mesh.vertices.row(1).array() +
                                  q[2] * mesh.vertices.row(1).array().square())
                                     .matrix()
                                     .transpose();
        const double expected = 0.5 * (std::pow(q[0] + q[2], 2) - 2 * (1 - nu) * (q[0] * q[2] - q[1] * q[1]));
        double energy = 0, area = 0;
        for (const PlateTriangle& triangle : plateTriangles(mesh, t, nu, 1.0))
        {
          Vector3d angle;
          bool inner = triangle.count == 3;
          for (int k = 0; k < 3 && inner; ++k)
          {
            const HingeRow row = hingeRow(mesh, t, triangle.hinges[k]);
            inner = !t.on_boundary[row.vertices[0]] && !t.on_boundary[row.vertices[1]];   // the edges have all corners
            angle[k] = 0;
            for (int a = 0; a < 4; ++a)
              angle[k] += row.weights[a] * z[row.vertices[a]];
            angle[k] /= (mesh.vertices.col(row.vertices[1]) - mesh.vertices.col(row.vertices[0])).norm();
          }
          if (!inner)
            continue;
          energy += 0.5 * angle.dot(triangle.form * angle);
          area += pattern == GridPattern::equilateral ? std::sqrt(0.1875) : 0.5;
        }
        ASSERT_GT(area, 50.0);
        // round-off of heights up to 100
        EXPECT_NEAR(energy / area, expected, 1e-10) << toString(pattern) << " " << nu;
      }
}

TEST(PlateBendingRatio, KnowsTheMeshesItIsExactOn)
{
  for (const double nu : kRatios)
  {
    for (const GridPattern pattern : {GridPattern::equilateral, GridPattern::one_diagonal})
    {
      TriangleMesh mesh = latticeOf(pattern, 8);
      mesh.vertices = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix() * mesh.vertices;
      EXPECT_NEAR(plateStiffening(mesh, meshTopology(mesh), nu), 1.0, 1e-10) << toString(pattern) << " " << nu;
    }
    for (const GridPattern pattern : {GridPattern::irregular, GridPattern::alternating})
    {
      const TriangleMesh mesh = gridMesh(1, 1, 12, 0, pattern);
      EXPECT_GT(plateStiffening(mesh, meshTopology(mesh), nu), 1.03) << toString(pattern) << " " << nu;
    }
  }
}

TEST(PlateBendingRatio, RefusesRatiosOutOfRange)
{
  const TriangleMesh mesh = latticeOf(GridPattern::equilateral, 2);
  for (const double bad : {-1.0, 1.0, 2.0, std::nan("")})
    EXPECT_THROW(plateBending(mesh, meshTopology(mesh), bad, 1.0), std::invalid_argument) << bad;
}

}   // namespace
}   // namespace slender::test
