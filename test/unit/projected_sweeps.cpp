// Equations with averages that are prescribed: projections, sweeps between them, and constraints that are soft.
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <gtest/gtest.h>

#include "linalg/projected_sweeps.h"
#include "slender_sim/linalg/constrained_cholesky.h"
#include "slender_sim/tracking/weak_constraints.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

/// A sheet with averages by the hats of a coarser mesh, which is subdivided: blocks A, a matrix B that acts on each
/// coordinate alike, and held corners.
struct AveragedSheet
{
  AveragedSheet(int cells, int levels, bool pinned = false)
    : coarse(gridMesh(1.0, 1.0, cells, cells, GridPattern::alternating)),
      fine(subdivide(coarse, levels)),
      n(static_cast<int>(fine.mesh.vertices.cols())),
      constraints(subdivisionBasis(fine), hatMassMatrix(coarse), hatMassMatrix(fine.mesh)),
      held(n, 0),
      mass(n)
  {
    pin(pinned);
    Random random(6);
    std::vector<Eigen::Triplet<double>> entries;
    std::vector<int> starts{0}, rows;
    const Eigen::MatrixXi& edges = meshTopology(fine.mesh).edges;
    std::vector<std::vector<int>> below(n);
    for (Eigen::Index e = 0; e < edges.cols(); ++e)
      below[edges.col(e).minCoeff()].push_back(edges.col(e).maxCoeff());
    for (int j = 0; j < n; ++j)
    {
      rows.push_back(j);
      std::sort(below[j].begin(), below[j].end());
      rows.insert(rows.end(), below[j].begin(), below[j].end());
      starts.push_back(static_cast<int>(rows.size()));
    }
    a = BlockMatrix(starts, rows);
    a.setZero();
    for (int j = 0; j < n; ++j)
    {
      mass[j] = 1e-3 * (1.0 + 0.3 * random.vector()[0]);
      entries.emplace_back(j, j, mass[j]);
    }
    for (Eigen::Index e = 0; e < edges.cols(); ++e)   // springs, with a part that has no direction
    {
      const int i = edges(0, e), j = edges(1, e);
      const Vector3d along = random.vector().normalized();
      const Eigen::Matrix3d k = along * along.transpose();
      addBlock(i, i, k);
      addBlock(j, j, k);
      addBlock(i, j, -k);
      for (const auto& [r, c, sign] : {std::tuple(i, i, 1.0), {j, j, 1.0}, {i, j, -1.0}, {j, i, -1.0}})
        entries.emplace_back(r, c, 0.1 * sign);
    }
    b = PointMatrix(n, entries);
  }
  void pin(bool pinned) { held[2] = held[n - 1] = pinned; }
  void addBlock(int i, int j, const Eigen::Matrix3d& k)
  {
    Eigen::Map<Eigen::Matrix3d>(a.values() + 9 * static_cast<std::size_t>(a.block(std::max(i, j), std::min(i, j)))) +=
        k;
  }
  /// [A + factor B, C^T; C, 0] with the identity at held points.
  Eigen::SparseMatrix<double> saddle(double factor) const
  {
    const int m = constraints.count();
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](int i, int j, double value, bool free) {
      if (free)
        entries.emplace_back(i, j, value);
    };
    for (int j = 0; j < n; ++j)
      for (int k = a.starts()[j]; k < a.starts()[j + 1]; ++k)
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c)
          {
            const int i = a.rows()[k];
            const double value = a.values()[9 * static_cast<std::size_t>(k) + 3 * c + r];
            add(3 * i + r, 3 * j + c, value, !held[i] && !held[j]);
            add(3 * j + c, 3 * i + r, value, i != j && !held[i] && !held[j]);
          }
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c)
      {
        add(3 * i + c, 3 * i + c, 1.0, held[i]);
        for (int k = b.starts()[i]; k < b.starts()[i + 1]; ++k)
          add(3 * i + c, 3 * b.column(k) + c, factor * b.values()[k], !held[i] && !held[b.column(k)]);
      }
    for (int i = 0; i < m; ++i)
      for (AverageProjection::Averages::InnerIterator entry(constraints.matrix(), i); entry; ++entry)
        for (int c = 0; c < 3; ++c)
        {
          const int point = static_cast<int>(entry.col());
          add(3 * (n + i) + c, 3 * point + c, entry.value(), !held[point]);
          add(3 * point + c, 3 * (n + i) + c, entry.value(), !held[point]);
        }
    Eigen::SparseMatrix<double> matrix(3 * (n + m), 3 * (n + m));
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  }
  PointVector load() const
  {
    Random random(8);
    PointVector r(4 * static_cast<std::size_t>(n), 0.0);
    for (int i = 0; i < n; ++i)
      if (!held[i])
        point(r, i) = random.vector() + Vector3d(0.0, 0.0, 1.0);
    return r;
  }

  TriangleMesh coarse;
  Subdivision fine;
  int n;
  WeakConstraints constraints;
  std::vector<char> held;
  VectorXd mass;
  BlockMatrix a;
  PointMatrix b;
};

TEST(AverageProjection, MovesPointsByTheLeast)
{
  for (const bool pinned : {false, true})
  {
    const AveragedSheet sheet(4, 2, pinned);
    AverageProjection projection(sheet.constraints.matrix());
    ASSERT_TRUE(projection.prepare(sheet.mass, [&](int i) { return !sheet.held[i]; }));
    const int m = projection.count();
    MatrixXd c(sheet.constraints.matrix());
    for (int i = 0; i < sheet.n; ++i)
      c.col(i) *= sheet.held[i] ? 0.0 : 1.0;
    const MatrixXd give = sheet.mass.cwiseInverse().asDiagonal() * c.transpose();
    Random random(3);
    Matrix3Xd changes(3, m);
    for (int i = 0; i < m; ++i)
      changes.col(i) = random.vector();
    const MatrixXd expected = give * (c * give).ldlt().solve(changes.transpose());
    EXPECT_LT((matrixOf(projection.displacements(changes)).transpose() - expected).norm(), 1e-11 * expected.norm());
    // the forces of averages leave no acceleration of the averages
    PointVector forces = sheet.load(), mu(4 * static_cast<std::size_t>(m), 0.0);
    projection.multipliers(forces, mu);
    projection.addForces(-1.0, mu, forces);
    EXPECT_LT((give.transpose() * matrixOf(forces).transpose()).norm(),
              1e-10 * (give.transpose() * matrixOf(sheet.load()).transpose()).norm());
    // An average that is left out has no force, and all others are exact.
    mu.assign(mu.size(), 1.0);
    projection.leaveOut({1, 4});
    projection.solve(mu);
    EXPECT_EQ(point(mu, 1).norm() + point(mu, 4).norm(), 0.0);
    VectorXd reached = c * give * matrixOf(mu).transpose().col(0);
    reached[1] = reached[4] = 1.0;
    EXPECT_LT((reached - VectorXd::Ones(m)).norm(), 1e-10);
  }
  AverageProjection::Averages twice(2, 9);
  twice.insert(0, 4) = twice.insert(1, 4) = 1.0;
  AverageProjection dependent(twice);
  EXPECT_FALSE(dependent.prepare(VectorXd::Ones(9), [](int) { return true; }));
  AverageProjection::Averages apart(2, 9);
  apart.insert(0, 3) = apart.insert(1, 4) = 1.0;
  AverageProjection held(apart);
  EXPECT_TRUE(held.prepare(VectorXd::Ones(9), [](int) { return true; }));
  EXPECT_FALSE(held.prepare(VectorXd::Ones(9), [](int i) { return i != 4; }));
}

/// Solves with the sheet's matrix as it is, and compares with a factorisation.
void expectSolution(AveragedSheet& sheet, AverageProjection& projection, ProjectedSweeps& sweeps, double tolerance,
                    int most_iterations, double most_error)
{
  const auto isFree = [&](int i) { return !sheet.held[i]; };
  ASSERT_TRUE(projection.prepare(sheet.mass, isFree));
  sweeps.setAverages(projection);
  ASSERT_TRUE(sweeps.set(1.3, sheet.held));
  PointVector x(4 * static_cast<std::size_t>(sheet.n), 0.0);
  const PointVector r = sheet.load();
  EXPECT_GT(sweeps.norm(r), 0.0);
  const LinearResult result = sweeps.solve(r, x, tolerance, 2000, 0.0);
  EXPECT_TRUE(result.definite);
  EXPECT_LE(result.residual, tolerance);
  EXPECT_LT(result.iterations, most_iterations);
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(sheet.saddle(1.3));
  VectorXd right = VectorXd::Zero(3 * (sheet.n + projection.count()));
  for (int i = 0; i < sheet.n; ++i)
    right.segment<3>(3 * i) = point(r, i);
  const VectorXd solution = lu.solve(right), expected = solution.head(3 * sheet.n);
  const MatrixXd found = matrixOf(x);
  EXPECT_LT((found.reshaped() - expected).norm(), most_error * expected.norm());
  // rounding errors of sums over as many points
  EXPECT_LT((sheet.constraints.matrix() * found.transpose()).cwiseAbs().maxCoeff(),
            1e-13 * found.cwiseAbs().maxCoeff() * sheet.n);
}

TEST(ProjectedSweeps, SolveTheSaddlePointSystem)
{
  // The first sheet has many averages, the second so few that groups of points move as a whole.
  for (const auto& [cells, levels] : {std::pair(12, 1), std::pair(1, 4)})
  {
    AveragedSheet sheet(cells, levels);
    AverageProjection projection(sheet.constraints.matrix());
    ProjectedSweeps sweeps;
    sweeps.setPattern(sheet.a, &sheet.b);
    for (const bool pinned : {false, true})
      for (const double tolerance : {1e-4, 1e-11})   // in single and in double precision
      {
        sheet.pin(pinned);
        // norms that differ by the root of the condition number
        expectSolution(sheet, projection, sweeps, tolerance, tolerance < 1e-9 ? 200 : 100, 100 * tolerance);
      }
  }
}

TEST(ProjectedSweeps, SolveStiffSystems)
{
  // numbers of single precision do not tell what is soft from what is nothing
  AveragedSheet sheet(4, 2);
  for (int j = 0; j < sheet.n; ++j)
    sheet.addBlock(j, j,
                   1e9 * Vector3d(1.0, 2.0, -1.0).normalized() * Vector3d(1.0, 2.0, -1.0).normalized().transpose());
  AverageProjection projection(sheet.constraints.matrix());
  ProjectedSweeps sweeps;
  sweeps.setPattern(sheet.a, &sheet.b);
  for (const double tolerance : {5e-3, 1e-5, 1e-7})   // rounding errors leave 2e-8
    expectSolution(sheet, projection, sweeps, tolerance, 300, 100 * tolerance);
}

TEST(ProjectedSweeps, MeasureTheToleranceByTheLoad)
{
  AveragedSheet sheet(8, 1);
  AverageProjection projection(sheet.constraints.matrix());
  ASSERT_TRUE(projection.prepare(sheet.mass, [&](int) { return true; }));
  ProjectedSweeps sweeps;
  sweeps.setPattern(sheet.a, &sheet.b);
  sweeps.setAverages(projection);
  ASSERT_TRUE(sweeps.set(1.0, sheet.held));
  const PointVector r = sheet.load();
  PointVector x(4 * static_cast<std::size_t>(sheet.n), 0.0);
  const double start = sweeps.solve(r, x, 1e-4, 2000, 0.0).scale;
  EXPECT_NEAR(sweeps.solve(r, x, 1e-4, 2000, 7.0 * start).scale, 3.0 * 7.0 * start, 1e-5 * start);
  // a fifth of what is left at the start
  const LinearResult most = sweeps.solve(r, x, 1e-4, 2000, 1e9 * start);
  EXPECT_NEAR(most.scale, 2e3 * start, 1e-3 * start);
  EXPECT_GT(most.iterations, 0);
  // nothing, and no number
  const PointVector none(r.size(), 0.0);
  EXPECT_EQ(sweeps.norm(none), 0.0);
  EXPECT_EQ(sweeps.solve(none, x, 1e-4, 2000, 0.0).iterations, 0);
  EXPECT_EQ(x, none);
  for (const std::size_t at : {0, 5, 10})
  {
    PointVector wrong = r;
    wrong[at] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(sweeps.norm(wrong) >= 0.0);
    EXPECT_FALSE(sweeps.solve(wrong, x, 1e-4, 2000, 0.0).definite);
  }
  // an average that is left out moves freely
  projection.leaveOut({3});
  EXPECT_LT(sweeps.solve(r, x, 1e-10, 2000, 0.0).residual, 1e-10);
  VectorXd averages = (sheet.constraints.matrix() * matrixOf(x).transpose()).rowwise().norm();
  EXPECT_GT(averages[3], 1e-4);
  averages[3] = 0.0;
  EXPECT_LT(averages.maxCoeff(), 1e-12);
}

TEST(ProjectedSweeps, TakeAsManyIterationsOnFineMeshes)
{
  int fewest = 1000, most = 0;
  for (const int cells : {8, 16, 32})
  {
    const AveragedSheet sheet(cells, 2, true);
    AverageProjection projection(sheet.constraints.matrix());
    ASSERT_TRUE(projection.prepare(sheet.mass, [&](int i) { return !sheet.held[i]; }));
    ProjectedSweeps sweeps;
    sweeps.setPattern(sheet.a, &sheet.b);
    sweeps.setAverages(projection);
    ASSERT_TRUE(sweeps.set(1.0, sheet.held));
    PointVector x(4 * static_cast<std::size_t>(sheet.n), 0.0);
    const int iterations = sweeps.solve(sheet.load(), x, 1e-5, 2000, 0.0).iterations;
    fewest = std::min(fewest, iterations);
    most = std::max(most, iterations);
  }
  EXPECT_LE(most, fewest + fewest / 4 + 1);
}

TEST(ProjectedSweeps, SeeMatricesThatAreNotDefinite)
{
  AveragedSheet sheet(6, 2, true);
  sheet.addBlock(sheet.a.rows()[sheet.a.starts()[40] + 1], 40, 8.0 * Eigen::Matrix3d::Identity());
  AverageProjection projection(sheet.constraints.matrix());
  ASSERT_TRUE(projection.prepare(sheet.mass, [&](int i) { return !sheet.held[i]; }));
  ProjectedSweeps sweeps;
  sweeps.setPattern(sheet.a, &sheet.b);
  sweeps.setAverages(projection);
  ASSERT_TRUE(sweeps.set(1.0, sheet.held));   // The blocks of the diagonal are positive definite.
  PointVector x(4 * static_cast<std::size_t>(sheet.n), 0.0);
  for (const double tolerance : {1e-4, 1e-11})
    EXPECT_FALSE(sweeps.solve(sheet.load(), x, tolerance, 2000, 0.0).definite) << tolerance;
}

TEST(ConstrainedCholesky, SoftensConstraints)
{
  for (const bool pinned : {false, true})
  {
    const AveragedSheet sheet(4, 2, pinned);
    SparseCholesky factor;
    factor.setPattern(sheet.b);
    ASSERT_TRUE(factor.factor(sheet.b, sheet.held.data()));
    ConstrainedCholesky softened;
    softened.setConstraints(sheet.constraints.matrix());
    ASSERT_TRUE(softened.factor(factor, sheet.held.data()));
    const int m = softened.count();
    MatrixXd p(sheet.b.toEigen()), c(sheet.constraints.matrix());
    for (int i = 0; i < sheet.n; ++i)
      if (sheet.held[i])
      {
        p.row(i).setZero();
        p.col(i).setZero();
        c.col(i).setZero();
        p(i, i) = 1.0;
      }
    const VectorXd weights = VectorXd::LinSpaced(m, 0.1, 3.0);
    softened.soften(weights);
    const PointVector r = sheet.load();
    PointVector z = r;
    softened.solveSoftened(r.data(), z.data());
    const MatrixXd expected = (p + c.transpose() * weights.asDiagonal() * c).ldlt().solve(matrixOf(r).transpose());
    EXPECT_LT((matrixOf(z).transpose() - expected).norm(), 1e-9 * expected.norm()) << pinned;
    const MatrixXd stiffness = (c * p.ldlt().solve(c.transpose())).inverse();
    for (int i = 0; i < m; ++i)
      EXPECT_NEAR(softened.stiffness(i), stiffness(i, i), 1e-8 * stiffness(i, i));
  }
  ConstrainedCholesky::Constraints twice(2, 9);
  twice.insert(0, 4) = twice.insert(1, 4) = 1.0;
  std::vector<Eigen::Triplet<double>> ones;
  for (int i = 0; i < 9; ++i)
    ones.emplace_back(i, i, 1.0);
  const PointMatrix identity(9, ones);
  SparseCholesky factor;
  factor.setPattern(identity);
  ASSERT_TRUE(factor.factor(identity, nullptr));
  ConstrainedCholesky dependent;
  dependent.setConstraints(twice);
  EXPECT_FALSE(dependent.factor(factor, nullptr));
}

}   // namespace
}   // namespace slender::test
