#include "slender_sim/scene/shapes.h"

#include <unistd.h>

#include <cmath>
#include <fstream>
#include <stdexcept>

#include <gtest/gtest.h>

#include "slender_sim/geometry/curves.h"
#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

RodConfig rodOf(const std::string& yaml) { return parseScene("rods: [" + yaml + "]").rods.at(0); }

const Eigen::Vector3d gravity(0, 0, -9.81);

TEST(Shapes, aFullCircleClosesWithoutADoubleNode)
{
  const auto nodes =
      restNodes(rodOf("{closed: true, centerline: {arc: {angle: 6.283185307179586, edges: 20}}}"), gravity);
  ASSERT_EQ(nodes.cols(), 20);
  const auto lengths = edgeLengths(nodes, true);
  EXPECT_NEAR(lengths.maxCoeff(), lengths.minCoeff(), 1e-14);
}

TEST(Shapes, initialShapeGetsTheRestSpacing)
{
  const RodConfig rod = rodOf(
      "{centerline: {polyline: {points: [[0, 0, 0], [0.1, 0, 0], [0.4, 0, 0], [1, 0, 0]]}},"
      " initial: {straight: {from: [0, 0, 0], to: [0, 0, 2]}}}");
  const auto rest = restNodes(rod, gravity);
  const auto initial = initialNodes(rod, rest, gravity);
  ASSERT_EQ(initial.cols(), 4);
  EXPECT_NEAR(initial(2, 1), 0.2, 1e-14);
  EXPECT_NEAR(initial(2, 2), 0.8, 1e-14);
}

TEST(Shapes, initialPointsOfTheRightNumberAreKept)
{
  const RodConfig rod = rodOf(
      "{centerline: {straight: {edges: 2}}, initial: {polyline: {points: [[0, 0, 0], [0.4, 0.1, 0], [0.9, 0, 0]]}}}");
  EXPECT_EQ(initialNodes(rod, restNodes(rod, gravity), gravity).col(1), Eigen::Vector3d(0.4, 0.1, 0));
}

TEST(Shapes, initialShapeOfALoop)
{
  const RodConfig rod = rodOf(
      "{closed: true, centerline: {arc: {angle: 6.283185307179586, edges: 12}},"
      " initial: {polyline: {points: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]}}}");
  const auto initial = initialNodes(rod, restNodes(rod, gravity), gravity);
  ASSERT_EQ(initial.cols(), 12);
  EXPECT_LT((initial.col(3) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
}

TEST(Shapes, catenaryHangsAlongGravity)
{
  const RodConfig rod = rodOf("{centerline: {catenary: {length: 1.5}}}");
  EXPECT_LT(restNodes(rod, {0, 0, -1}).row(2).minCoeff(), -0.3);
  EXPECT_GT(restNodes(rod, {0, 2, 0}).row(1).maxCoeff(), 0.3);
  EXPECT_LT(restNodes(rod, {0, 0, 0}).row(2).minCoeff(), -0.3);
}

TEST(Shapes, sectionsOfAnEllipse)
{
  RodConfig rod;
  rod.cross_section = {{0.02}, {0.01}};
  rod.material.density = 1000;
  rod.material.youngs_modulus = 3e6;
  rod.material.poissons_ratio = 0.5;   // G = 1e6
  const double area = M_PI * 0.02 * 0.01;
  RodSection s = rodSections(rod, 3)[1];
  EXPECT_DOUBLE_EQ(s.linear_density, 1000 * area);
  EXPECT_DOUBLE_EQ(s.stretch_modulus, 3e6 * area);
  // Second moments of an ellipse: pi a^3 b / 4 about the axis across d1, pi a b^3 / 4 about the other.
  EXPECT_NEAR(s.bend_modulus(0, 0), 3e6 * M_PI * 0.02 * 0.02 * 0.02 * 0.01 / 4, 1e-12);
  EXPECT_NEAR(s.bend_modulus(1, 1), 3e6 * M_PI * 0.02 * 0.01 * 0.01 * 0.01 / 4, 1e-12);
  EXPECT_EQ(s.bend_modulus(0, 1), 0.0);
  EXPECT_NEAR(s.twist_modulus, 1e6 * area * (4e-4 + 1e-4) / 4, 1e-12);
  rod.material.torsion = Torsion::saint_venant;
  s = rodSections(rod, 3)[1];
  EXPECT_NEAR(s.twist_modulus, 1e6 * M_PI * 8e-6 * 1e-6 / (4e-4 + 1e-4), 1e-12);
}

TEST(Shapes, aCircleTwistsAlikeEitherWay)
{
  RodConfig rod;
  const double polar = rodSections(rod, 1)[0].twist_modulus;
  rod.material.torsion = Torsion::saint_venant;
  EXPECT_NEAR(rodSections(rod, 1)[0].twist_modulus, polar, 1e-15 + 1e-12 * polar);
}

TEST(Shapes, givenModuliTakeThePlaceOfDerivedOnes)
{
  const RodConfig rod =
      rodOf("{material: {linear_density: 0.1, stretch_modulus: 2, bend_modulus: [3, 4], twist_modulus: 5}}");
  const RodSection s = rodSections(rod, 50)[0];
  EXPECT_EQ(s.linear_density, 0.1);
  EXPECT_EQ(s.stretch_modulus, 2);
  EXPECT_EQ(s.bend_modulus(1, 1), 4);
  EXPECT_EQ(s.twist_modulus, 5);
}

TEST(Shapes, taperAndPerEdge)
{
  EXPECT_EQ(perEdge({1, 3}, 3, "r"), (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(perEdge({1}, 3, "r"), (std::vector<double>{1, 1, 1}));
  EXPECT_EQ(perEdge({1, 5, 2}, 3, "r"), (std::vector<double>{1, 5, 2}));
  EXPECT_THROW(perEdge({1, 5, 2}, 4, "r"), std::invalid_argument);
  EXPECT_THROW(perEdge({}, 4, "r"), std::invalid_argument);
}

class PoseFile : public testing::Test
{
protected:
  std::string write(const std::string& text)
  {
    path_ = testing::TempDir() + "/slender_sim_pose_file_" + std::to_string(getpid()) + ".csv";
    std::ofstream(path_) << text;
    return path_;
  }
  std::string problem(const std::string& text)
  {
    try
    {
      readPoseFile(write(text));
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }
  void TearDown() override { std::remove(path_.c_str()); }
  std::string path_;
};

TEST_F(PoseFile, readsBodiesInOrder)
{
  const auto bodies =
      readPoseFile(write("# units\nt,body,x,y,z,qx,qy,qz,qw\n0,b,1,2,3,0,0,0,1\n0,a,0,0,0,0,0,0,1\n\n"
                         "0.5, b, 2,2,3, 0,0,0,-1\r\n"));
  ASSERT_EQ(bodies.size(), 2u);
  EXPECT_EQ(bodies[0].body, "b");
  EXPECT_EQ(bodies[0].poses.size(), 2u);
  EXPECT_EQ(bodies[0].poses.evaluate(0.5).position, Eigen::Vector3d(2, 2, 3));
}

TEST_F(PoseFile, refusesBadLinesWithTheirNumber)
{
  EXPECT_NE(problem("0,b,1,2,3,0,0,0\n").find(":1: has 8 columns; must have 9"), std::string::npos);
  EXPECT_NE(problem("# c\n0,b,1,2,x,0,0,0,1\n").find(":2: z = 'x' is not a number"), std::string::npos);
  EXPECT_NE(problem("0,b,1,2,nan,0,0,0,1\n").find("z = 'nan' is not finite"), std::string::npos);
  EXPECT_NE(problem("0,b,1,2,3,0,0,0,0.9\n").find("quaternion's length is 0.9"), std::string::npos);
  EXPECT_NE(problem("0,b,1,2,3,0,0,0,1\n0,b,1,2,3,0,0,0,1\n").find(":2: "), std::string::npos);
  EXPECT_NE(problem("0,b,1,2,3,0,0,0,1\n1,b,1,2,3,0,0,1,0\n").find("turns by 180 degrees"), std::string::npos);
  EXPECT_NE(problem("0,,1,2,3,0,0,0,1\n").find("body is empty"), std::string::npos);
  EXPECT_NE(problem("# nothing\n").find("has no poses"), std::string::npos);
}

TEST_F(PoseFile, drivesAGrasp)
{
  const std::string path = write("0,hand,0,0,0,0,0,0,1\n1,hand,0,0,1,0,0,0,1\n");
  const std::string scene = "rods: [{grasps: {g: {edges: [0], motion: {file: " + path + ", body: BODY}}}}]";
  const auto grasp = parseScene(scene, "t", {"rods.0.grasps.g.motion.body=hand"}).rods[0].grasps[0];
  EXPECT_EQ(std::get<TableMotion>(grasp.motion).poses.evaluate(2).position.z(), 1.0);
  try
  {
    parseScene(scene);
    FAIL() << "an unknown body was accepted";
  }
  catch (const SceneError& error)
  {
    EXPECT_NE(std::string(error.what()).find("it has: hand"), std::string::npos) << error.what();
  }
}

// `body` chooses one of several; the only one in a file needs no choice.
TEST_F(PoseFile, ofOneBodyNeedsNoName)
{
  const auto scene = [](const std::string& path) {
    return "rods: [{grasps: {g: {edges: [0], motion: {file: " + path +
           "}}}}]\nobstacles: [{name: o, shape: {sphere: {radius: 1}}, motion: {file: " + path + "}}]\n";
  };
  const SceneConfig config = parseScene(scene(write("0,hand,0,0,0,0,0,0,1\n1,hand,0,0,1,0,0,0,1\n")));
  EXPECT_EQ(std::get<TableMotion>(config.rods[0].grasps[0].motion).poses.evaluate(2).position.z(), 1.0);
  EXPECT_EQ(std::get<TableMotion>(config.obstacles[0].motion).poses.evaluate(2).position.z(), 1.0);
  try
  {
    parseScene(scene(write("0,hand,0,0,0,0,0,0,1\n0,foot,0,0,1,0,0,0,1\n")));
    FAIL() << "a file of two bodies was accepted";
  }
  catch (const SceneError& error)
  {
    const std::string text = error.what();
    EXPECT_NE(text.find("rods.0.grasps.g.motion.body: is missing; "), std::string::npos) << text;
    EXPECT_NE(text.find("obstacles.0.motion.body: is missing; "), std::string::npos) << text;
    EXPECT_NE(text.find("holds several bodies, of which it names one: "), std::string::npos) << text;
  }
}

}   // namespace
}   // namespace slender
