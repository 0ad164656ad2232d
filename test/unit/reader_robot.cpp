#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include <gtest/gtest.h>

#include "slender_sim/contact/solids.h"
#include "slender_sim/geometry/mesh_file.h"
#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/robot.h"

/// Robots in the scene file: which obstacles their links become.
namespace slender {
namespace {

namespace fs = std::filesystem;

/// A tetrahedron with corners at the origin and at 1 m on the axes, and its faces seen from outside.
const Eigen::Vector3d kCorners[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

void writeFile(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

std::string asciiStl()
{
  std::ostringstream text;
  text << "solid tetrahedron\n";
  for (const auto& face : kFaces)
  {
    text << " facet normal 0 0 0\n  outer loop\n";
    for (const int corner : face)
      text << "   vertex " << kCorners[corner].transpose() << "\n";
    text << "  endloop\n endfacet\n";
  }
  text << "endsolid\n";
  return text.str();
}

std::string binaryStl()
{
  std::string bytes = "solid by name, and binary all the same";
  bytes.resize(80, ' ');
  const std::uint32_t count = 4;
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  for (const auto& face : kFaces)
  {
    bytes.append(12, '\0');
    for (const int corner : face)
      for (int k = 0; k < 3; ++k)
      {
        const float value = static_cast<float>(kCorners[corner][k]);
        bytes.append(reinterpret_cast<const char*>(&value), 4);
      }
    bytes.append(2, '\0');
  }
  return bytes;
}

/// In centimetres, in a node that is moved by 5 of them along x; its up axis must not matter.
const char* const kCollada = R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries><geometry id="g" name="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0 100 0 0 0 100 0 0 0 100</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
      <p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node id="n"><translate>5 0 0</translate>
    <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
)";

const char* const kArm = R"(<robot name="arm">
  <link name="base"><collision><geometry><cylinder radius="0.1" length="0.4"/></geometry></collision></link>
  <link name="upper">
    <collision><origin xyz="0 0 0.2" rpy="0 1.5707963267948966 0"/><geometry><box size="0.4 0.1 0.2"/></geometry></collision>
    <collision><origin xyz="0 0 0.4"/><geometry><sphere radius="0.06"/></geometry></collision>
  </link>
  <link name="hand">
    <collision><geometry><mesh filename="package://arm_meshes/hand.stl" scale="0.1 0.1 -0.2"/></geometry></collision>
  </link>
  <link name="slide"/>
  <link name="finger"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.5" rpy="0 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="wrist" type="fixed"><parent link="upper"/><child link="hand"/><origin xyz="0 0 0.4"/></joint>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="slide"/>
    <axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="grip" type="prismatic"><parent link="base"/><child link="finger"/><axis xyz="0 0 2"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="rail" multiplier="2" offset="0.5"/></joint>
</robot>)";

std::string replaced(std::string text, const std::string& from, const std::string& to)
{
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class ReaderRobot : public testing::Test
{
protected:
  void SetUp() override
  {
    folder_ = fs::temp_directory_path() / ("reader_robot_" + std::to_string(::getpid()));
    fs::create_directories(folder_ / "meshes");
    writeFile(folder_ / "meshes/hand.stl", asciiStl());
    writeFile(folder_ / "arm.urdf", kArm);
    RobotSources sources;
    sources.package = [this](const std::string& name) {
      return name == "arm_meshes" ? (folder_ / "meshes").string() : "";
    };
    sources.parameter = [this](const std::string& name) {
      const auto found = parameters_.find(name);
      return found == parameters_.end() ? std::nullopt : std::optional<std::string>(found->second);
    };
    setRobotSources(sources);
  }
  void TearDown() override
  {
    setRobotSources({});
    fs::remove_all(folder_);
  }

  SceneConfig read(const std::string& robot) const
  {
    return parseScene(
        "rods: [{centerline: {straight: {from: [2, 2, 2], to: [3, 2, 2]}}, contact: {}}]\nrobot: " + robot + "\n",
        "test.yaml", {}, folder_.string());
  }
  SceneConfig readText(const std::string& urdf)
  {
    parameters_["text"] = urdf;
    return read("{description: text}");
  }
  std::string refusalOf(const std::string& robot) const
  {
    try
    {
      read(robot);
    }
    catch (const SceneError& error)
    {
      return error.what();
    }
    return "";
  }
  std::string refusalOfText(const std::string& urdf)
  {
    parameters_["text"] = urdf;
    return refusalOf("{description: text}");
  }

  fs::path folder_;
  std::map<std::string, std::string> parameters_;
};

const ObstacleConfig& obstacle(const SceneConfig& scene, const std::string& name)
{
  for (const ObstacleConfig& one : scene.obstacles)
    if (one.name == name)
      return one;
  throw std::runtime_error("no obstacle " + name);
}

TEST_F(ReaderRobot, collisionShapesOfLinksAreObstacles)
{
  const SceneConfig scene = read("{description: arm.urdf, friction: 0.7}");
  ASSERT_EQ(scene.obstacles.size(), 4u);
  const auto& base = obstacle(scene, "base");
  EXPECT_EQ(base.link, "base");
  EXPECT_DOUBLE_EQ(base.friction, 0.7);
  EXPECT_DOUBLE_EQ(std::get<Cylinder>(base.shape).radius, 0.1);
  EXPECT_DOUBLE_EQ(std::get<Cylinder>(base.shape).length, 0.4);
  EXPECT_TRUE(base.pose.position.isZero());
  const auto &box = obstacle(scene, "upper_0"), &ball = obstacle(scene, "upper_1");
  EXPECT_EQ(box.link, "upper");
  EXPECT_TRUE(std::get<Box>(box.shape).size.isApprox(Eigen::Vector3d(0.4, 0.1, 0.2)));
  EXPECT_TRUE(box.pose.position.isApprox(Eigen::Vector3d(0, 0, 0.7)));
  EXPECT_TRUE((box.pose * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0, 0, -0.3), 1e-12));
  EXPECT_DOUBLE_EQ(std::get<Sphere>(ball.shape).radius, 0.06);
  EXPECT_TRUE(ball.pose.position.isApprox(Eigen::Vector3d(0, 0, 0.9)));
}

TEST_F(ReaderRobot, meshesAreScaledAndMirrored)
{
  const SceneConfig scene = read("{description: arm.urdf}");
  const auto& mesh = *std::get<std::shared_ptr<const TriangleMesh>>(obstacle(scene, "hand").shape);
  EXPECT_EQ(mesh.vertices.cols(), 4);
  EXPECT_TRUE(mesh.vertices.rowwise().maxCoeff().isApprox(Eigen::Vector3d(0.1, 0.1, 0), 1e-12));
  EXPECT_NEAR(mesh.vertices.row(2).minCoeff(), -0.2, 1e-12);
  // Faces are seen from outside after mirroring, too: the volume is positive.
  EXPECT_NEAR(massProperties(obstacle(scene, "hand").shape).volume, 0.1 * 0.1 * 0.2 / 6, 1e-12);
}

TEST_F(ReaderRobot, meshFilesOfAllKindsHoldTheSameTetrahedron)
{
  writeFile(folder_ / "binary.STL", binaryStl());
  writeFile(folder_ / "ascii.stl", asciiStl());
  writeFile(folder_ / "faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  std::vector<std::string> files{"binary.STL", "ascii.stl", "faces.obj"};
#ifdef SLENDER_WITH_ASSIMP
  writeFile(folder_ / "scene.dae", kCollada);
  files.push_back("scene.dae");
#endif
  for (const std::string& file : files)
  {
    const SceneConfig scene = readText(replaced(kArm, "package://arm_meshes/hand.stl\" scale=\"0.1 0.1 -0.2", file));
    const Shape& shape = obstacle(scene, "hand").shape;
    EXPECT_NEAR(massProperties(shape).volume, 1.0 / 6, 1e-6) << file;
    const auto& mesh = *std::get<std::shared_ptr<const TriangleMesh>>(shape);
    EXPECT_EQ(mesh.triangles.cols(), 4) << file;
    const double along = file == "scene.dae" ? 0.05 : 0.0;
    EXPECT_TRUE(mesh.vertices.rowwise().minCoeff().isApprox(Eigen::Vector3d(along, 0, 0), 1e-6)) << file;
  }
}

TEST_F(ReaderRobot, standsWhereJointsAndPoseSay)
{
  const SceneConfig scene = read(
      "{description: arm.urdf, prefix: left, joints: {shoulder: 1.5707963267948966}, pose: {position: [1, 0, 0], rpy: "
      "[0, 0, "
      "3.141592653589793]}}");
  // the upper arm points along x of the robot, which is -x of the world
  const auto& ball = obstacle(scene, "left/upper_1");
  EXPECT_EQ(ball.link, "left/upper");
  EXPECT_TRUE(ball.pose.position.isApprox(Eigen::Vector3d(0.6, 0, 0.5), 1e-9)) << ball.pose.position.transpose();
}

TEST_F(ReaderRobot, mimickingJointsFollow)
{
  const std::string urdf =
      replaced(kArm, "<link name=\"finger\"/>",
               "<link name=\"finger\"><collision><geometry><sphere radius=\"0.01\"/></geometry></collision></link>");
  EXPECT_NEAR(obstacle(readText(urdf), "finger").pose.position.z(), 0.5, 1e-12);
  parameters_["text"] = urdf;
  EXPECT_NEAR(obstacle(read("{description: text, joints: {rail: 0.1}}"), "finger").pose.position.z(), 0.7, 1e-12);
}

TEST_F(ReaderRobot, ignoredLinksAreLeftOutWithTheirMeshes)
{
  fs::remove(folder_ / "meshes/hand.stl");
  const SceneConfig scene = read("{description: arm.urdf, ignore: [hand, upper]}");
  ASSERT_EQ(scene.obstacles.size(), 1u);
  EXPECT_EQ(scene.obstacles[0].name, "base");
  EXPECT_TRUE(scene.warnings.empty());
  const SceneConfig none = read("{description: arm.urdf, ignore: [hand, upper, base]}");
  ASSERT_EQ(none.warnings.size(), 1u);
  EXPECT_NE(none.warnings[0].find("nothing touches it"), std::string::npos);
}

TEST_F(ReaderRobot, severalRobotsHaveDifferentPrefixes)
{
  EXPECT_EQ(read("[{description: arm.urdf, prefix: left}, {description: arm.urdf, prefix: right}]").obstacles.size(),
            8u);
  EXPECT_NE(
      refusalOf("[{description: arm.urdf}, {description: arm.urdf}]").find("names of bodies and obstacles must differ"),
      std::string::npos);
}

TEST_F(ReaderRobot, aParameterBecomesPartOfTheScene)
{
  parameters_["robot_description"] = kArm;
  const SceneConfig scene = read("{description: robot_description, ignore: [hand]}");
  EXPECT_EQ(scene.obstacles.size(), 3u);
  parameters_.clear();   // as when a bag is replayed
  const SceneConfig again = parseScene(scene.source, "bag");
  ASSERT_EQ(again.obstacles.size(), 3u);
  EXPECT_EQ(again.source, scene.source);
  EXPECT_TRUE(again.obstacles[2].pose.position.isApprox(scene.obstacles[2].pose.position));
}

TEST_F(ReaderRobot, refusesWhatIsMissing)
{
  EXPECT_NE(refusalOf("{description: other_description}").find("no ROS parameter of this name"), std::string::npos);
  EXPECT_NE(refusalOf("{prefix: left}").find("robot.description"), std::string::npos);
  EXPECT_NE(refusalOf("{description: arm.urdf, ignore: [hnad]}").find("no link hnad (did you mean hand?)"),
            std::string::npos);
  EXPECT_NE(refusalOf("{description: arm.urdf, joints: {elbow: 1}}").find("no joint elbow"), std::string::npos);
  EXPECT_NE(refusalOf("{description: arm.urdf, links: [hand]}").find("links"), std::string::npos);
  fs::remove(folder_ / "meshes/hand.stl");
  const std::string no_mesh = refusalOf("{description: arm.urdf}");
  EXPECT_NE(no_mesh.find("link hand: " + (folder_ / "meshes/hand.stl").string()), std::string::npos) << no_mesh;
  EXPECT_NE(refusalOfText(replaced(kArm, "arm_meshes", "no_package")).find("no ROS package no_package"),
            std::string::npos);
  setRobotSources({});
  EXPECT_NE(refusalOf("{description: robot_description}").find("rosparam get -p robot_description"), std::string::npos);
}

TEST_F(ReaderRobot, refusesWhatIsNoTree)
{
  const std::string loop =
      replaced(kArm, "</robot>",
               "<joint name=\"second\" type=\"fixed\"><parent link=\"hand\"/><child link=\"slide\"/></joint></robot>");
  EXPECT_NE(refusalOfText(loop).find("link slide has two parent joints, rail and second"), std::string::npos)
      << refusalOfText(loop);
  const std::string ring =
      replaced(kArm, "</robot>",
               "<link name=\"a\"/><link name=\"b\"/><joint name=\"ab\" type=\"fixed\"><parent link=\"a\"/><child "
               "link=\"b\"/></joint>"
               "<joint name=\"ba\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>");
  EXPECT_NE(refusalOfText(ring).find("is in a loop of joints"), std::string::npos) << refusalOfText(ring);
  EXPECT_NE(refusalOfText("<robot name=\"empty\">").find("is no valid URDF"), std::string::npos);
  EXPECT_NE(refusalOfText(replaced(kArm, "</robot>", "<xacro:if value=\"1\"/></robot>")).find("is a xacro file"),
            std::string::npos);
  const std::string negative = refusalOfText(replaced(kArm, "radius=\"0.06\"", "radius=\"-1\""));
  EXPECT_NE(negative.find("link upper"), std::string::npos) << negative;
}

TEST_F(ReaderRobot, refusesBrokenStlFiles)
{
  const fs::path file = folder_ / "broken.stl";
  const auto refusal = [&](const std::string& content) -> std::string {
    writeFile(file, content);
    try
    {
      readStl(file.string());
    }
    catch (const std::runtime_error& error)
    {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(binaryStl()), "");
  EXPECT_NE(refusal(binaryStl().substr(0, 200)), "");
  EXPECT_NE(refusal("nothing").find("is no STL file"), std::string::npos);
  EXPECT_NE(refusal("solid a\nendsolid").find("has no triangles"), std::string::npos);
  EXPECT_NE(refusal("solid a\nvertex 0 0 x").find("'x' is not a finite number"), std::string::npos);
  EXPECT_NE(refusal("solid a\nvertex 0 0 0\nvertex 1 0 0").find("ends within a triangle"), std::string::npos);
}

}   // namespace
}   // namespace slender
