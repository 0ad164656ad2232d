#include <cmath>

#include <gtest/gtest.h>

#include "slender_sim/fairing/hole_filling.h"
#include "slender_sim/fairing/willmore_flow.h"
#include "slender_sim/geometry/mesh_defects.h"
#include "test/support/cloths.h"
#include "test/support/special_numbers.h"

namespace slender::test {
namespace {

TriangleMesh roughSphere(int levels, double size, unsigned seed)
{
  TriangleMesh mesh = icosphere(1.0, levels);
  Random random(seed);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    mesh.vertices.col(v) += random.vector(size);
  return mesh;
}

TriangleMesh roughSheet(int cells, double size, unsigned seed)
{
  TriangleMesh mesh = gridMesh(1.0, 1.0, cells, cells, GridPattern::irregular, seed);
  Random random(seed);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    mesh.vertices(2, v) += random.uniform(-size, size);
  return mesh;
}

std::vector<char> innerVertices(const TriangleMesh& mesh)
{
  std::vector<char> inner = meshTopology(mesh).on_boundary;
  for (char& c : inner)
    c = !c;
  return inner;
}

double willmoreEnergy(WillmoreEnergy& energy, const Matrix3Xd& x) { return energy.energy(pointsOf(x).data()); }

Matrix3Xd willmoreGradient(WillmoreEnergy& energy, const Matrix3Xd& x)
{
  PointVector g(4 * x.cols(), 0.0);
  energy.addGradient(pointsOf(x).data(), g.data());
  return matrixOf(g);
}

/// Faces around the north pole left out.
TriangleMesh cutSphere(int levels, double height)
{
  TriangleMesh mesh = icosphere(1.0, levels);
  std::vector<int> faces, number(mesh.vertices.cols(), -1), vertices;
  for (int f = 0; f < mesh.triangles.cols(); ++f)
    if (mesh.vertices(2, mesh.triangles(0, f)) + mesh.vertices(2, mesh.triangles(1, f)) +
            mesh.vertices(2, mesh.triangles(2, f)) <
        3 * height)
      faces.push_back(f);
  TriangleMesh cut;
  cut.triangles.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k)
    {
      int& v = number[mesh.triangles(k, faces[f])];
      if (v < 0)
      {
        v = static_cast<int>(vertices.size());
        vertices.push_back(mesh.triangles(k, faces[f]));
      }
      cut.triangles(k, static_cast<Eigen::Index>(f)) = v;
    }
  cut.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t v = 0; v < vertices.size(); ++v)
    cut.vertices.col(static_cast<Eigen::Index>(v)) = mesh.vertices.col(vertices[v]);
  return cut;
}

TEST(WillmoreEnergy, GradientIsTheDerivative)
{
  for (const TriangleMesh& mesh : {roughSphere(1, 0.2, 1), roughSheet(4, 0.1, 2)})
  {
    WillmoreEnergy energy(mesh.triangles, innerVertices(mesh));
    const MatrixXd expected = differences(
        mesh.vertices, 1e-4, [&](const Matrix3Xd& x) { return VectorXd::Constant(1, willmoreEnergy(energy, x)); });
    const Matrix3Xd gradient = willmoreGradient(energy, mesh.vertices);
    // fourth order: (1e-4 / edge)^4, round-off 1e-16 E / 1e-4
    EXPECT_LT((flattened(gradient) - expected.col(0)).norm(), 1e-8 * expected.norm());
  }
}

TEST(WillmoreEnergy, MotionsAndScalingDoNotChangeIt)
{
  const TriangleMesh mesh = roughSphere(2, 0.1, 3);
  WillmoreEnergy energy(mesh.triangles, innerVertices(mesh));
  Random random(4);
  const double expected = willmoreEnergy(energy, mesh.vertices);
  const Matrix3Xd moved = (7.0 * random.rotation().toRotationMatrix() * mesh.vertices).colwise() + random.vector(3.0);
  EXPECT_NEAR(willmoreEnergy(energy, moved), expected, 1e-11 * expected);
  const Matrix3Xd g = willmoreGradient(energy, mesh.vertices);
  Vector3d torque = Vector3d::Zero();
  for (Eigen::Index v = 0; v < g.cols(); ++v)
    torque += Vector3d(mesh.vertices.col(v)).cross(Vector3d(g.col(v)));
  EXPECT_LT(g.rowwise().sum().norm(), 1e-11 * g.norm());
  EXPECT_LT(torque.norm(), 1e-11 * g.norm());
  EXPECT_LT(std::abs(g.cwiseProduct(mesh.vertices).sum()), 1e-11 * g.norm());
}

TEST(WillmoreEnergy, PlanesHaveNone)
{
  const TriangleMesh mesh = gridMesh(1, 1, 6, 6, GridPattern::irregular, 5);
  WillmoreEnergy energy(mesh.triangles, innerVertices(mesh));
  EXPECT_LT(willmoreEnergy(energy, mesh.vertices), 1e-25);   // squares of round-off over edges
  EXPECT_LT(willmoreGradient(energy, mesh.vertices).norm(), 1e-10);
}

TEST(WillmoreEnergy, IsInfiniteWithoutAreaAndAddsNothing)
{
  TriangleMesh mesh = roughSphere(1, 0.1, 6);
  WillmoreEnergy energy(mesh.triangles, innerVertices(mesh));
  mesh.vertices.col(mesh.triangles(0, 0)) =
      0.5 * (mesh.vertices.col(mesh.triangles(1, 0)) + mesh.vertices.col(mesh.triangles(2, 0)));
  EXPECT_EQ(willmoreEnergy(energy, mesh.vertices), kInfinity);
  EXPECT_EQ(willmoreGradient(energy, mesh.vertices).norm(), 0.0);
  mesh.vertices(0, 3) = std::nan("");
  EXPECT_EQ(willmoreEnergy(energy, mesh.vertices), kInfinity);
}

TEST(WillmoreEnergy, RefusesFacesWithoutVertices)
{
  EXPECT_THROW(WillmoreEnergy(Eigen::Vector3i(0, 1, 3), std::vector<char>(3, 1)), std::invalid_argument);
}

TEST(WillmoreFlow, EnergyNeverRisesAndStaysFinite)
{
  for (const double roughness : {0.01, 0.1, 0.3})
    for (double h = 1e-9; h < 1e10; h *= 1e3)
      for (const int iterations : {1, 5})
      {
        TriangleMesh mesh = roughSphere(2, roughness, 7);
        WillmoreFlow flow(mesh, meshTopology(mesh), h, iterations);
        double last = flow.energy(mesh.vertices);
        for (int k = 0; k < 10; ++k)
        {
          const Matrix3Xd before = mesh.vertices;
          const FairingReport report = flow.step(mesh.vertices);
          ASSERT_TRUE(mesh.vertices.allFinite());
          if (!report.ok)
          {
            EXPECT_FALSE(report.message.empty());
            EXPECT_EQ(mesh.vertices, before);
          }
          const double now = flow.energy(mesh.vertices);
          EXPECT_EQ(now, report.energy);
          EXPECT_EQ(last, report.energy_before);
          EXPECT_LE(now, last) << "roughness " << roughness << ", h " << h;
          last = now;
        }
      }
}

TEST(WillmoreFlow, BoundaryAndItsNeighboursAreHeld)
{
  TriangleMesh mesh = roughSheet(10, 0.02, 8);
  const Matrix3Xd before = mesh.vertices;
  const MeshTopology t = meshTopology(mesh);
  std::vector<char> held = t.on_boundary;
  for (int e = 0; e < t.edgeCount(); ++e)
    if (t.on_boundary[t.edges(0, e)] || t.on_boundary[t.edges(1, e)])
      held[t.edges(0, e)] = held[t.edges(1, e)] = 1;
  WillmoreFlow flow(mesh, t, 1e-4);
  ASSERT_TRUE(flow.step(mesh.vertices).ok);
  int moved = 0;
  for (Eigen::Index v = 0; v < before.cols(); ++v)
  {
    const bool moves = mesh.vertices.col(v) != before.col(v);
    EXPECT_FALSE(held[v] && moves) << v;
    moved += moves;
  }
  EXPECT_EQ(moved, static_cast<int>(flow.moving().size()));
  EXPECT_GT(moved, 20);
}

TEST(WillmoreFlow, OnlyTheRegionMovesAndDependsOnItsRings)
{
  TriangleMesh mesh = roughSphere(3, 0.02, 9), other = mesh;
  std::vector<char> selected(mesh.vertices.cols(), 0);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    selected[v] = mesh.vertices(2, v) > 0.7;
  const Matrix3Xd before = mesh.vertices;
  WillmoreFlow flow(mesh, meshTopology(mesh), kInfinity, 1, selected);
  for (int k = 0; k < 20; ++k)
    ASSERT_TRUE(flow.step(mesh.vertices).ok);
  for (Eigen::Index v = 0; v < before.cols(); ++v)
    EXPECT_TRUE(selected[v] || mesh.vertices.col(v) == before.col(v)) << v;
  // far vertices have no say
  for (Eigen::Index v = 0; v < before.cols(); ++v)
    if (before(2, v) < 0)
      other.vertices.col(v) *= 1.1;
  WillmoreFlow second(other, meshTopology(other), kInfinity, 1, selected);
  for (int k = 0; k < 20; ++k)
    ASSERT_TRUE(second.step(other.vertices).ok);
  for (int v : flow.moving())
    EXPECT_EQ(mesh.vertices.col(v), other.vertices.col(v));
}

TEST(WillmoreFlow, StationarySurfacesAreLeftAlone)
{
  TriangleMesh sheet = gridMesh(1, 1, 10, 10, GridPattern::irregular, 10);
  sheet.vertices.colwise() += Vector3d(30, -20, 10);   // so that coordinates have round-off
  const Matrix3Xd before = sheet.vertices;
  WillmoreFlow flow(sheet, meshTopology(sheet), kInfinity);
  FairingReport report = flow.step(sheet.vertices);
  EXPECT_TRUE(report.ok) << report.message;
  EXPECT_LT((sheet.vertices - before).norm(), 1e-10);
  TriangleMesh sphere = icosphere(1.0, 2);
  WillmoreFlow settling(sphere, meshTopology(sphere), 10.0);
  for (int k = 0; k < 300 && !report.stationary; ++k)
  {
    report = settling.step(sphere.vertices);
    ASSERT_TRUE(report.ok) << report.message;
  }
  EXPECT_TRUE(report.stationary);
}

TEST(WillmoreFlow, RefusesWithReasonAndLeavesTheMesh)
{
  TriangleMesh mesh = roughSphere(2, 0.05, 11);
  WillmoreFlow flow(mesh, meshTopology(mesh), 1e-3);
  mesh.vertices(1, 5) = std::nan("");
  const Matrix3Xd before = mesh.vertices;
  const FairingReport report = flow.step(mesh.vertices);
  EXPECT_FALSE(report.ok);
  EXPECT_NE(report.message.find("not finite"), std::string::npos);
  mesh.vertices(1, 5) = before(0, 5);
  EXPECT_EQ(mesh.vertices.row(0), before.row(0));
  Matrix3Xd few(3, 4);
  EXPECT_THROW(flow.step(few), std::invalid_argument);
}

TEST(WillmoreFlow, RefusesBadInput)
{
  TriangleMesh mesh = roughSphere(1, 0.05, 12);
  const MeshTopology t = meshTopology(mesh);
  EXPECT_THROW(WillmoreFlow(mesh, t, 0.0), std::invalid_argument);
  EXPECT_THROW(WillmoreFlow(mesh, t, std::nan("")), std::invalid_argument);
  EXPECT_THROW(WillmoreFlow(mesh, t, 1.0, 0), std::invalid_argument);
  EXPECT_THROW(WillmoreFlow(mesh, t, 1.0, 1, std::vector<char>(3, 1)), std::invalid_argument);
  EXPECT_THROW(WillmoreFlow(mesh, t, 1.0, 1, std::vector<char>(mesh.vertices.cols(), 0)), std::invalid_argument);
  mesh.vertices.col(mesh.triangles(0, 0)) = mesh.vertices.col(mesh.triangles(1, 0));
  EXPECT_THROW(WillmoreFlow(mesh, t, 1.0), std::invalid_argument);
}

TEST(HoleFilling, ContinuesASphere)
{
  for (const double height : {0.7, 0.0})
  {
    const TriangleMesh cut = cutSphere(3, height);
    TriangleMesh mesh = cut;
    const HoleReport report = fillHole(mesh, meshTopology(mesh).boundaries.front());
    ASSERT_TRUE(report.ok) << report.message;
    EXPECT_TRUE(report.stationary);
    EXPECT_EQ(mesh.vertices.leftCols(cut.vertices.cols()), cut.vertices);
    EXPECT_EQ(mesh.triangles.leftCols(cut.triangles.cols()), cut.triangles);
    EXPECT_EQ(mesh.vertices.cols(), report.first_vertex + report.vertices);
    EXPECT_EQ(mesh.triangles.cols(), report.first_face + report.faces);
    EXPECT_TRUE(meshDefects(mesh).empty());
    EXPECT_TRUE(meshTopology(mesh).boundaries.empty());
    // as many vertices as were there, within a quarter
    const double removed = static_cast<double>(icosphere(1.0, 3).vertices.cols() - cut.vertices.cols());
    EXPECT_NEAR(report.vertices, removed, 0.25 * removed);
    // a quarter of the sagitta e^2 / 8 of an edge of 0.15 is 7e-4; the mesh's own energy has an error of (e/2)^2
    const VectorXd radii = mesh.vertices.rightCols(report.vertices).colwise().norm();
    EXPECT_LT((radii.array() - 1.0).abs().maxCoeff(), height > 0 ? 0.005 : 0.008);
  }
}

TEST(HoleFilling, ContinuesAPlane)
{
  TriangleMesh sheet = gridMesh(1, 1, 12, 12, GridPattern::equilateral);
  std::vector<int> keep;
  for (int f = 0; f < sheet.triangles.cols(); ++f)
  {
    Vector3d middle = Vector3d::Zero();
    for (int k = 0; k < 3; ++k)
      middle += sheet.vertices.col(sheet.triangles(k, f)) / 3;
    if ((middle - Vector3d(0.5, 0.5, 0)).norm() > 0.2)
      keep.push_back(f);
  }
  Eigen::Matrix3Xi faces(3, static_cast<Eigen::Index>(keep.size()));
  for (std::size_t f = 0; f < keep.size(); ++f)
    faces.col(static_cast<Eigen::Index>(f)) = sheet.triangles.col(keep[f]);
  sheet.triangles = faces;
  std::vector<std::vector<int>> loops = meshTopology(sheet).boundaries;
  std::sort(loops.begin(), loops.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  ASSERT_EQ(loops.size(), 2u);
  const HoleReport report = fillHole(sheet, loops.front());
  ASSERT_TRUE(report.ok) << report.message;
  EXPECT_TRUE(report.stationary);
  EXPECT_LT(sheet.vertices.row(2).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(faceAreas(sheet).sum(), 1.0, 1e-9);   // neither folds nor gaps
}

TEST(HoleFilling, SmallHolesNeedNoVertices)
{
  TriangleMesh sphere = icosphere(1.0, 2);
  sphere.triangles = sphere.triangles.rightCols(sphere.triangles.cols() - 1).eval();
  const HoleReport report = fillHole(sphere, meshTopology(sphere).boundaries.front());
  EXPECT_TRUE(report.ok);
  EXPECT_EQ(report.vertices, 0);
  EXPECT_EQ(report.faces, 1);
  EXPECT_TRUE(meshDefects(sphere).empty());
}

TEST(HoleFilling, FinerOnRequest)
{
  TriangleMesh coarse = cutSphere(2, 0.7), fine = coarse;
  const std::vector<int> loop = meshTopology(coarse).boundaries.front();
  HoleOptions options;
  options.edge_length = 0.05;
  const HoleReport a = fillHole(coarse, loop), b = fillHole(fine, loop, options);
  ASSERT_TRUE(a.ok && b.ok);
  EXPECT_GT(b.vertices, 10 * a.vertices);   // edges are six times as long around
  EXPECT_TRUE(meshDefects(fine).empty());
}

TEST(HoleFilling, RefusesWithReasonAndLeavesTheMesh)
{
  TriangleMesh mesh = cutSphere(2, 0.7);
  const TriangleMesh before = mesh;
  std::vector<int> loop = meshTopology(mesh).boundaries.front();
  HoleOptions bad;
  bad.edge_length = -1;
  EXPECT_THROW(fillHole(mesh, loop, bad), std::invalid_argument);
  std::swap(loop[0], loop[1]);
  EXPECT_THROW(fillHole(mesh, loop), std::invalid_argument);
  const HoleReport longer = fillHole(mesh, std::vector<int>(kLongestHole + 1, 0));
  EXPECT_FALSE(longer.ok);
  EXPECT_NE(longer.message.find("1001"), std::string::npos);
  TriangleMesh face;
  face.vertices = Matrix3Xd::Identity(3, 3);
  face.triangles.resize(3, 1);
  face.triangles << 0, 1, 2;
  const HoleReport lone = fillHole(face, meshTopology(face).boundaries.front());
  EXPECT_FALSE(lone.ok);
  EXPECT_EQ(face.triangles.cols(), 1);
  EXPECT_EQ(mesh.vertices, before.vertices);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

TEST(HoleFilling, RoughRimsGiveFiniteSoundPatches)
{
  for (unsigned seed = 1; seed <= 10; ++seed)
  {
    TriangleMesh mesh = cutSphere(3, 0.5);
    Random random(seed);
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
      mesh.vertices.col(v) += random.vector(0.01 * seed);   // up to two thirds of an edge
    const TriangleMesh before = mesh;
    const HoleReport report = fillHole(mesh, meshTopology(mesh).boundaries.front());
    ASSERT_TRUE(mesh.vertices.allFinite());
    if (!report.ok)
      EXPECT_TRUE(mesh.vertices == before.vertices && !report.message.empty());
    else
      EXPECT_TRUE(topologyDefects(mesh).empty());
    EXPECT_TRUE(report.ok || seed > 5) << report.message;
  }
}

}   // namespace
}   // namespace slender::test
