#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "slender_sim/geometry/mesh_offsets.h"
#include "slender_sim/geometry/tube_mesh.h"
#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {
namespace {

/// Positive when the triangles face outwards.
double volumeOf(const TriangleMesh& mesh)
{
  double volume = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, f)), b = mesh.vertices.col(mesh.triangles(1, f)),
                          c = mesh.vertices.col(mesh.triangles(2, f));
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

/// Every edge has one triangle on either side.
void expectWatertight(const TriangleMesh& mesh)
{
  std::map<std::pair<int, int>, int> edges;
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
      ++edges[{mesh.triangles(k, f), mesh.triangles((k + 1) % 3, f)}];
  for (const auto& [edge, count] : edges)
  {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.count({edge.second, edge.first})) << edge.first << " " << edge.second;
  }
}

/// Of a polygon with as many sides as the tube, over that of the ellipse around it.
double polygonShare(int sides) { return sides / (2 * M_PI) * std::sin(2 * M_PI / sides); }

FramedLine straightLine(int edges, double length, double a, double b)
{
  FramedLine line{false, Eigen::Matrix3Xd::Zero(3, edges + 1), Eigen::Matrix3Xd::Zero(3, edges),
                  Eigen::Matrix2Xd(2, edges)};
  line.x.row(2).setLinSpaced(0, length);
  line.d1.row(1).setOnes();
  line.semi_axes.row(0).setConstant(a);
  line.semi_axes.row(1).setConstant(b);
  return line;
}

TEST(TubeMesh, ellipticTubeHasItsVolumeAndAxesAlongTheFrame)
{
  const TriangleMesh mesh = tubeMesh(tubeSections(straightLine(7, 2.0, 0.3, 0.1), 100), 16, false);
  expectWatertight(mesh);
  EXPECT_NEAR(volumeOf(mesh), M_PI * 0.3 * 0.1 * 2.0 * polygonShare(16), 1e-12);
  // d1 is y, and points at a side's middle
  EXPECT_NEAR(mesh.vertices.row(1).maxCoeff(), 0.3 * std::cos(M_PI / 16), 1e-12);
  EXPECT_NEAR(mesh.vertices.row(0).maxCoeff(), 0.1 * std::cos(M_PI / 16), 1e-12);
  EXPECT_EQ(mesh.vertices.row(2).maxCoeff(), 2.0);
}

TEST(TubeMesh, closedTubeIsATorusAlsoWithTurningFrames)
{
  const int edges = 60;
  for (const int turns : {0, 2})
  {
    FramedLine line{true, Eigen::Matrix3Xd(3, edges), Eigen::Matrix3Xd(3, edges),
                    Eigen::Matrix2Xd::Constant(2, edges, 0.1)};
    for (int j = 0; j < edges; ++j)
    {
      const double angle = 2 * M_PI * j / edges, middle = angle + M_PI / edges, roll = turns * middle;
      line.x.col(j) << std::cos(angle), std::sin(angle), 0;
      line.d1.col(j) << std::cos(roll) * std::cos(middle), std::cos(roll) * std::sin(middle), std::sin(roll);
    }
    const std::vector<TubeSection> sections = tubeSections(line, 240);
    ASSERT_EQ(sections.size(), 121u);
    EXPECT_LT((sections.front().x - sections.back().x).norm() + (sections.front().u - sections.back().u).norm(), 1e-12);
    const TriangleMesh mesh = tubeMesh(sections, 24, true);
    expectWatertight(mesh);
    const double exact = 2 * M_PI * M_PI * 0.01 * polygonShare(24);
    // sides that wind are not flat: their diagonals add a little
    EXPECT_NEAR(volumeOf(mesh), exact, (turns == 0 ? 2e-3 : 1e-2) * exact);
  }
}

TEST(TubeMesh, radiiAreAveragedAtNodesAndSectionsPassThroughThem)
{
  FramedLine line = straightLine(2, 1.0, 0.1, 0.1);
  line.semi_axes.col(1).setConstant(0.3);
  const std::vector<TubeSection> sections = tubeSections(line, 2);
  ASSERT_EQ(sections.size(), 3u);
  EXPECT_NEAR(sections[0].u.norm(), 0.1, 1e-15);
  EXPECT_NEAR(sections[1].u.norm(), 0.2, 1e-15);
  EXPECT_NEAR(sections[2].w.norm(), 0.3, 1e-15);
  EXPECT_LT((sections[1].x - line.x.col(1)).norm(), 1e-15);
  // tangent to the ellipse, outwards
  const TubeSection ellipse{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}};
  const TriangleMesh mesh = tubeMesh({ellipse, {{0, 0, 1}, ellipse.u, ellipse.w}}, 360, false);
  for (int k = 1; k < 359; ++k)
  {
    const Eigen::Vector3d along = (mesh.vertices.col(k + 1) - mesh.vertices.col(k - 1)).normalized();
    EXPECT_NEAR(tubeNormal(ellipse, k, 360).dot(along), 0, 1e-3);
    EXPECT_GT(tubeNormal(ellipse, k, 360).dot(mesh.vertices.col(k)), 0);
  }
}

TEST(TubeMesh, insidesOfHoldersAreLeftOut)
{
  ThreadSnapshot thread;
  thread.x = Eigen::Matrix3Xd::Zero(3, 4);
  thread.x.row(0) << 0, 1, 2, 3;
  thread.frames.assign(3, Eigen::Quaterniond::Identity());
  thread.radius = Eigen::Vector3d(0.1, 0.2, 0.0);
  const FramedLine line = lineOf(thread);
  EXPECT_EQ(line.x.cols(), 3);
  EXPECT_EQ(line.x(0, 2), 2);
  EXPECT_EQ(line.semi_axes(1, 1), 0.2);
  EXPECT_EQ(line.d1(1, 0), 1);
}

TEST(ShapeMesh, closedAndOfTheRightVolume)
{
  const auto check = [](const Shape& shape, double exact, double part) {
    const TriangleMesh mesh = shapeMesh(shape);
    expectWatertight(mesh);
    EXPECT_NEAR(volumeOf(mesh), exact, part * exact);
    EXPECT_LE(volumeOf(mesh), exact * (1 + 1e-12));
  };
  check(Box{{1, 2, 3}}, 6, 1e-12);
  check(Sphere{0.5}, M_PI / 6, 0.01);
  check(Cylinder{0.2, 0.5}, M_PI * 0.04 * 0.5, 0.02);
  check(Capsule{0.2, 0.5}, M_PI * 0.04 * 0.5 + 4.0 / 3.0 * M_PI * 0.008, 0.03);
  EXPECT_NEAR(shapeMesh(Capsule{0.2, 0.5}).vertices.row(2).maxCoeff(), 0.45, 1e-15);
  EXPECT_EQ(shapeMesh(Plane{}).vertices.cols(), 0);
}

TEST(CornerNormals, creasesStaySharpAndRoundSidesAreSmooth)
{
  const TriangleMesh box = shapeMesh(Box{{1, 2, 3}});
  const Eigen::Matrix3Xd flat = cornerNormals(box);
  ASSERT_EQ(flat.cols(), box.triangles.size());
  for (Eigen::Index c = 0; c < flat.cols(); ++c)
  {
    EXPECT_NEAR(flat.col(c).cwiseAbs().maxCoeff(), 1.0, 1e-12);                   // along an axis
    EXPECT_GT(flat.col(c).dot(box.vertices.col(box.triangles.data()[c])), 0.0);   // outwards
  }
  const TriangleMesh drum = shapeMesh(Cylinder{0.5, 1.0});
  const Eigen::Matrix3Xd round = cornerNormals(drum);
  for (Eigen::Index c = 0; c < round.cols(); ++c)
  {
    const Eigen::Vector3d x = drum.vertices.col(drum.triangles.data()[c]);
    if (std::abs(round(2, c)) > 0.5)
      EXPECT_NEAR(round.col(c).dot(Eigen::Vector3d(0, 0, x.z() > 0 ? 1 : -1)), 1.0, 1e-12);
    else   // radial but for the two triangles per side, which weigh unequally at a corner: at most a third of the 15
           // degrees of a side
      EXPECT_GT(round.col(c).dot(Eigen::Vector3d(x.x(), x.y(), 0).normalized()), std::cos(5.1 * M_PI / 180));
  }
}

}   // namespace
}   // namespace slender
