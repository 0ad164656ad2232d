#include <map>

#include <gtest/gtest.h>

#include "slender_sim/node/converters.h"
#include "slender_sim/node/scene_markers.h"
#include "slender_sim/scene/reader.h"

namespace slender {
namespace {

using visualization_msgs::Marker;

/// Volume enclosed by a triangle list; positive when the triangles face outwards.
double volumeOf(const Marker& marker)
{
  double volume = 0;
  for (std::size_t k = 0; k + 2 < marker.points.size(); k += 3)
  {
    const Eigen::Vector3d a = fromMessage(marker.points[k]), b = fromMessage(marker.points[k + 1]), c = fromMessage(marker.points[k + 2]);
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

TEST(Markers, solidsHaveTheirShapeAndPlace)
{
  const Simulation simulation(parseScene(R"(
rods: [{}]
obstacles:
  - {name: floor, shape: {plane: {}}, pose: {position: [0, 0, -3]}}
  - {name: ball, shape: {sphere: {radius: 0.1}}, pose: {position: [1, 2, 3]}}
  - {name: crate, shape: {box: {size: [1, 2, 3]}}}
  - {name: drum, shape: {cylinder: {radius: 0.2, length: 0.5}}}
  - {name: log, shape: {capsule: {radius: 0.2, length: 0.5}}, pose: {position: [0, 0, 1], rpy: [1, 0, 0]}}
bodies:
  - {name: point, mass: 1, inertia: [1, 1, 1]}
  - {name: cube, density: 1, shape: {mesh: {file: cube.obj}}, pose: {position: [5, 0, 0]}}
)", "scene", {}, std::string(SLENDER_SOURCE_DIR) + "/test/unit/data"));
  std::map<std::pair<std::string, int>, Marker> markers;
  for (const Marker& marker : sceneMarkers(simulation, std_msgs::Header(), MarkerStyle::line, false).markers)
    markers[{marker.ns, marker.id}] = marker;
  ASSERT_EQ(markers.size(), 1u + 5u + 1u);   // no picture of the body without a shape
  const Marker& floor = markers[{"obstacles", 0}];
  EXPECT_EQ(floor.type, Marker::TRIANGLE_LIST);
  EXPECT_EQ(floor.pose.position.z, -3);
  ASSERT_EQ(floor.points.size(), 6u);
  EXPECT_EQ(floor.points[4].z, 0);
  EXPECT_GT(floor.colors[0].r, 0.6f);   // shines upwards
  EXPECT_EQ((markers[{"obstacles", 1}].type), Marker::SPHERE);
  EXPECT_EQ((markers[{"obstacles", 1}].scale.x), 0.2);
  EXPECT_EQ((markers[{"obstacles", 1}].pose.position.y), 2);
  EXPECT_EQ((markers[{"obstacles", 2}].scale.y), 2);
  EXPECT_EQ((markers[{"obstacles", 3}].type), Marker::CYLINDER);
  EXPECT_EQ((markers[{"obstacles", 3}].scale.z), 0.5);
  const Marker& log = markers[{"obstacles", 4}];
  EXPECT_EQ(log.pose.position.z, 1);
  const double exact = M_PI * 0.04 * 0.5 + 4.0 / 3.0 * M_PI * 0.008;
  EXPECT_NEAR(volumeOf(log), exact, 0.03 * exact);
  EXPECT_LT(volumeOf(log), exact);   // its corners lie on the capsule
  EXPECT_EQ(log.colors.size(), log.points.size());
  const Marker& cube = markers[{"bodies", 1}];
  EXPECT_NEAR(volumeOf(cube), 1, 1e-12);
  EXPECT_NEAR(cube.pose.position.x, 5, 1e-12);   // the mesh stays where the scene puts it
}

TEST(Markers, threadsAreTubesOrLinesOfBoundedSize)
{
  const std::string thread = "centerline: {straight: {to: [0.1, 0, 0], edges: 3000}}, radius: 0.002, ends: {oldest: held}}";
  const Simulation simulation(parseScene("threads:\n  - {name: a, " + thread + "\n  - {name: b, " + thread, "scene"));
  int erased = 0, tubes = 0;
  std::size_t triangles = 0;
  const auto markers = sceneMarkers(simulation, std_msgs::Header(), MarkerStyle::tube, false).markers;
  for (const Marker& marker : markers)
  {
    erased += marker.action == Marker::DELETEALL;
    if (marker.action != Marker::ADD)
      continue;
    ++tubes;
    triangles += marker.points.size() / 3;
    EXPECT_NEAR(volumeOf(marker), M_PI * 4e-6 * 0.1, 0.11 * M_PI * 4e-6 * 0.1);   // an octagon has 0.9 of a circle's area
  }
  EXPECT_EQ(markers.front().action, Marker::DELETEALL);   // rviz takes all away then, whatever the namespace
  EXPECT_EQ(erased, 1);
  EXPECT_EQ(tubes, 2);
  EXPECT_LT(triangles, 60000u);
  for (const Marker& marker : sceneMarkers(simulation, std_msgs::Header(), MarkerStyle::line, false).markers)
    if (marker.action == Marker::ADD)
    {
      EXPECT_EQ(marker.type, Marker::LINE_STRIP);
      EXPECT_NEAR(marker.scale.x, 0.004, 1e-9);
      EXPECT_NEAR(marker.points.back().x, 0.1, 1e-12);
    }
}

}  // namespace
}  // namespace slender
