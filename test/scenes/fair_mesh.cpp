#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "test/support/shell.h"

#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/mesh_topology.h"

/// The program itself: exit codes, messages, files.
namespace {

namespace fs = std::filesystem;
using slender::TriangleMesh;

using slender::test::Result;

class FairMesh : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = testing::TempDir() + "/slender_sim_fair_mesh_" + std::to_string(getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result run(const std::string& arguments)
  {
    return slender::test::shell("cd " + folder_ + " && " + SLENDER_FAIR_MESH + " " + arguments);
  }

  /// A sphere without the faces above `height`.
  void writeCup(const std::string& name, double height)
  {
    TriangleMesh mesh = slender::icosphere(1.0, 2);
    Eigen::Index kept = 0;
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
      if (mesh.vertices(2, mesh.triangles(0, f)) < height && mesh.vertices(2, mesh.triangles(1, f)) < height &&
          mesh.vertices(2, mesh.triangles(2, f)) < height)
        mesh.triangles.col(kept++) = mesh.triangles.col(f).eval();
    // vertices that are left over would be defects
    TriangleMesh cup;
    cup.triangles = mesh.triangles.leftCols(kept);
    std::vector<int> number(mesh.vertices.cols(), -1);
    int count = 0;
    for (Eigen::Index k = 0; k < cup.triangles.size(); ++k)
      if (int& v = number[cup.triangles.data()[k]]; v < 0)
        v = count++;
    cup.vertices.resize(3, count);
    for (std::size_t v = 0; v < number.size(); ++v)
      if (number[v] >= 0)
        cup.vertices.col(number[v]) = mesh.vertices.col(static_cast<Eigen::Index>(v));
    for (Eigen::Index k = 0; k < cup.triangles.size(); ++k)
      cup.triangles.data()[k] = number[cup.triangles.data()[k]];
    slender::writeMesh(folder_ + "/" + name, cup);
  }

  std::string folder_;
};

TEST_F(FairMesh, SmoothsAndSaysWhatItDid)
{
  TriangleMesh rough = slender::icosphere(1.0, 2);
  for (Eigen::Index v = 0; v < rough.vertices.cols(); ++v)
    rough.vertices.col(v) *= 1.0 + 0.02 * (v % 3);
  slender::writeMesh(folder_ + "/rough.obj", rough);
  const Result result = run("rough.obj smooth.ply --steps 4 --smoothing 0.5");
  EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_NE(result.output.find("steps             4"), std::string::npos) << result.output;
  const TriangleMesh smooth = slender::readMesh(folder_ + "/smooth.ply");
  EXPECT_EQ(smooth.triangles, rough.triangles);
  const Eigen::VectorXd radii = smooth.vertices.colwise().norm();
  EXPECT_LT(radii.maxCoeff() / radii.minCoeff(), 1.01);   // was 1.04
  EXPECT_EQ(run("rough.obj quiet.obj --quiet").output, "");
}

TEST_F(FairMesh, FillsHolesAndLeavesLongOnesOpen)
{
  writeCup("cup.ply", 0.6);
  ASSERT_EQ(run("cup.ply closed.obj --fill-holes").status, 0);
  const TriangleMesh closed = slender::readMesh(folder_ + "/closed.obj");
  EXPECT_TRUE(slender::meshTopology(closed).boundaries.empty());
  EXPECT_NEAR(closed.vertices.row(2).maxCoeff(), 1.0, 0.02);   // edges of 0.3: sagitta 0.011
  const Result open = run("cup.ply open.obj --fill-holes --largest-hole 5");
  EXPECT_EQ(open.status, 0);
  EXPECT_NE(open.output.find("1 left open"), std::string::npos) << open.output;
}

TEST_F(FairMesh, OnlyTheRegionMoves)
{
  TriangleMesh rough = slender::icosphere(1.0, 3);
  for (Eigen::Index v = 0; v < rough.vertices.cols(); ++v)
    rough.vertices.col(v) *= 1.0 + 0.01 * (v % 3);
  slender::writeMesh(folder_ + "/rough.obj", rough);
  ASSERT_EQ(run("rough.obj smooth.obj --region 0,0,1,0.5").status, 0);
  const TriangleMesh smooth = slender::readMesh(folder_ + "/smooth.obj");
  int moved = 0;
  for (Eigen::Index v = 0; v < rough.vertices.cols(); ++v)
  {
    const bool inside = (rough.vertices.col(v) - Eigen::Vector3d(0, 0, 1)).norm() <= 0.5;
    EXPECT_TRUE(inside || smooth.vertices.col(v) == rough.vertices.col(v)) << v;
    moved += smooth.vertices.col(v) != rough.vertices.col(v);
  }
  EXPECT_GT(moved, 20);
}

TEST_F(FairMesh, RefusesBadInputByName)
{
  writeCup("cup.obj", 0.6);
  std::ofstream(folder_ + "/fin.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 2 1 4\nf 1 2 5\n";
  const std::pair<const char*, const char*> cases[] = {
      {"", "usage"},
      {"cup.obj", "usage"},
      {"none.obj out.obj", "none.obj: cannot be opened"},
      {"cup.obj out.stl", "out.stl"},
      {"fin.obj out.obj", "fin.obj: the edge between vertices 0 and 1"},
      {"cup.obj out.obj --steps 1.5", "--steps 1.5"},
      {"cup.obj out.obj --smoothing 0", "--smoothing 0"},
      {"cup.obj out.obj --region 1,2,3", "--region 1,2,3"},
      {"cup.obj out.obj --region 9,9,9,1", "no vertex may move"},
      {"cup.obj out.obj --turbo", "--turbo"},
      {"cup.obj out.obj --steps", "value is missing"}};
  for (const auto& [arguments, expected] : cases)
  {
    const Result result = run(arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    EXPECT_EQ(result.output.compare(0, 11, "fair_mesh: "), 0) << result.output;
    EXPECT_NE(result.output.find(expected), std::string::npos) << arguments << "\n" << result.output;
    EXPECT_FALSE(fs::exists(folder_ + "/out.obj"));
  }
  EXPECT_EQ(run("--help").status, 0);
}

TEST_F(FairMesh, FailuresExitWith3AndWriteNothing)
{
  std::ofstream(folder_ + "/face.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const Result result = run("face.obj out.obj --fill-holes");
  EXPECT_EQ(result.status, 3);
  EXPECT_NE(result.output.find("the hole of 3 edges"), std::string::npos) << result.output;
  EXPECT_FALSE(fs::exists(folder_ + "/out.obj"));
}

}   // namespace
