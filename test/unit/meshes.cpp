// Topology, defects, shapes and files of triangle meshes.
#include <cmath>
#include <cstdio>
#include <fstream>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <unistd.h>

#include "slender_sim/geometry/mesh_defects.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/mesh_topology.h"

namespace slender {
namespace {

TriangleMesh made(std::initializer_list<Eigen::Vector3d> vertices, std::initializer_list<Eigen::Vector3i> faces)
{
  TriangleMesh mesh;
  mesh.vertices.resize(3, vertices.size());
  mesh.triangles.resize(3, faces.size());
  Eigen::Index i = 0;
  for (const auto& v : vertices)
    mesh.vertices.col(i++) = v;
  i = 0;
  for (const auto& f : faces)
    mesh.triangles.col(i++) = f;
  return mesh;
}

const GridPattern kPatterns[] = {GridPattern::one_diagonal, GridPattern::alternating, GridPattern::equilateral,
                                 GridPattern::irregular};

TEST(MeshShapes, GridsCoverTheirRectangleWithSoundFaces)
{
  for (const GridPattern pattern : kPatterns)
    for (const auto& [columns, rows] : {std::pair{2, 2}, {7, 5}, {30, 0}})
    {
      const TriangleMesh mesh = gridMesh(2.0, 1.5, columns, rows, pattern);
      EXPECT_TRUE(meshDefects(mesh).empty()) << toString(pattern) << columns;
      EXPECT_NEAR(faceAreas(mesh).sum(), 3.0, 1e-12);
      EXPECT_NEAR(vertexAreas(mesh).sum(), 3.0, 1e-12);
      EXPECT_NEAR(voronoiAreas(mesh).sum(), 3.0, 1e-12);
      for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
      {
        const auto p = [&](int k) { return mesh.vertices.col(mesh.triangles(k, f)); };
        EXPECT_GT((p(1) - p(0)).cross(p(2) - p(0)).z(), 0);
      }
      const MeshTopology t = meshTopology(mesh);
      EXPECT_EQ(mesh.vertices.cols() - t.edgeCount() + mesh.triangles.cols(), 1);   // Euler: a disc
      ASSERT_EQ(t.boundaries.size(), 1u);
    }
  EXPECT_EQ(gridMesh(1, 1, 159, 159, GridPattern::one_diagonal).vertices.cols(), 25600);
  const TriangleMesh regular = gridMesh(1, 0.866, 10, 0, GridPattern::equilateral);
  // row 1 begins on the side, then half a cell in
  EXPECT_NEAR((regular.vertices.col(0) - regular.vertices.col(12)).norm(), 0.1, 1e-4);
  EXPECT_THROW(gridMesh(0, 1, 3, 3, GridPattern::alternating), std::invalid_argument);
  EXPECT_THROW(gridMesh(1, 1, 0, 3, GridPattern::alternating), std::invalid_argument);
}

TEST(MeshShapes, IrregularIsDelaunayAndRepeats)
{
  const TriangleMesh a = gridMesh(1, 1, 20, 0, GridPattern::irregular, 5),
                     b = gridMesh(1, 1, 20, 0, GridPattern::irregular, 5);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_NE(a.vertices, gridMesh(1, 1, 20, 0, GridPattern::irregular, 6).vertices);
  const MeshTopology t = meshTopology(a);
  for (Eigen::Index h = 0; h < t.hinges.cols(); ++h)
  {
    const auto angle = [&](int at) {
      const Eigen::Vector3d u = a.vertices.col(t.hinges(0, h)) - a.vertices.col(at),
                            v = a.vertices.col(t.hinges(1, h)) - a.vertices.col(at);
      return std::atan2(u.cross(v).norm(), u.dot(v));
    };
    EXPECT_LT(angle(t.hinges(2, h)) + angle(t.hinges(3, h)), M_PI + 1e-6);
  }
}

TEST(MeshShapes, SphereAndDisc)
{
  const TriangleMesh sphere = icosphere(2.0, 3);
  EXPECT_EQ(sphere.vertices.cols(), 642);
  EXPECT_TRUE(meshDefects(sphere).empty());
  EXPECT_LT((sphere.vertices.colwise().norm().array() - 2.0).abs().maxCoeff(), 1e-14);
  EXPECT_NEAR(faceAreas(sphere).sum(), 16 * M_PI, 0.5);
  const MeshTopology t = meshTopology(sphere);
  EXPECT_TRUE(t.boundaries.empty());
  EXPECT_EQ(t.hingeCount(), t.edgeCount());
  EXPECT_EQ(sphere.vertices.cols() - t.edgeCount() + sphere.triangles.cols(), 2);
  for (Eigen::Index f = 0; f < sphere.triangles.cols(); ++f)   // outwards
  {
    const auto p = [&](int k) { return sphere.vertices.col(sphere.triangles(k, f)); };
    EXPECT_GT(p(0).dot(p(1).cross(p(2))), 0);
  }
  const TriangleMesh disc = discMesh(0.15, 12);
  EXPECT_EQ(disc.vertices.cols(), 1 + 3 * 12 * 13);
  EXPECT_TRUE(meshDefects(disc).empty());
  EXPECT_NEAR(faceAreas(disc).sum(), M_PI * 0.15 * 0.15, 3e-4);
  EXPECT_EQ(meshTopology(disc).boundaries.at(0).size(), 72u);
}

TEST(MeshTopology, HingesFaceEachOther)
{
  const TriangleMesh mesh = gridMesh(1, 1, 4, 3, GridPattern::alternating);
  const MeshTopology t = meshTopology(mesh);
  EXPECT_EQ(t.edgeCount(), 4 * 4 + 5 * 3 + 12);
  EXPECT_EQ(t.hingeCount(), t.edgeCount() - 14);
  const auto cross = [&](int a, int b, int c) {
    const Eigen::Vector3d p = mesh.vertices.col(a);
    return (mesh.vertices.col(b) - p).cross(mesh.vertices.col(c) - p).z();
  };
  for (int h = 0; h < t.hingeCount(); ++h)
  {
    const Eigen::Vector4i v = t.hinges.col(h);
    EXPECT_GT(cross(v[0], v[1], v[2]), 0);   // left face
    EXPECT_GT(cross(v[1], v[0], v[3]), 0);
    const int e = t.hinge_edges[h];
    for (int s = 0; s < 2; ++s)
      EXPECT_TRUE((t.face_edges.col(t.edge_faces(s, e)).array() == e).any());
  }
  ASSERT_EQ(t.boundaries.size(), 1u);
  ASSERT_EQ(t.boundaries[0].size(), 14u);
  double area = 0;   // counter-clockwise, once around
  for (std::size_t k = 0; k < 14; ++k)
  {
    const Eigen::Vector3d a = mesh.vertices.col(t.boundaries[0][k]),
                          b = mesh.vertices.col(t.boundaries[0][(k + 1) % 14]);
    EXPECT_LT((a - b).norm(), 0.34);
    area += 0.5 * a.cross(b).z();
  }
  EXPECT_NEAR(area, 1.0, 1e-12);
}

TEST(MeshTopology, ARingHasTwoBoundaries)
{
  TriangleMesh mesh = gridMesh(1, 1, 3, 3, GridPattern::one_diagonal);
  Eigen::Matrix3Xi rim(3, 16);
  Eigen::Index n = 0;
  for (Eigen::Index f = 0; f < 18; ++f)
    if (f != 8 && f != 9)   // the cell in the middle
      rim.col(n++) = mesh.triangles.col(f);
  mesh.triangles = rim;
  const MeshTopology t = meshTopology(mesh);
  ASSERT_EQ(t.boundaries.size(), 2u);
  EXPECT_EQ(t.boundaries[0].size() + t.boundaries[1].size(), 16u);
}

TEST(MeshTopology, FacesMustAgreeInOrientation)
{
  TriangleMesh mesh = gridMesh(1, 1, 6, 5, GridPattern::irregular);
  for (Eigen::Index f = 3; f < mesh.triangles.cols(); f += 4)
    std::swap(mesh.triangles(1, f), mesh.triangles(2, f));
  EXPECT_THROW(meshTopology(mesh), std::invalid_argument);
}

std::vector<MeshDefect> defectsOf(const TriangleMesh& mesh, MeshDefect::Kind kind)
{
  std::vector<MeshDefect> found;
  for (const MeshDefect& defect : meshDefects(mesh))
    if (defect.kind == kind)
      found.push_back(defect);
  return found;
}

TEST(MeshDefects, AreNamed)
{
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0), d(1, 1, 0), e(0, 0, 1);
  const TriangleMesh sound = made({a, b, c, d}, {{0, 1, 2}, {2, 1, 3}});
  EXPECT_TRUE(meshDefects(sound).empty());
  EXPECT_NO_THROW(requireSoundMesh(sound, "sheet"));
  EXPECT_EQ(meshDefects(TriangleMesh()).size(), 1u);   // nothing at all
  EXPECT_EQ(meshDefects(TriangleMesh())[0].kind, MeshDefect::empty);

  const auto degenerate =
      defectsOf(made({a, b, c, {0.5, 1e-9, 0}}, {{0, 1, 2}, {1, 0, 3}}), MeshDefect::degenerate_face);
  ASSERT_EQ(degenerate.size(), 1u);
  EXPECT_EQ(degenerate[0].message,
            "face 1 (vertices 1, 0 and 3, from 0) has (nearly) no area; merge its vertices or remove it");

  const TriangleMesh book = made({a, b, c, d, e}, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  const auto spine = defectsOf(book, MeshDefect::non_manifold_edge);
  ASSERT_EQ(spine.size(), 1u);
  EXPECT_EQ(spine[0].vertices, (std::vector<int>{0, 1}));
  EXPECT_EQ(spine[0].faces, (std::vector<int>{0, 1, 2}));
  EXPECT_NE(spine[0].message.find("vertices 0 and 1 (from 0) has 3 faces: 0, 1 and 2"), std::string::npos)
      << spine[0].message;
  EXPECT_THROW(meshTopology(book), std::invalid_argument);

  const auto opposed = defectsOf(made({a, b, c, d}, {{0, 1, 2}, {1, 2, 3}}), MeshDefect::opposed_faces);
  ASSERT_EQ(opposed.size(), 1u);
  EXPECT_EQ(opposed[0].faces, (std::vector<int>{0, 1}));

  const auto touch =
      defectsOf(made({a, b, c, {-1, 0, 0}, {0, -1, 0}}, {{0, 1, 2}, {0, 3, 4}}), MeshDefect::non_manifold_vertex);
  ASSERT_EQ(touch.size(), 1u);
  EXPECT_EQ(touch[0].vertices, std::vector<int>{0});

  const auto twins = defectsOf(made({a, b, c, d, b + Eigen::Vector3d(1e-11, 0, 0), c}, {{0, 1, 2}, {5, 4, 3}}),
                               MeshDefect::duplicate_vertices);
  ASSERT_EQ(twins.size(), 2u);
  EXPECT_EQ(twins[0].vertices, (std::vector<int>{1, 4}));
  EXPECT_EQ(twins[1].vertices, (std::vector<int>{2, 5}));

  const auto loose = defectsOf(made({a, b, e, c}, {{0, 1, 3}}), MeshDefect::unreferenced_vertex);
  ASSERT_EQ(loose.size(), 1u);
  EXPECT_EQ(loose[0].vertices, std::vector<int>{2});

  EXPECT_EQ(defectsOf(made({a, b, c}, {{0, 1, 3}}), MeshDefect::bad_index).size(), 1u);
  EXPECT_EQ(defectsOf(made({a, b, c}, {{0, 1, 1}}), MeshDefect::bad_index).size(), 1u);
  EXPECT_EQ(defectsOf(made({a, b, {0, NAN, 0}}, {{0, 1, 2}}), MeshDefect::not_finite).size(), 1u);
  EXPECT_EQ(defectsOf(made({a, b, c}, {}), MeshDefect::empty).size(), 1u);
  try
  {
    requireSoundMesh(book, "cloth 'shirt'");
    FAIL();
  }
  catch (const std::invalid_argument& error)
  {
    EXPECT_EQ(std::string(error.what()).find("cloth 'shirt': the edge"), 0u) << error.what();
  }
}

class MeshFiles : public testing::Test
{
protected:
  void TearDown() override { std::remove(path_.c_str()); }
  void write(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }
  std::string problem()
  {
    try
    {
      readMesh(path_);
    }
    catch (const std::runtime_error& error)
    {
      EXPECT_EQ(std::string(error.what()).find(path_ + ": "), 0u) << error.what();
      return std::string(error.what()).substr(path_.size() + 2);
    }
    return "";
  }
  std::string path_ = testing::TempDir() + "/slender_sim_meshes_" + std::to_string(getpid()) + ".PLY";
};

TEST_F(MeshFiles, RoundTripsToTheBit)
{
  TriangleMesh mesh = gridMesh(1, 1, 5, 0, GridPattern::irregular);
  mesh.vertices.row(2).setLinSpaced(-1e-17, 3e200);
  for (const char* suffix : {".PLY", ".obj"})
  {
    std::remove(path_.c_str());
    path_.replace(path_.size() - 4, 4, suffix);
    writeMesh(path_, mesh);
    const TriangleMesh back = readMesh(path_);
    EXPECT_EQ(back.vertices, mesh.vertices) << suffix;
    EXPECT_EQ(back.triangles, mesh.triangles) << suffix;
  }
  EXPECT_THROW(writePly("/nonexistent/folder/a.ply", mesh), std::runtime_error);
  EXPECT_THROW(readMesh("shirt.stl"), std::runtime_error);
}

const std::string kHead =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty uchar red\nproperty "
    "float y\n"
    "property float z\nelement edge 1\nproperty int a\nelement face 1\nproperty list uchar float weights\n"
    "property list uchar int vertex_index\nend_header\n";

TEST_F(MeshFiles, ReadsAsciiPlyWithForeignProperties)
{
  write(kHead + "0 255 0 0\n1 0 0 0.5\n+1 3 1 0\n0 3 1e0 0\n7\n2 0.5 0.5 4 0 1 2 3\n");
  const TriangleMesh mesh = readMesh(path_);
  EXPECT_EQ(mesh.vertices.col(1), Eigen::Vector3d(1, 0, 0.5));
  ASSERT_EQ(mesh.triangles.cols(), 2);
  EXPECT_EQ(mesh.triangles.col(1), Eigen::Vector3i(0, 2, 3));
}

TEST_F(MeshFiles, ReadsBinaryPlyOfEitherOrder)
{
  for (const bool big : {false, true})
  {
    std::string text = std::string("ply\r\nformat binary_") + (big ? "big" : "little") +
                       "_endian 1.0\r\nelement vertex 3\r\nproperty float x\r\n" +
                       "property double y\r\nproperty short z\r\nelement face 1\r\nproperty list uchar uint "
                       "vertex_indices\r\nend_header\r\n";
    const auto put = [&](const void* value, int bytes) {
      const char* b = static_cast<const char*>(value);
      for (int k = 0; k < bytes; ++k)
        text += b[big ? bytes - 1 - k : k];
    };
    for (int i = 0; i < 3; ++i)
    {
      const float x = 0.25f + i;
      const double y = i * i - 0.1;
      const std::int16_t z = -i;
      put(&x, 4);
      put(&y, 8);
      put(&z, 2);
    }
    text += '\3';
    for (std::uint32_t v : {0u, 1u, 2u})
      put(&v, 4);
    write(text);
    const TriangleMesh mesh = readMesh(path_);
    EXPECT_EQ(mesh.vertices.col(2), Eigen::Vector3d(2.25, 3.9, -2)) << big;
    EXPECT_EQ(mesh.triangles.col(0), Eigen::Vector3i(0, 1, 2));
  }
}

TEST_F(MeshFiles, NamesWhatIsWrongWithPly)
{
  const std::string vertices = "0 0 0 0\n1 0 0 0\n1 0 1 0\n0 0 1 0\n7\n";
  write("solid\n");
  EXPECT_EQ(problem(), "is not a PLY file: the first line must be 'ply'");
  write(kHead.substr(0, 60));
  EXPECT_EQ(problem(), "the header has no end (end_header)");
  write(kHead + "0 0 0 0\n1 0");
  EXPECT_EQ(problem(), "ends early");
  write(kHead + "0 0 x 0\n");
  EXPECT_EQ(problem(), "'x' is not a number");
  write(kHead + "0 0 nan 0\n1");
  EXPECT_EQ(problem(), "vertex 0 (from 0) is not finite");
  write(kHead + vertices + "0 2 0 1\n");
  EXPECT_EQ(problem(), "face 0 (from 0) with 2 vertices; must have at least 3");
  write(kHead + vertices + "0 3 0 1 0\n");
  EXPECT_EQ(problem(), "face 0 (from 0) has a vertex twice");
  write(kHead + vertices + "0 3 0 1 4\n");
  EXPECT_EQ(problem(), "a face names a vertex that the file does not have: there are 4");
  write(kHead + vertices + "0 3 0 1 -1\n");
  EXPECT_EQ(problem(), "face 0 (from 0) names a vertex that the file does not have");
  write("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n");
  EXPECT_EQ(problem(), "header: element vertex has no properties x, y, z");
  write("ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\nend_header\n0\n");
  EXPECT_EQ(problem(), "header: unknown type 'real'");
  write("ply\nformat utf8 1.0\nend_header\n0\n");
  EXPECT_EQ(problem(), "header: format 'utf8'; must be ascii, binary_little_endian or binary_big_endian");
}

}   // namespace
}   // namespace slender
