// Test functions, averaged constraints, regions, and the saddle-point solve behind them.
#include <numeric>
#include <set>

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <gtest/gtest.h>

#include "linalg/projected_sweeps.h"
#include "slender_sim/linalg/constrained_cholesky.h"
#include "slender_sim/tracking/clustering.h"
#include "slender_sim/tracking/weak_constraints.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

template <class Action>
std::string messageOf(Action action)
{
  try
  {
    action();
  }
  catch (const std::invalid_argument& e)
  {
    return e.what();
  }
  return "";
}

TEST(Subdivision, KeepsThePlaneAndTheCoarseVertices)
{
  const TriangleMesh coarse = gridMesh(2.0, 1.0, 4, 3, GridPattern::irregular);
  const Subdivision fine = subdivide(coarse, 3);
  EXPECT_EQ(fine.mesh.triangles.cols(), 64 * coarse.triangles.cols());
  EXPECT_EQ(fine.mesh.vertices.leftCols(coarse.vertices.cols()), coarse.vertices);
  EXPECT_LT((fine.mesh.vertices - coarse.vertices * fine.weights.transpose()).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_NEAR(faceAreas(fine.mesh).sum(), 2.0, 1e-13);
  EXPECT_EQ(meshTopology(fine.mesh).boundaries.size(), 1u);
  EXPECT_THROW(subdivide(coarse, -1), std::invalid_argument);
}

TEST(WeakConstraints, MassMatrixIntegratesProductsOfHats)
{
  const TriangleMesh mesh = gridMesh(1.5, 1.0, 5, 4, GridPattern::irregular);
  const MassMatrix mass = hatMassMatrix(mesh);
  // int x y over the rectangle: linear functions are in the span of the hats
  const VectorXd x = mesh.vertices.row(0), y = mesh.vertices.row(1);
  EXPECT_NEAR(x.dot(mass * y), 0.5 * 1.5 * 1.5 * 0.5, 1e-14);
  EXPECT_NEAR(VectorXd::Ones(x.size()).dot(mass * x), 0.5 * 1.5 * 1.5, 1e-14);
  Matrix3Xd nodes(3, 4);
  nodes << 0, 0.3, 0.7, 1.0, 0, 0, 0, 0, 0, 0, 0, 0;
  const VectorXd s = nodes.row(0);
  EXPECT_NEAR(s.dot(hatMassMatrix(nodes, false) * s), 1.0 / 3.0, 1e-15);
  EXPECT_NEAR(hatMassMatrix(nodes, true).sum(), 2.0, 1e-15);
}

TEST(WeakConstraints, CloseUnderRigidMotionAndAreAreaIndependent)
{
  // guide half as large at rest as what tracks it: (6.3) keeps rigid transformations of both permissible
  const TriangleMesh coarse = gridMesh(1.0, 1.0, 3, 3, GridPattern::alternating);
  const Subdivision fine = subdivide(coarse, 2);
  TriangleMesh guide = coarse;
  guide.vertices *= 0.5;
  const WeakConstraints constraints(subdivisionBasis(fine), hatMassMatrix(guide), hatMassMatrix(fine.mesh));
  constraints.requireIndependent({});
  EXPECT_EQ(constraints.count(), 16);
  Random random(3);
  const Eigen::Matrix3d R = random.rotation().toRotationMatrix();
  const Vector3d shift = random.vector();
  // a guide stretched as the rest shapes are has the same averages only for affine maps of the same surface
  const Matrix3Xd q_guide = (R * coarse.vertices).colwise() + shift, q = (R * fine.mesh.vertices).colwise() + shift;
  EXPECT_LT(constraints.error(constraints.averages(q_guide), q), 1e-15);
  EXPECT_NEAR(constraints.error(constraints.averages(q_guide), q.colwise() + Vector3d(0, 0.25, 0)), 0.25, 1e-14);
}

TEST(WeakConstraints, NamesEmptyAndDependentFunctions)
{
  const TriangleMesh mesh = gridMesh(1.0, 1.0, 4, 4, GridPattern::alternating);
  const int n = static_cast<int>(mesh.vertices.cols());
  const MassMatrix mass = hatMassMatrix(mesh);
  std::vector<int> all(n), left, right;
  std::iota(all.begin(), all.end(), 0);
  for (int v = 0; v < n; ++v)
    (mesh.vertices(0, v) < 0.4 ? left : right).push_back(v);
  const auto paint = [&](std::vector<PaintedRegion> r) { return WeakConstraints(paintedRegions(r, n, n), mass, mass); };
  EXPECT_EQ(messageOf([&] { paint({{"left", left, left}, {"right", right, right}}).requireIndependent({}); }), "");
  const std::string dependent = messageOf([&] {
    paint({{"left", left, left}, {"right", right, right}, {"all", all, all}}).requireIndependent({});
  });
  EXPECT_NE(dependent.find("'all' depends on 'left', 'right'"), std::string::npos) << dependent;
  EXPECT_NE(messageOf([&] {
              paint({{"left", left, {}}});
            }).find("'left': has no vertices on the tracked mesh"),
            std::string::npos);
  EXPECT_NE(messageOf([&] {
              paint({{"left", {99}, left}});
            }).find("vertex 99 is not on the guide mesh"),
            std::string::npos);
  // whatever order they come in: all but a corner, all, the corner
  std::vector<int> most = all;
  most.pop_back();
  const std::string corner = messageOf([&] {
    paint({{"most", most, most}, {"all", all, all}, {"corner", {n - 1}, {n - 1}}}).requireIndependent({});
  });
  EXPECT_NE(corner.find("'corner' depends on 'most', 'all'"), std::string::npos) << corner;
  // among thousands, too: in time that grows with the overlaps, not with all pairs
  const TriangleMesh large = gridMesh(1.0, 1.0, 60, 60, GridPattern::alternating);
  TestFunctions hats = subdivisionBasis(subdivide(large, 0));
  EXPECT_EQ(
      messageOf([&] { WeakConstraints(hats, hatMassMatrix(large), hatMassMatrix(large)).requireIndependent({}); }), "");
  for (TestFunctions::Values* values : {&hats.guide, &hats.tracked})
    values->row(7) = TestFunctions::Values(values->row(8));
  const std::string among =
      messageOf([&] { WeakConstraints(hats, hatMassMatrix(large), hatMassMatrix(large)).requireIndependent({}); });
  EXPECT_NE(among.find("'" + hats.names[8] + "' depends on '" + hats.names[7] + "':"), std::string::npos) << among;
  // held vertices leave nothing to act on
  std::vector<char> held(n, 0);
  for (const int v : all)
    held[v] = mesh.vertices(0, v) < 0.6;
  EXPECT_NE(messageOf([&] {
              paint({{"left", left, left}}).requireIndependent(held);
            }).find("'left' acts on held vertices only"),
            std::string::npos);
  // an empty one: a vertex in no face
  TriangleMesh loose = mesh;
  loose.vertices.conservativeResize(3, n + 1);
  loose.vertices.col(n).setZero();
  const MassMatrix with_loose = hatMassMatrix(loose);
  EXPECT_NE(messageOf([&] {
              WeakConstraints(paintedRegions({{"speck", {n}, {n}}}, n + 1, n + 1), with_loose, with_loose);
            }).find("'speck' is empty"),
            std::string::npos);
}

/// A sheet with averages by the hats of a coarser mesh, which is subdivided: blocks A, a matrix B that acts on each
/// coordinate alike, and held corners.
struct AveragedSheet
{
  AveragedSheet(int cells, int levels, bool pinned)
    : coarse(gridMesh(1.0, 1.0, cells, cells, GridPattern::alternating)),
      fine(subdivide(coarse, levels)),
      n(static_cast<int>(fine.mesh.vertices.cols())),
      constraints(subdivisionBasis(fine), hatMassMatrix(coarse), hatMassMatrix(fine.mesh)),
      held(n, 0),
      mass(n)
  {
    held[2] = held[n - 1] = pinned;
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
    // one that is left out has no force, and all others are exact
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

TEST(ProjectedSweeps, SolveTheSaddlePointSystem)
{
  // many averages, and so few that groups of points move as a whole
  for (const auto& [cells, levels] : {std::pair(12, 1), std::pair(1, 4)})
    for (const bool pinned : {false, true})
      for (const double tolerance : {1e-4, 1e-11})   // in single and in double precision
      {
        const AveragedSheet sheet(cells, levels, pinned);
        AverageProjection projection(sheet.constraints.matrix());
        ASSERT_TRUE(projection.prepare(sheet.mass, [&](int i) { return !sheet.held[i]; }));
        ProjectedSweeps sweeps;
        sweeps.setPattern(sheet.a, &sheet.b);
        sweeps.setAverages(projection);
        ASSERT_TRUE(sweeps.set(1.3, sheet.held));
        PointVector x(4 * static_cast<std::size_t>(sheet.n), 0.0);
        const PointVector r = sheet.load();
        const LinearResult result = sweeps.solve(r, x, tolerance, 2000, 0.0);
        EXPECT_TRUE(result.definite);
        EXPECT_LE(result.residual, tolerance);
        EXPECT_LT(result.iterations, tolerance < 1e-9 ? 200 : 100);
        const Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(sheet.saddle(1.3));
        VectorXd right = VectorXd::Zero(3 * (sheet.n + projection.count()));
        for (int i = 0; i < sheet.n; ++i)
          right.segment<3>(3 * i) = point(r, i);
        const VectorXd solution = lu.solve(right), expected = solution.head(3 * sheet.n);
        const MatrixXd found = matrixOf(x);
        // norms that differ by the root of the condition number
        EXPECT_LT((found.reshaped() - expected).norm(), 100 * tolerance * expected.norm()) << cells << pinned;
        EXPECT_LT((sheet.constraints.matrix() * found.transpose()).cwiseAbs().maxCoeff(),
                  1e-13 * found.cwiseAbs().maxCoeff() * sheet.n);
      }
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
  sheet.addBlock(40, 40, -20.0 * Eigen::Matrix3d::Identity());
  AverageProjection projection(sheet.constraints.matrix());
  ASSERT_TRUE(projection.prepare(sheet.mass, [&](int i) { return !sheet.held[i]; }));
  ProjectedSweeps sweeps;
  sweeps.setPattern(sheet.a, &sheet.b);
  sweeps.setAverages(projection);
  PointVector x(4 * static_cast<std::size_t>(sheet.n), 0.0);
  EXPECT_FALSE(sweeps.set(1.0, sheet.held) && sweeps.solve(sheet.load(), x, 1e-5, 2000, 0.0).definite);
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

/// Two stiff plates beside each other with a hinge between them at x = 0, of which only one frame shows the bend.
std::vector<Matrix3Xd> foldingFrames(const TriangleMesh& mesh)
{
  std::vector<Matrix3Xd> frames;
  for (int t = 0; t <= 20; ++t)
  {
    Matrix3Xd x = mesh.vertices;
    const double angle = 2.0 * std::sin(M_PI * t / 20.0);
    for (int v = 0; v < x.cols(); ++v)
      if (x(0, v) > 0)
        x.col(v) = Eigen::AngleAxisd(-angle, Vector3d::UnitY()) * x.col(v);
    frames.push_back(x);
  }
  return frames;
}

TriangleMesh plate()
{
  TriangleMesh mesh = gridMesh(2.0, 0.9, 30, 14, GridPattern::alternating);
  mesh.vertices.row(0).array() -= 1.2;   // the seam is not where regions of equal size would meet
  return mesh;
}

TEST(Clustering, FindsTheSeamOfAnAnimationOnly)
{
  const TriangleMesh mesh = plate();
  const auto frames = foldingFrames(mesh);
  const auto across = [&](const std::vector<int>& region) {
    // faces whose region lies on both sides of the hinge
    std::map<int, std::pair<int, int>> sides;
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    {
      double x = 0;
      for (const int v : mesh.triangles.col(f))
        x += mesh.vertices(0, v) / 3.0;
      ++(x > 0 ? sides[region[f]].first : sides[region[f]].second);
    }
    int wrong = 0;
    for (const auto& [r, count] : sides)
      wrong += std::min(count.first, count.second);
    return wrong;
  };
  ClusteringOptions options;
  options.regions = 6;
  options.compactness = 0.3;
  const Clustering moving = clusterFaces(mesh.triangles, frames, options),
                   still = clusterFaces(mesh.triangles, {frames[0]}, options);
  EXPECT_EQ(moving.frames.size(), 20u);
  EXPECT_EQ(across(moving.region), 0);
  EXPECT_GT(across(still.region), 20);
  for (const Clustering& c : {moving, still})
  {
    EXPECT_EQ(std::set<int>(c.region.begin(), c.region.end()).size(), 6u);
    EXPECT_LT(c.iterations, options.max_iterations);
    // functions of the regions sum to 1 and are independent
    const TestFunctions functions = regionBasis(mesh, c.region);
    EXPECT_LT((Eigen::RowVectorXd::Ones(6) * functions.tracked - Eigen::RowVectorXd::Ones(mesh.vertices.cols()))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-14);
    WeakConstraints(functions, hatMassMatrix(mesh), hatMassMatrix(mesh)).requireIndependent({});
  }
  EXPECT_EQ(clusterFaces(mesh.triangles, frames, options).region, moving.region);
  options.seed = 2;
  EXPECT_NE(clusterFaces(mesh.triangles, frames, options).region, moving.region);
}

TEST(Clustering, RefusesWithReason)
{
  const TriangleMesh mesh = plate();
  ClusteringOptions options;
  options.regions = 0;
  EXPECT_NE(messageOf([&] { clusterFaces(mesh.triangles, {mesh.vertices}, options); }).find("regions must be from 1"),
            std::string::npos);
  options.regions = 4;
  EXPECT_NE(messageOf([&] { clusterFaces(mesh.triangles, {}, options); }).find("at least one frame"),
            std::string::npos);
  EXPECT_NE(messageOf([&] {
              clusterFaces(mesh.triangles, {mesh.vertices, mesh.vertices.leftCols(5)}, options);
            }).find("frame 1 has 5 vertices"),
            std::string::npos);
  TriangleMesh two = mesh;
  two.vertices.conservativeResize(3, 2 * mesh.vertices.cols());
  two.vertices.rightCols(mesh.vertices.cols()) = mesh.vertices.colwise() + Vector3d(0, 0, 1);
  two.triangles.conservativeResize(3, 2 * mesh.triangles.cols());
  two.triangles.rightCols(mesh.triangles.cols()) = mesh.triangles.array() + mesh.vertices.cols();
  options.regions = 1;
  EXPECT_NE(messageOf([&] { clusterFaces(two.triangles, {two.vertices}, options); }).find("2 connected parts"),
            std::string::npos);
  options.regions = 2;
  const Clustering c = clusterFaces(two.triangles, {two.vertices}, options);
  EXPECT_NE(c.region.front(), c.region.back());
}

}   // namespace
}   // namespace slender::test
