#include "slender_sim/geometry/mesh_file.h"

#include <fstream>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <unistd.h>

namespace slender {
namespace {

class MeshFile : public testing::Test
{
protected:
  void SetUp() override { path_ = testing::TempDir() + "/slender_sim_mesh_" + std::to_string(getpid()) + ".obj"; }
  void TearDown() override { std::remove(path_.c_str()); }

  std::string problemOf(const std::string& text) const
  {
    std::ofstream(path_) << text;
    try
    {
      readObj(path_);
    }
    catch (const std::runtime_error& error)
    {
      std::string message = error.what();
      EXPECT_EQ(message.find(path_), 0u) << message;
      return message.substr(std::min(path_.size(), message.size()));
    }
    return "";
  }

  std::string path_;
};

TEST_F(MeshFile, readsPolygonsAndKeepsTheOrderOfVertices)
{
  const TriangleMesh mesh = readObj(std::string(SLENDER_SOURCE_DIR) + "/test/unit/data/cube.obj");
  ASSERT_EQ(mesh.vertices.cols(), 9);
  EXPECT_EQ(mesh.vertices.col(4), Eigen::Vector3d(5, 5, 5));   // used by no face
  EXPECT_EQ(mesh.vertices.col(8), Eigen::Vector3d(0, 1, 1));
  ASSERT_EQ(mesh.triangles.cols(), 12);
  EXPECT_EQ(mesh.triangles.col(0), Eigen::Vector3i(3, 2, 1));
  EXPECT_EQ(mesh.triangles.col(1), Eigen::Vector3i(3, 1, 0));
  EXPECT_EQ(mesh.triangles.col(2), Eigen::Vector3i(5, 6, 7));   // v//vn
  EXPECT_EQ(mesh.triangles.col(8), Eigen::Vector3i(3, 8, 7));   // counted back from the ninth, over two lines
  double volume = 0;
  for (Eigen::Index i = 0; i < mesh.triangles.cols(); ++i)
  {
    const auto p = [&](int k) { return mesh.vertices.col(mesh.triangles(k, i)); };
    volume += p(0).dot(p(1).cross(p(2))) / 6;
  }
  EXPECT_NEAR(volume, 1, 1e-14);
}

TEST_F(MeshFile, readsGroupsByTheirFaces)
{
  std::ofstream(path_)
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\ng foot left\nf 2 1 4\ng left\nf 1 3 4\ng default\nf 2 4 3\n";
  const std::vector<VertexGroup> groups = readObjGroups(path_);
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].name, "foot");
  EXPECT_EQ(groups[0].vertices, (std::vector<int>{0, 1, 3}));
  EXPECT_EQ(groups[1].name, "left");
  EXPECT_EQ(groups[1].vertices, (std::vector<int>{0, 1, 2, 3}));
}

TEST_F(MeshFile, namesFileLineAndReason)
{
  EXPECT_NE(problemOf("").find(": has no faces"), std::string::npos);
  EXPECT_EQ(problemOf("v 0 0 0\nv 1 0\n"), ":2: vertex 2: '' is not a finite number; must be v X Y Z");
  EXPECT_EQ(problemOf("v 0 0 1e999\n"), ":1: vertex 1: '1e999' is not a finite number; must be v X Y Z");
  EXPECT_EQ(problemOf("v 0 0 nan\n"), ":1: vertex 1: 'nan' is not a finite number; must be v X Y Z");
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_EQ(problemOf(three + "f 1 2 3\n"), "");
  EXPECT_EQ(problemOf(three + "f 1 2\n"), ":4: face with 2 vertices; must have at least 3");
  EXPECT_EQ(problemOf(three + "f 1 2 2\n"), ":4: face with vertex 2 twice");
  EXPECT_EQ(problemOf(three + "f 1 2 4\n"), ":4: face vertex 4; the file has 3 vertices");
  EXPECT_EQ(problemOf(three + "f 0 1 2\n"),
            ":4: face vertex '0'; must be a whole number from 1, or negative and then at least -3");
  EXPECT_EQ(problemOf(three + "f 1 2 -4\n"),
            ":4: face vertex '-4'; must be a whole number from 1, or negative and then at least -3");
  EXPECT_EQ(problemOf(three + "f a b c\n"),
            ":4: face vertex 'a'; must be a whole number from 1, or negative and then at least -3");
  EXPECT_EQ(problemOf("f 1 2 3\n" + three), "");   // vertices may come later
  std::remove(path_.c_str());
  EXPECT_THROW(readObj(path_), std::runtime_error);
}

}   // namespace
}   // namespace slender
