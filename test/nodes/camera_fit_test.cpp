#include "slender_sim/node/camera_fit.h"

#include <cmath>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "slender_sim/node/node_options.h"
#include "slender_sim/node/scene_markers.h"
#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

constexpr double kAspect = 1.6;

/// What the points take of the picture, seen as rviz does it: width and height over those of the picture, and where the
/// middle is in halves of them.
struct Filled
{
  double width, height, x, y;
};

Filled filled(const std::vector<Eigen::Vector3d>& points, const OrbitView& view)
{
  const Eigen::Vector3d towards_eye(std::cos(view.yaw) * std::cos(view.pitch),
                                    std::sin(view.yaw) * std::cos(view.pitch), std::sin(view.pitch)),
      eye = view.focal_point + view.distance * towards_eye, right(-std::sin(view.yaw), std::cos(view.yaw), 0),
      up = towards_eye.cross(right);
  const double tangent = std::tan(M_PI / 8);
  double x[2] = {1e9, -1e9}, y[2] = {1e9, -1e9};
  for (const Eigen::Vector3d& p : points)
  {
    const double depth = -towards_eye.dot(p - eye);
    EXPECT_GT(depth, 0);
    const double px = right.dot(p - eye) / (depth * tangent * kAspect), py = up.dot(p - eye) / (depth * tangent);
    x[0] = std::min(x[0], px), x[1] = std::max(x[1], px), y[0] = std::min(y[0], py), y[1] = std::max(y[1], py);
  }
  return {0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0]), 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])};
}

OrbitView usualView()
{
  OrbitView view;
  view.yaw = -1.2;
  view.pitch = 0.24;
  return view;
}

class Camera : public testing::TestWithParam<const char*>
{};

TEST_P(Camera, FitsTheScene)
{
  const Simulation simulation(readScene(std::string(SLENDER_SOURCE_DIR) + "/config/scenes/" + GetParam() + ".yaml"),
                              false);
  const std::vector<Eigen::Vector3d> points = pointsToShow(sceneMarkers(simulation, std_msgs::Header(), {}));
  const Filled part = filled(points, fittedView(points, usualView(), kAspect));
  EXPECT_NEAR(std::max(part.width, part.height), 0.45, 0.01);
  EXPECT_NEAR(part.x, 0.0, 0.01);
  EXPECT_NEAR(part.y, 0.0, 0.01);
}

INSTANTIATE_TEST_SUITE_P(All, Camera,
                         testing::Values("hair", "michell_ring", "obstacle_course", "honey_pile", "demo_rope",
                                         "drape_on_box", "sagging", "knot_twist"),
                         [](const auto& info) { return std::string(info.param); });

TEST(CameraFit, ServesPointsOfAllKinds)
{
  const std::vector<std::vector<Eigen::Vector3d>> clouds = {{{1, 2, 3}, {1, 2, 3.004}},   // hardly any extent
                                                            {{0, 0, 0}, {1e3, 0, 0}, {0, 1e3, 0}},   // wide
                                                            {{1e4, 1e4, 0}, {1e4 + 0.1, 1e4, 0}}};   // far away
  for (const auto& points : clouds)
  {
    const Filled part = filled(points, fittedView(points, usualView(), kAspect));
    EXPECT_NEAR(std::max(part.width, part.height), 0.45, 0.01) << points[0].transpose();
  }
  const std::vector<Eigen::Vector3d> towards_eye = {{0.3, -0.9, 0.2}, {-0.3, 0.9, -0.2}};
  const Filled part = filled(towards_eye, fittedView(towards_eye, usualView(), kAspect));
  EXPECT_LE(std::max(part.width, part.height), 0.61);   // it cannot fill more, but all of it is seen
  EXPECT_EQ(fittedView({}, usualView(), kAspect).distance, usualView().distance);
}

TEST(CameraFit, WritesTheViewIntoAConfiguration)
{
  const std::string config = R"(Visualization Manager:
  Displays:
    - {Class: rviz/Grid}
    - {Class: rviz/MarkerArray, Marker Topic: coarse/markers}
    - {Class: rviz/MarkerArray, Marker Topic: fine/markers}
  Views:
    Current: {Class: rviz/Orbit, Distance: 4.5, Focal Point: {X: 9, Y: 9, Z: 9}, Pitch: 0.3, Yaw: -1.2}
)";
  EXPECT_EQ(markerTopics(config), (std::vector<std::string>{"coarse/markers", "fine/markers"}));
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0}, {0.1, 0, 0.1}};
  const std::optional<std::string> fitted = fittedConfig(config, points);
  ASSERT_TRUE(fitted);
  const YAML::Node view = YAML::Load(*fitted)["Visualization Manager"]["Views"]["Current"];
  EXPECT_LT(view["Distance"].as<double>(), 1.0);
  EXPECT_NEAR(view["Focal Point"]["X"].as<double>(), 0.05, 0.05);
  EXPECT_EQ(view["Yaw"].as<double>(), -1.2);
  EXPECT_EQ(markerTopics(*fitted).size(), 2u);
  EXPECT_FALSE(fittedConfig("Visualization Manager: {Views: {Current: {Class: rviz/FPS}}}\n", points));
  EXPECT_FALSE(fittedConfig("[", points));
  EXPECT_FALSE(fittedConfig("", points));
}

}   // namespace
}   // namespace slender
