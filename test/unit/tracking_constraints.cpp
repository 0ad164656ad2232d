// Test functions, averaged constraints and regions.
#include <numeric>
#include <set>

#include <gtest/gtest.h>

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
