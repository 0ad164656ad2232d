#include <fstream>
#include <map>
#include <stdexcept>

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
    const Eigen::Vector3d a = fromMessage(marker.points[k]), b = fromMessage(marker.points[k + 1]),
                          c = fromMessage(marker.points[k + 2]);
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
)",
                                         "scene", {}, std::string(SLENDER_SOURCE_DIR) + "/test/unit/data"));
  std::map<std::pair<std::string, int>, Marker> markers;
  for (const Marker& marker : sceneMarkers(simulation, std_msgs::Header(), {MarkerStyle::line}).markers)
    if (marker.action == Marker::ADD)
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
  const Marker& crate = markers[{"obstacles", 2}];
  EXPECT_NEAR(volumeOf(crate), 6.0, 1e-12);
  for (std::size_t k = 0; k < crate.points.size(); k += 3)
    if (const bool top = crate.points[k].z > 1 && crate.points[k + 1].z > 1 && crate.points[k + 2].z > 1; top)
      EXPECT_GT(crate.colors[k].r, 0.6f);   // in the light, from wherever it is seen
  const Marker& drum = markers[{"obstacles", 3}];
  EXPECT_NEAR(volumeOf(drum), M_PI * 0.04 * 0.5, 0.03 * M_PI * 0.04 * 0.5);
  EXPECT_EQ(drum.scale.z, 1);
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
  const std::string thread =
      "centerline: {straight: {to: [0.1, 0, 0], edges: 3000}}, radius: 0.002, ends: {oldest: held}}";
  const Simulation simulation(parseScene("threads:\n  - {name: a, " + thread + "\n  - {name: b, " + thread, "scene"));
  int erased = 0, tubes = 0;
  std::size_t triangles = 0;
  const auto markers = sceneMarkers(simulation, std_msgs::Header()).markers;
  for (const Marker& marker : markers)
  {
    erased += marker.action == Marker::DELETEALL;
    if (marker.action != Marker::ADD)
      continue;
    ++tubes;
    triangles += marker.points.size() / 3;
    // an octagon has 0.9 of a circle's area
    EXPECT_NEAR(volumeOf(marker), M_PI * 4e-6 * 0.1, 0.11 * M_PI * 4e-6 * 0.1);
  }
  EXPECT_EQ(markers.front().action, Marker::DELETEALL);   // rviz takes all away then, whatever the namespace
  EXPECT_EQ(erased, 1);
  EXPECT_EQ(tubes, 2);
  EXPECT_LT(triangles, 60000u);
  for (const Marker& marker : sceneMarkers(simulation, std_msgs::Header(), {MarkerStyle::line}).markers)
    if (marker.action == Marker::ADD)
    {
      EXPECT_EQ(marker.type, Marker::LINE_STRIP);
      EXPECT_NEAR(marker.scale.x, 0.004, 1e-9);
      EXPECT_NEAR(marker.points.back().x, 0.1, 1e-12);
    }
}

const Marker& find(const visualization_msgs::MarkerArray& markers, const std::string& ns, int id = 0)
{
  for (const Marker& marker : markers.markers)
    if (marker.ns == ns && marker.id == id)
      return marker;
  throw std::runtime_error("no marker " + ns);
}

MarkerOptions colored(MarkerColor color, double range, MarkerStyle style = MarkerStyle::line)
{
  MarkerOptions options;
  options.style = style;
  options.color = color;
  options.range = range;
  return options;
}

/// A quarter of a circle of radius 0.5 m: its curvature is 2 per metre.
TEST(Markers, coloursShowCurvature)
{
  const Simulation bent(parseScene(
      "rods: [{name: arc, centerline: {arc: {start: [0.5, 0, 0], axis: [0, 0, 1], angle: 1.5707963, edges: 40}}}]",
      "scene"));
  const auto at = [&](double range, MarkerStyle style = MarkerStyle::line) -> Marker {
    return find(sceneMarkers(bent, std_msgs::Header(), colored(MarkerColor::curvature, range, style)), "rods/arc");
  };
  const Marker full = at(2.0), half = at(4.0), grey = at(1e6), tube = at(2.0, MarkerStyle::tube);
  ASSERT_EQ(full.colors.size(), full.points.size());
  const std::size_t middle = full.colors.size() / 2;
  EXPECT_NEAR(full.colors[middle].g, 0.14, 0.01);   // full red
  EXPECT_NEAR(grey.colors[middle].g, 0.86, 0.01);
  EXPECT_LT(half.colors[middle].g, 0.6);
  EXPECT_GT(half.colors[middle].g, 0.25);
  EXPECT_NEAR(full.colors.front().g, 0.86, 0.01);      // none at a free end
  EXPECT_NEAR(at(0.0).colors[middle].g, 0.14, 0.01);   // the largest is the full colour
  EXPECT_EQ(tube.colors.size(), tube.points.size());
  EXPECT_TRUE(find(sceneMarkers(bent, std_msgs::Header(), {MarkerStyle::line}), "rods/arc").colors.empty());
}

TEST(Markers, coloursShowStrainOfRodsAndCloths)
{
  const std::string folder = testing::TempDir();
  const auto square = [&](const std::string& name, double width) {
    std::ofstream(folder + "/" + name) << "v 0 0 0\nv " << width << " 0 0\nv " << width
                                       << " 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
  };
  square("rest.obj", 1.0);
  square("wide.obj", 1.1);
  square("narrow.obj", 0.9);
  const auto first = [&](const std::string& start) {
    const Simulation simulation(
        parseScene("cloths: [{name: c, mesh: {file: rest.obj}, bending: {model: none}, start: {file: " + start + "}}]",
                   "scene", {}, folder));
    return find(sceneMarkers(simulation, std_msgs::Header(), colored(MarkerColor::strain, 0.1, MarkerStyle::tube)),
                "cloths/c")
        .colors.front();
  };
  const auto red = first("wide.obj"), blue = first("narrow.obj"), none = first("rest.obj");
  EXPECT_GT(red.r, 4 * red.g);
  EXPECT_GT(blue.b, 4 * blue.r);
  EXPECT_NEAR(none.r, none.b, 0.03 * none.r);

  const Simulation rod(parseScene(
      "rods: [{name: r, centerline: {straight: {to: [1, 0, 0], edges: 4}}, initial: {straight: {to: [1.05, 0, 0]}}}]",
      "scene"));
  const Marker line = find(sceneMarkers(rod, std_msgs::Header(), colored(MarkerColor::strain, 0.05)), "rods/r");
  for (const auto& c : line.colors)
    EXPECT_NEAR(c.g, 0.14, 0.01);
}

/// A weightless rod held at both ends and stretched: its arrows show what pulls at the holders.
TEST(Markers, arrowsShowForces)
{
  Simulation simulation(parseScene(R"(
gravity: [0, 0, 0]
rods:
  - name: r
    centerline: {straight: {to: [1, 0, 0], edges: 4}}
    initial: {straight: {to: [1.05, 0, 0]}}
    cross_section: {radius: 0.01}
    material: {youngs_modulus: 1.0e6}
    grasps: {left: {edges: [0], motion: fixed}, right: {edges: [-1], motion: fixed}}
)",
                                   "scene"));
  for (int k = 0; k < 3; ++k)
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  MarkerOptions options;
  const auto plain = sceneMarkers(simulation, std_msgs::Header(), options);
  for (const Marker& marker : plain.markers)
    EXPECT_NE(marker.ns, "wrenches");
  options.forces = 0.02;
  const auto markers = sceneMarkers(simulation, std_msgs::Header(), options);
  const Marker& left = find(markers, "wrenches", 0);
  ASSERT_EQ(left.points.size(), 2u);
  EXPECT_NEAR(left.points[1].x - left.points[0].x, 0.02 * simulation.grasps().wrench(0).force.x(), 1e-12);
  EXPECT_GT(left.points[1].x, left.points[0].x + 0.1);   // about 0.02 * 15.7 N: inwards
  EXPECT_LT(find(markers, "wrenches", 2).points[1].x, find(markers, "wrenches", 2).points[0].x - 0.1);
  EXPECT_EQ(find(markers, "contacts").action, Marker::DELETE);
}

TEST(Markers, arrowsShowWhatContactsDoToCloth)
{
  // a towel that has come to rest on a table: what carries it
  Simulation simulation(parseScene(R"(
time: {step: 0.01}
cloths:
  - name: towel
    grid: {corner: [0, 0, 0.0011], sides: [[0.3, 0, 0], [0, 0.3, 0]], cells: 6}
    material: {area_density: 0.2, thickness: 0.0005, youngs_modulus: 1.0e6}
    contact: {thickness: 0.002}
obstacles: [{name: table, shape: {plane: {}}}]
)",
                                   "scene"));
  for (int k = 0; k < 50; ++k)
    ASSERT_TRUE(simulation.step(simulation.defaultInputs()).ok);
  MarkerOptions options;
  options.forces = 2.0;
  const auto markers = sceneMarkers(simulation, std_msgs::Header(), options);
  const Marker& contacts = find(markers, "contacts");
  ASSERT_EQ(contacts.points.size() % 10, 0u);   // a shaft and four barbs
  double sum = 0.0;
  for (std::size_t k = 0; k < contacts.points.size(); k += 10)
    sum += contacts.points[k + 1].z - contacts.points[k].z;
  EXPECT_NEAR(sum, 2.0 * 0.2 * 0.09 * 9.81, 0.01);
}

TEST(Markers, gripperIsALitBoxAboutTheSection)
{
  const Simulation simulation(parseScene(R"(
rods: [{name: r, centerline: {straight: {to: [1, 0, 0], edges: 10}}, cross_section: {radius: 0.01}, grasps: {left: {edges: [0]}, pin: {nodes: [5], hold: position}}}]
)",
                                         "scene"));
  const auto markers = sceneMarkers(simulation, std_msgs::Header());
  const Marker& left = find(markers, "grasps", 0);
  EXPECT_EQ(left.type, Marker::TRIANGLE_LIST);
  EXPECT_NEAR(volumeOf(left), std::pow(0.036, 3), 1e-12);
  EXPECT_EQ(left.colors.size(), left.points.size());
  EXPECT_EQ(find(markers, "grasps", 1).type, Marker::SPHERE);
}

TEST(Markers, legendSaysWhatColoursAndArrowsMean)
{
  const Simulation simulation(parseScene("rods: [{centerline: {straight: {to: [1, 0, 0], edges: 4}}}]", "scene"));
  EXPECT_EQ(find(sceneMarkers(simulation, std_msgs::Header()), "legend").action, Marker::DELETE);
  MarkerOptions options = colored(MarkerColor::curvature, 2.5);
  options.frames = true;
  options.forces = 0.02;
  const auto markers = sceneMarkers(simulation, std_msgs::Header(), options);
  const Marker& legend = find(markers, "legend");
  EXPECT_EQ(legend.type, Marker::TEXT_VIEW_FACING);
  EXPECT_NE(legend.text.find("curvature: blue -2.5 1/m, grey 0, red 2.5 1/m\n"), std::string::npos);
  EXPECT_NE(legend.text.find("d1 green"), std::string::npos);
  EXPECT_NE(legend.text.find("0.02 m per N"), std::string::npos);
  EXPECT_GT(legend.pose.position.z, 0.0);
}

}   // namespace
}   // namespace slender
