// Factorisations of the matrices of points, against dense ones.
#include <Eigen/Cholesky>
#include <limits>

#include <gtest/gtest.h>

#include "island/point_sweeps.h"
#include "slender_sim/linalg/sparse_cholesky.h"
#include "linalg/symmetric_sweeps.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

struct System
{
  TriangleMesh mesh;
  MeshTopology topology = meshTopology(mesh);
  PointMatrix bending = isometricBending(mesh, topology, IsometricElement::nonconforming, 0.3);
  BlockMatrix blocks{static_cast<int>(mesh.vertices.cols()), {mesh.triangles, topology.hinges}};
  std::vector<char> fixed = std::vector<char>(mesh.vertices.cols(), 0);

  explicit System(int cells = 12, double bends = 1.0, double inertia = 0.5)
    : mesh(gridMesh(1.0, 1.0, cells, 0, GridPattern::irregular))
  {
    MembraneTerm membrane(mesh, orthotropicMembrane(3.0, 1.2, 0.4, 0.5));
    PointVector gradient(4 * points(), 0.0);
    Random random(23);
    Matrix3Xd x = mesh.vertices;
    for (int i = 0; i < points(); ++i)
      x.col(i) += random.vector(0.24 / cells);
    membrane.setPattern(blocks);
    membrane.addHessian(HessianKind::semidefinite, pointsOf(x).data(), gradient.data(), blocks.values());
    blocks.add(bends, bending, blocks.mapOf(bending));
    std::vector<Eigen::Triplet<double>> mass;
    for (int i = 0; i < points(); ++i)
      mass.emplace_back(i, i, inertia);
    const PointMatrix M(points(), mass);
    blocks.add(1.0, M, blocks.mapOf(M));
    fixed[0] = fixed[17] = 1;
  }
  int points() const { return static_cast<int>(mesh.vertices.cols()); }
};

/// The matrix of an island with a cloth and a body, in the order of its unknowns.
TEST(PointSweeps, SolveWhatDenseFactorsSolve)
{
  System s;
  const int cloth = 3 * s.points(), n = cloth + 6;
  MatrixXd A = MatrixXd::Zero(n, n);
  A.topLeftCorner(cloth, cloth) = denseOf(s.blocks);
  A.bottomRightCorner(6, 6).diagonal() << 4, 4, 4, 0.1, 0.2, 0.3;
  Random random(5);
  for (int contact = 0; contact < 20; ++contact)   // of a point and the body
  {
    const int point = 3 * ((7 * contact) % s.points());
    const Eigen::Vector3d normal = random.vector().normalized(), arm = random.vector(0.3);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(n);
    row.segment<3>(point) = normal;
    row.segment<3>(cloth) = -normal;
    row.tail<3>() = -arm.cross(normal);
    A += 3.0 * row * row.transpose();
  }
  const auto solve = [&](const MatrixXd& matrix, double tolerance, VectorXd& x) {
    std::vector<int> starts{0}, rows;
    std::vector<double> values;
    for (int j = 0; j < n; ++j)
    {
      for (int i = j; i < n; ++i)
        if (matrix(i, j) != 0.0 || i == j)
        {
          rows.push_back(i);
          values.push_back(matrix(i, j));
        }
      starts.push_back(static_cast<int>(rows.size()));
    }
    std::vector<double> masses(n / 3, 1.0);
    masses.back() = 0.0;
    std::vector<double> right(n);
    for (double& b : right)
      b = random.vector()[0];
    PointSweeps sweeps;
    sweeps.setPattern(starts, rows, masses);
    const LinearResult result = sweeps.solve(values, right, tolerance, 500);
    sweeps.copySolution(x.data());
    x = matrix * x - Eigen::Map<const VectorXd>(right.data(), n);   // what is left
    return result;
  };
  VectorXd left(n);
  const LinearResult result = solve(A, 1e-10, left);
  EXPECT_TRUE(result.definite);
  EXPECT_LT(left.norm(), 1e-8);   // of a right-hand side of size 10
  // The residual has no force that acts on all points together.
  VectorXd sum = VectorXd::Zero(3);
  solve(A, 1e-2, left);
  for (int i = 0; i < n - 3; i += 3)
    sum += left.segment(i, 3);
  EXPECT_LT(sum.norm(), 1e-10);
  A(cloth + 3, cloth + 3) = -1.0;
  EXPECT_FALSE(solve(A, 1e-10, left).definite);
}

/// The matrix of an island whose cloth has averages, with their multipliers. Both the solution and the multipliers are
/// those of a dense factorisation.
TEST(PointSweeps, SolveForMultipliersOfAverages)
{
  System s;
  constexpr int kAverages = 5;
  const int cloth = 3 * s.points(), body = cloth + 6, n = body + 3 * kAverages;
  MatrixXd A = MatrixXd::Zero(n, n);
  A.topLeftCorner(cloth, cloth) = denseOf(s.blocks);
  A.block<6, 6>(cloth, cloth).diagonal() << 4, 4, 4, 0.1, 0.2, 0.3;
  A(cloth + 4, 30) = A(30, cloth + 4) = 0.05;   // A contact of the body couples its turn to a vertex.
  for (int i = 0; i < kAverages; ++i)
    for (int k = 0; k < 6; ++k)
      for (int c = 0; c < 3; ++c)
      {
        const int row = body + 3 * i + c, column = 3 * ((9 * i + 2 * k) % s.points()) + c;
        A(row, column) = A(column, row) = 0.1 + 0.03 * k + 0.01 * i;
      }
  std::vector<int> starts{0}, rows;
  std::vector<double> values, masses(body / 3, 0.5), right(n, 0.0);
  masses.back() = 0.0;
  for (int j = 0; j < n; ++j)
  {
    for (int i = j; i < n; ++i)
      if (A(i, j) != 0.0 || i == j)
      {
        rows.push_back(i);
        values.push_back(A(i, j));
      }
    starts.push_back(static_cast<int>(rows.size()));
  }
  Random random(7);
  for (int i = 0; i < body; ++i)
    right[i] = random.vector()[0];
  const VectorXd expected = A.fullPivLu().solve(Eigen::Map<const VectorXd>(right.data(), n));
  PointSweeps sweeps;
  sweeps.setPattern(starts, rows, masses);
  VectorXd x(n);
  for (const double stiffer : {1.0, 2.0})   // The next matrix of the same pattern has the same averages.
  {
    std::vector<double> scaled = values;
    for (int j = 0; j < body; ++j)
      for (int k = starts[j]; k < starts[j + 1] && rows[k] < body; ++k)
        scaled[k] *= stiffer;
    const LinearResult result = sweeps.solve(scaled, right, 1e-12, 500);
    EXPECT_TRUE(result.definite);
    EXPECT_LE(result.residual, 1e-12);
    sweeps.copySolution(x.data());
    EXPECT_LT((stiffer * x - expected).head(body).norm(), 1e-9 * expected.head(body).norm());
    EXPECT_LT((x - expected).tail(n - body).norm(), 1e-8 * expected.tail(n - body).norm());
  }
}

TEST(SymmetricSweeps, SolveWithAndWithoutAMatrixOfPoints)
{
  System s;
  Random random(31);
  PointVector b(4 * s.points(), 0.0), x(4 * s.points(), 0.0);
  for (int i = 0; i < s.points(); ++i)
    point(b, i) = random.vector();
  for (const bool with : {false, true})
  {
    MatrixXd A = denseOf(s.blocks);
    if (with)
      for (int c = 0; c < 3; ++c)
        A(Eigen::seqN(c, s.points(), 3), Eigen::seqN(c, s.points(), 3)) += 0.7 * MatrixXd(s.bending.toEigen());
    for (int i = 0; i < s.points(); ++i)
      if (s.fixed[i])
      {
        A.middleRows(3 * i, 3).setZero();
        A.middleCols(3 * i, 3).setZero();
        A.block<3, 3>(3 * i, 3 * i).setIdentity();
        point(b, i).setZero();
      }
    SymmetricSweeps sweeps(s.blocks, with ? &s.bending : nullptr);
    const VectorXd expected = A.llt().solve(flattened(matrixOf(b)));
    sweeps.set(0.7, s.fixed);
    const LinearResult result = sweeps.solve(b, x, 1e-12, 500);
    EXPECT_TRUE(result.definite);
    EXPECT_LT(result.residual, 1e-12);
    ConjugateGradients plain;   // preconditioned by the diagonal blocks alone
    plain.resize(4 * static_cast<std::size_t>(s.points()));
    PointVector y = x;
    const LinearResult slow = plain.solve(
        b, y, 1e-12, 2000,
        [&](const PointVector& p, PointVector& ap) {
          const VectorXd product = A * flattened(matrixOf(p));
          ap = pointsOf(Eigen::Map<const Matrix3Xd>(product.data(), 3, s.points()));
        },
        [&](const PointVector& r, PointVector& z) {
          for (int i = 0; i < s.points(); ++i)
            point(z, i) = A.block<3, 3>(3 * i, 3 * i).inverse() * point(r, i);
        });
    EXPECT_LT(result.iterations, 0.6 * slow.iterations);   // a model problem's halve
    // the condition number times the tolerance
    EXPECT_LT((flattened(matrixOf(x)) - expected).norm(), 1e-10 * expected.norm()) << with;
    EXPECT_EQ(x[3], 0.0);
    EXPECT_EQ(point(x, 17).norm(), 0.0);
  }
  for (int k = 0; k < 3; ++k)
    s.blocks.values()[9 * s.blocks.starts()[40] + 4 * k] -= 100.0;
  SymmetricSweeps sweeps(s.blocks, nullptr);
  sweeps.set(1.0, s.fixed);
  EXPECT_FALSE(sweeps.solve(b, x, 1e-12, 500).definite);
}

/// In each solution the forces on all points together vanish. Iterations hardly grow when the points become sixteen
/// times as many; by sweeps alone they become three times as many.
TEST(SymmetricSweeps, SolveCommonMotionsDirectly)
{
  int before = 0;
  for (const int cells : {12, 48})
  {
    // Without bending, whose motions are local, and so light that forces reach all points.
    System s(cells, 0.0, 1e-3);
    Random random(11);
    PointVector b(4 * s.points(), 0.0), x(4 * s.points(), 0.0);
    for (int i = 0; i < s.points(); ++i)
      point(b, i) = Eigen::Vector3d(0.0, 0.1, 1.0) + random.vector(0.1);
    std::fill(s.fixed.begin(), s.fixed.end(), 0);
    SymmetricSweeps sweeps(s.blocks, nullptr);
    sweeps.set(1.0, s.fixed);
    const LinearResult result = sweeps.solve(b, x, 1e-4, 500);
    EXPECT_TRUE(result.definite);
    EXPECT_LE(result.residual, 1e-4);
    PointVector left(4 * s.points(), 0.0);
    s.blocks.addProduct(x.data(), left.data());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double square = 0.0;
    for (int i = 0; i < s.points(); ++i)
    {
      sum += point(left, i) - point(b, i);
      square += (point(left, i) - point(b, i)).squaredNorm();
    }
    EXPECT_LT(sum.norm(), 1e-10 * s.points());                    // rounding errors of double precision
    EXPECT_LT(std::sqrt(square), 1e-2 * std::sqrt(s.points()));   // another norm than that of the tolerance
    if (before > 0)
      EXPECT_LT(result.iterations, 1.5 * before);
    before = result.iterations;
  }
}

TEST(PointCholesky, SolvesBlocks)
{
  System s;
  Random random(29);
  SparseCholesky factor;
  factor.setPattern(s.blocks);
  PointVector b(4 * s.points(), 0.0), x(4 * s.points(), 0.0);
  for (int i = 0; i < s.points(); ++i)
    point(b, i) = random.vector();
  MatrixXd dense = denseOf(s.blocks);
  for (const bool pinned : {false, true, false})
  {
    MatrixXd A = dense;
    for (int i = 0; i < s.points() && pinned; ++i)
      if (s.fixed[i])
      {
        A.middleRows(3 * i, 3).setZero();
        A.middleCols(3 * i, 3).setZero();
        A.block<3, 3>(3 * i, 3 * i).setIdentity();
      }
    ASSERT_TRUE(factor.factor(s.blocks, pinned ? s.fixed.data() : nullptr));
    factor.solvePoints(b.data(), x.data());
    const VectorXd expected = A.llt().solve(flattened(matrixOf(b)));
    EXPECT_LT((flattened(matrixOf(x)) - expected).norm(), 1e-11 * expected.norm()) << pinned;
    EXPECT_EQ(x[3], 0.0);
  }
  // not definite: refused, and usable again
  for (int k = 0; k < 3; ++k)
    s.blocks.values()[9 * s.blocks.starts()[40] + 4 * k] -= 100.0;
  EXPECT_FALSE(factor.factor(s.blocks, nullptr));
  for (int k = 0; k < 3; ++k)
    s.blocks.values()[9 * s.blocks.starts()[40] + 4 * k] += 100.0;
  EXPECT_TRUE(factor.factor(s.blocks, nullptr));
  const int last = s.points() - 1;
  for (const int point : {0, 40, last})
  {
    double& value = s.blocks.values()[9 * s.blocks.starts()[point]];
    const double good = value;
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    {
      value = bad;
      EXPECT_FALSE(factor.factor(s.blocks, nullptr)) << point << " " << bad;
    }
    value = good;
  }
  EXPECT_TRUE(factor.factor(s.blocks, nullptr));
}

TEST(PointCholesky, SolvesThreeCoordinatesAtATime)
{
  const System s;
  std::vector<Eigen::Triplet<double>> entries;
  const Eigen::SparseMatrix<double> K = s.bending.toEigen();
  for (int j = 0; j < s.points(); ++j)
  {
    for (Eigen::SparseMatrix<double>::InnerIterator it(K, j); it; ++it)
      entries.emplace_back(static_cast<int>(it.row()), j, it.value());
    entries.emplace_back(j, j, 1.0 + j);
  }
  const PointMatrix A(s.points(), entries);
  Random random(31);
  PointVector b(4 * s.points(), 0.0);
  for (int i = 0; i < s.points(); ++i)
    point(b, i) = random.vector();
  SparseCholesky factor;
  factor.setPattern(A);
  for (const bool pinned : {false, true})
  {
    MatrixXd dense = A.toEigen();
    for (int i = 0; i < s.points() && pinned; ++i)
      if (s.fixed[i])
      {
        dense.row(i).setZero();
        dense.col(i).setZero();
        dense(i, i) = 1;
      }
    ASSERT_TRUE(factor.factor(A, pinned ? s.fixed.data() : nullptr));
    PointVector x = b;
    factor.solvePoints(x.data(), x.data());
    const MatrixXd expected = dense.llt().solve(matrixOf(b).transpose());
    EXPECT_LT((matrixOf(x).transpose() - expected).norm(), 1e-11 * expected.norm()) << pinned;
  }
}

/// The lower triangle of a dense matrix by columns, as SparseCholesky::setPattern() takes it, with its whole diagonal.
struct Lower
{
  std::vector<int> starts{0}, rows;
  std::vector<double> values;

  explicit Lower(const MatrixXd& a)
  {
    for (Eigen::Index j = 0; j < a.cols(); ++j)
    {
      for (Eigen::Index i = j; i < a.rows(); ++i)
        if (i == j || a(i, j) != 0.0)
        {
          rows.push_back(static_cast<int>(i));
          values.push_back(a(i, j));
        }
      starts.push_back(static_cast<int>(rows.size()));
    }
  }
};

bool factorsAs(const MatrixXd& a, int multipliers)
{
  const Lower lower(a);
  SparseCholesky factor;
  factor.setPattern(static_cast<int>(a.rows()), lower.starts, lower.rows, multipliers);
  std::copy(lower.values.begin(), lower.values.end(), factor.values());
  return factor.factor();
}

/// Sums of a window of unknowns along a chain are prescribed, and one of two unknowns far apart.
MatrixXd chainWithConstraints(int unknowns, int constraints, double least)
{
  const int n = unknowns + constraints;
  MatrixXd a = MatrixXd::Zero(n, n);
  for (int i = 0; i + 1 < unknowns; ++i)
    a.block<2, 2>(i, i) += (1.0 + 0.1 * (i % 7)) * (MatrixXd(2, 2) << 1, -1, -1, 1).finished();
  a.topLeftCorner(unknowns, unknowns).diagonal().array() += least;
  for (int c = 0; c < constraints; ++c)
    for (int i = 0; i < unknowns; ++i)
      if (c == 0 ? i == 3 || i == unknowns - 2 : std::abs(i - c * unknowns / constraints) < 6)
        a(unknowns + c, i) = a(i, unknowns + c) = 0.5 + 0.1 * (i % 3);
  return a;
}

TEST(SparseCholesky, EliminatesMultipliersAfterTheirConstraints)
{
  constexpr int kUnknowns = 60, kConstraints = 8, n = kUnknowns + kConstraints;
  const MatrixXd a = chainWithConstraints(kUnknowns, kConstraints, 1e-3);
  const Lower lower(a);
  SparseCholesky factor;
  factor.setPattern(n, lower.starts, lower.rows, kConstraints);
  Random random(8);
  for (int pass = 0; pass < 2; ++pass)   // the second one with the analysis of the first
  {
    std::copy(lower.values.begin(), lower.values.end(), factor.values());
    ASSERT_TRUE(factor.factor());
    VectorXd right(n);
    for (double& b : right)
      b = random.uniform();
    const VectorXd expected = a.partialPivLu().solve(right);
    VectorXd x = right;
    factor.solve(x.data());
    EXPECT_LT((x - expected).norm(), 1e-11 * expected.norm());   // the condition of the chain is 4e3
  }
  // The factorisation fails unless there are as many negative pivots as multipliers.
  EXPECT_FALSE(factorsAs(chainWithConstraints(kUnknowns, kConstraints, -0.5), kConstraints));
  EXPECT_FALSE(factorsAs(MatrixXd::Zero(1, 1), 1));
  MatrixXd empty = a;
  empty.row(n - 1).setZero();
  empty.col(n - 1).setZero();
  EXPECT_FALSE(factorsAs(empty, kConstraints));
  EXPECT_TRUE(factorsAs(a, kConstraints));
  EXPECT_FALSE(factorsAs(a, 0));
  // Of a constraint that follows from another one, a rounding error of either sign is left.
  MatrixXd dependent = a;
  dependent.row(n - 1) = dependent.row(n - 2);
  dependent.col(n - 1) = dependent.col(n - 2);
  const Lower twice(dependent);
  factor.setPattern(n, twice.starts, twice.rows, kConstraints);
  std::copy(twice.values.begin(), twice.values.end(), factor.values());
  EXPECT_TRUE(!factor.factor() || factor.pivot(n - 1) < 1e-12 * factor.pivot(n - 2));
}

}   // namespace
}   // namespace slender::test
