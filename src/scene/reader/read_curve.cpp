#include <algorithm>
#include <stdexcept>

#include "read_parts.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/scene/pose_file.h"

namespace slender {

namespace {

std::optional<int> readEdges(YamlMap& map, const char* meaning)
{
  return map.get("edges", meaning).integer(1, max_edges);
}

std::vector<Eigen::Vector3d> readPoints(const YamlCursor& at)
{
  std::vector<Eigen::Vector3d> points;
  for (const YamlCursor& item : at.items(2, max_edges + 1))
    if (const auto point = item.vector3(kCoordinate))
      points.push_back(*point);
  return points;
}

Curve readStraight(YamlMap& map)
{
  Eigen::Vector3d from(0, 0, 0), to(1, 0, 0);
  double grading = 1;
  map.get("from", from, kCoordinate, "First node. Without the key: [0, 0, 0].");
  map.get("to", to, kCoordinate, "Last node. Without the key: [1, 0, 0].");
  const int edges = readEdges(map, "Number of edges. Without the key: 50.").value_or(50);
  map.get("grading", grading, Range::closed(0.01, 100),
          "Length of the last edge over that of the first. Without the key: 1, all edges are equally long.");
  if (!((to - from).norm() > 0))
    map.at().problem("from and to are the same point; must differ");
  return straightLine(from, to, edges, grading);
}

Curve readPolyline(YamlMap& map)
{
  Curve curve;
  curve.points = readPoints(map.require(
      "points", "Points [x, y, z] through which the polyline runs. They are the nodes, unless `edges` is given."));
  curve.edges = readEdges(map, "Number of edges of equal length. Without the key the points are the nodes.");
  return curve;
}

Curve readArc(YamlMap& map)
{
  Eigen::Vector3d center(0, 0, 0), start(1, 0, 0), axis(0, 0, 1);
  double angle = 1;
  map.get("center", center, kCoordinate, "Centre of the circle. Without the key: [0, 0, 0].");
  map.get("start", start, kCoordinate, "First node. Without the key: [1, 0, 0].");
  map.get("axis", axis, kCoordinate, "Axis about which the arc turns, through `center`. Without the key: [0, 0, 1].");
  const YamlCursor at_angle =
      map.get("angle", angle, Range::closed(-2e5 * M_PI, 2e5 * M_PI, "rad"),
              "Angle of the arc, positive by the right-hand rule about `axis`. Without the key: 1 rad.");
  if (angle == 0)
    at_angle.problem("must not be zero");
  const int edges = readEdges(map, "Number of edges. Without the key: 50.").value_or(50);
  // Edges that turn by half a turn or more each lie the wrong way round the circle, or fold back.
  if (std::abs(angle) >= 0.999 * M_PI * edges)
  {
    at_angle.problem("is too much for " + std::to_string(edges) +
                     " edges, each of which may turn by less than pi; give edges of at least " +
                     std::to_string(static_cast<long>(std::abs(angle) / (0.999 * M_PI)) + 1));
  }
  return {edges, [=](int n, const Eigen::Vector3d&) { return arcCurve(center, start, axis, angle, n); }};
}

Curve readHelix(YamlMap& map)
{
  Eigen::Vector3d center(0, 0, 0), axis(0, 0, 1);
  double radius = 0.1, pitch = 0.05, turns = 3;
  map.get("center", center, kCoordinate, "Foot of the axis, beside the first node. Without the key: [0, 0, 0].");
  map.get("axis", axis, kCoordinate, "Direction of the axis. Without the key: [0, 0, 1].");
  map.get("radius", radius, kLength, "Radius of the helix. Without the key: 0.1 m.");
  map.get("pitch", pitch, kCoordinate, "Rise along the axis per turn. Without the key: 0.05 m.");
  const YamlCursor at_turns = map.get("turns", turns, Range::closed(-1e5, 1e5),
                                      "Number of turns; negative for a left-handed helix. Without the key: 3.");
  if (turns == 0)
    at_turns.problem("must not be zero; negative turns give a left-handed helix");
  const int edges = readEdges(map, "Number of edges. Without the key: 150.").value_or(150);
  return {edges, [=](int n, const Eigen::Vector3d&) { return helixCurve(center, axis, radius, pitch, turns, n); }};
}

/// The chain hangs along gravity. Without gravity it hangs along -z.
Curve readCatenary(YamlMap& map)
{
  Eigen::Vector3d from(0, 0, 0), to(1, 0, 0);
  double length = 1.2;
  map.get("from", from, kCoordinate, "First node. Without the key: [0, 0, 0].");
  map.get("to", to, kCoordinate, "Last node. Without the key: [1, 0, 0].");
  map.get("length", length, kLength,
          "Length of the hanging chain; not shorter than the distance of its ends. Without the key: 1.2 m.");
  const int edges = readEdges(map, "Number of edges. Without the key: 50.").value_or(50);
  return {edges, [=](int n, const Eigen::Vector3d& gravity) {
            return catenaryCurve(from, to, length, gravity.norm() > 0 ? gravity : Eigen::Vector3d(0, 0, -1), n);
          }};
}

Curve readTrefoil(YamlMap& map)
{
  Eigen::Vector3d center(0, 0, 0), axis(1, 0, 0), up(0, 0, 1);
  double radius = 0.1, length = 1.5;
  std::optional<double> separation;
  bool left_handed = false;
  map.get("center", center, kCoordinate,
          "Centre of the knot, on the line of its two tails. Without the key: [0, 0, 0].");
  map.get("axis", axis, kCoordinate, "Direction of the two tails. Without the key: [1, 0, 0].");
  map.get("up", up, kCoordinate, "Direction away from which the loop lies. Without the key: [0, 0, 1].");
  map.get("radius", radius, kLength, "Radius of the loop. Without the key: 0.1 m.");
  map.get("separation", separation, kLength,
          "Distance of the two strands where they wind about each other. Without the key: an eighth of the radius.");
  map.get("length", length, kLength, "Length of the whole curve. Without the key: 1.5 m.");
  map.get("left_handed", left_handed, "Whether the knot is the mirror image. Without the key: false.");
  const int edges = readEdges(map, "Number of edges. Without the key: 150.").value_or(150);
  return {edges, [=](int n, const Eigen::Vector3d&) {
            return trefoilCurve(center, axis, up, radius, separation.value_or(radius / 8), length, left_handed, n);
          }};
}

Curve readTorusKnot(YamlMap& map)
{
  Eigen::Vector3d center(0, 0, 0), axis(0, 0, 1);
  double radius = 0.1, tube = 0.04;
  int around = 2, through = 3;
  map.get("center", center, kCoordinate, "Centre of the knot. Without the key: [0, 0, 0].");
  map.get("axis", axis, kCoordinate, "Axis of the torus. Without the key: [0, 0, 1].");
  map.get("radius", radius, kLength, "Radius of the circle around which the curve winds. Without the key: 0.1 m.");
  map.get("tube_radius", tube, kLength, "Distance of the curve from that circle. Without the key: 0.04 m.");
  map.get("around", around, Range::closed(1, 1000), "Number of turns about the axis. Without the key: 2.");
  map.get("through", through, Range::closed(1, 1000),
          "Number of turns about the circle. Without the key: 3, which with `around` 2 is the closed trefoil.");
  const int edges = readEdges(map, "Number of edges. Without the key: 120.").value_or(120);
  return {edges, [=](int n, const Eigen::Vector3d&) {
            return torusKnotCurve(center, axis, radius, tube, around, through, n);
          }};
}

Curve readVee(YamlMap& map)
{
  Eigen::Vector3d tip(0, 0, 0), direction(1, 0, 0), normal(0, 0, 1);
  double arm = 0.5, angle = M_PI / 2;
  map.get("tip", tip, kCoordinate, "Point where the two arms meet. Without the key: [0, 0, 0].");
  map.get("direction", direction, kCoordinate, "Direction between the arms. Without the key: [1, 0, 0].");
  map.get("normal", normal, kCoordinate, "Normal of the plane of the arms. Without the key: [0, 0, 1].");
  map.get("arm", arm, kLength, "Length of each arm. Without the key: 0.5 m.");
  map.get("angle", angle, Range::between(0, M_PI, "rad"), "Angle between the arms. Without the key: pi/2.");
  const int edges = readEdges(map, "Number of edges, an even one. Without the key: 50.").value_or(50);
  return {edges, [=](int n, const Eigen::Vector3d&) { return veeCurve(tip, direction, normal, arm, angle, n); }};
}

Curve readFile(YamlMap& map, const ReadContext& context)
{
  Curve curve;
  const YamlCursor path =
      map.require("path", "CSV file with a point x,y,z per line. The points are the nodes, unless `edges` is given.");
  curve.edges = readEdges(map, "Number of edges of equal length. Without the key the points are the nodes.");
  if (const auto text = path.text())
  {
    path.attempt([&] {
      curve.points = readPointFile(context.resolve(*text));
      if (curve.points.size() < 2 || curve.points.size() > max_edges + 1u)
      {
        throw std::runtime_error("holds " + std::to_string(curve.points.size()) + " points; must hold 2 to " +
                                 std::to_string(max_edges + 1));
      }
    });
  }
  return curve;
}

}   // namespace

std::optional<Curve> readCurve(const YamlCursor& at, const ReadContext& context)
{
  if (!at.present())
    return std::nullopt;
  KindMap<Curve> kinds(at.sharesKeysOf("rods.N.centerline"));
  kinds.add("straight", "A straight line.", readStraight);
  kinds.add("polyline", "A polyline through points.", readPolyline);
  kinds.add("arc", "An arc of a circle.", readArc);
  kinds.add("helix", "A helix.", readHelix);
  kinds.add("catenary", "A chain of given length that hangs between two points along gravity.", readCatenary);
  kinds.add("trefoil", "A loose overhand (trefoil) knot with two straight tails.", readTrefoil);
  kinds.add("torus_knot", "A closed knot on a torus.", readTorusKnot);
  kinds.add("vee", "Two straight arms that meet at a tip.", readVee);
  kinds.add("file", "A polyline through the points of a file.", [&](YamlMap& map) { return readFile(map, context); });
  const std::optional<Curve> curve = kinds.read("curves");
  // A rod along the curve gets at least so many edges.
  const auto edges = [](const Curve& c) { return std::max(c.edges.value_or(0), static_cast<int>(c.points.size())); };
  return curve && context.claim(kinds.value(), edges(*curve)) ? curve : std::nullopt;
}

}   // namespace slender
