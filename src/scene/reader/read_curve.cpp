#include <algorithm>
#include <type_traits>

#include "read_parts.h"

#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/reader.h"

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

StraightCurve readStraight(YamlMap& map)
{
  StraightCurve curve;
  map.get("from", curve.from, kCoordinate, "First node. Without the key: [0, 0, 0].");
  map.get("to", curve.to, kCoordinate, "Last node. Without the key: [1, 0, 0].");
  assign(curve.edges, readEdges(map, "Number of edges. Without the key: 50."));
  map.get("grading", curve.grading, Range::closed(0.01, 100),
          "Length of the last edge over that of the first. Without the key: 1, all edges are equally long.");
  if (!((curve.to - curve.from).norm() > 0))
    map.at().problem("from and to are the same point; must differ");
  return curve;
}

PolylineCurve readPolyline(YamlMap& map)
{
  PolylineCurve curve;
  curve.points = readPoints(map.require(
      "points", "Points [x, y, z] through which the polyline runs. They are the nodes, unless `edges` is given."));
  curve.edges = readEdges(map, "Number of edges of equal length. Without the key the points are the nodes.");
  return curve;
}

ArcCurve readArc(YamlMap& map)
{
  ArcCurve curve;
  map.get("center", curve.center, kCoordinate, "Centre of the circle. Without the key: [0, 0, 0].");
  map.get("start", curve.start, kCoordinate, "First node. Without the key: [1, 0, 0].");
  map.get("axis", curve.axis, kCoordinate,
          "Axis about which the arc turns, through `center`. Without the key: [0, 0, 1].");
  const YamlCursor angle =
      map.get("angle", curve.angle, Range::closed(-2e5 * M_PI, 2e5 * M_PI, "rad"),
              "Angle of the arc, positive by the right-hand rule about `axis`. Without the key: 1 rad.");
  if (curve.angle == 0)
    angle.problem("must not be zero");
  assign(curve.edges, readEdges(map, "Number of edges. Without the key: 50."));
  // Edges that turn by half a turn or more each lie the wrong way round the circle, or fold back.
  if (std::abs(curve.angle) >= 0.999 * M_PI * curve.edges)
  {
    angle.problem("is too much for " + std::to_string(curve.edges) +
                  " edges, each of which may turn by less than pi; give edges of at least " +
                  std::to_string(static_cast<long>(std::abs(curve.angle) / (0.999 * M_PI)) + 1));
  }
  return curve;
}

HelixCurve readHelix(YamlMap& map)
{
  HelixCurve curve;
  map.get("center", curve.center, kCoordinate, "Foot of the axis, beside the first node. Without the key: [0, 0, 0].");
  map.get("axis", curve.axis, kCoordinate, "Direction of the axis. Without the key: [0, 0, 1].");
  map.get("radius", curve.radius, kLength, "Radius of the helix. Without the key: 0.1 m.");
  map.get("pitch", curve.pitch, kCoordinate, "Rise along the axis per turn. Without the key: 0.05 m.");
  const YamlCursor turns = map.get("turns", curve.turns, Range::closed(-1e5, 1e5),
                                   "Number of turns; negative for a left-handed helix. Without the key: 3.");
  if (curve.turns == 0)
    turns.problem("must not be zero; negative turns give a left-handed helix");
  assign(curve.edges, readEdges(map, "Number of edges. Without the key: 150."));
  return curve;
}

CatenaryCurve readCatenary(YamlMap& map)
{
  CatenaryCurve curve;
  map.get("from", curve.from, kCoordinate, "First node. Without the key: [0, 0, 0].");
  map.get("to", curve.to, kCoordinate, "Last node. Without the key: [1, 0, 0].");
  map.get("length", curve.length, kLength,
          "Length of the hanging chain; not shorter than the distance of its ends. Without the key: 1.2 m.");
  assign(curve.edges, readEdges(map, "Number of edges. Without the key: 50."));
  return curve;
}

TrefoilCurve readTrefoil(YamlMap& map)
{
  TrefoilCurve curve;
  map.get("center", curve.center, kCoordinate,
          "Centre of the knot, on the line of its two tails. Without the key: [0, 0, 0].");
  map.get("axis", curve.axis, kCoordinate, "Direction of the two tails. Without the key: [1, 0, 0].");
  map.get("up", curve.up, kCoordinate, "Direction away from which the loop lies. Without the key: [0, 0, 1].");
  map.get("radius", curve.radius, kLength, "Radius of the loop. Without the key: 0.1 m.");
  map.get("separation", curve.separation, kLength,
          "Distance of the two strands where they wind about each other. Without the key: an eighth of the radius.");
  map.get("length", curve.length, kLength, "Length of the whole curve. Without the key: 1.5 m.");
  map.get("left_handed", curve.left_handed, "Whether the knot is the mirror image. Without the key: false.");
  assign(curve.edges, readEdges(map, "Number of edges. Without the key: 150."));
  return curve;
}

TorusKnotCurve readTorusKnot(YamlMap& map)
{
  TorusKnotCurve curve;
  map.get("center", curve.center, kCoordinate, "Centre of the knot. Without the key: [0, 0, 0].");
  map.get("axis", curve.axis, kCoordinate, "Axis of the torus. Without the key: [0, 0, 1].");
  map.get("radius", curve.radius, kLength,
          "Radius of the circle around which the curve winds. Without the key: 0.1 m.");
  map.get("tube_radius", curve.tube_radius, kLength,
          "Distance of the curve from that circle. Without the key: 0.04 m.");
  map.get("around", curve.around, Range::closed(1, 1000), "Number of turns about the axis. Without the key: 2.");
  map.get("through", curve.through, Range::closed(1, 1000),
          "Number of turns about the circle. Without the key: 3, which with `around` 2 is the closed trefoil.");
  assign(curve.edges, readEdges(map, "Number of edges. Without the key: 120."));
  return curve;
}

VeeCurve readVee(YamlMap& map)
{
  VeeCurve curve;
  map.get("tip", curve.tip, kCoordinate, "Point where the two arms meet. Without the key: [0, 0, 0].");
  map.get("direction", curve.direction, kCoordinate, "Direction between the arms. Without the key: [1, 0, 0].");
  map.get("normal", curve.normal, kCoordinate, "Normal of the plane of the arms. Without the key: [0, 0, 1].");
  map.get("arm", curve.arm, kLength, "Length of each arm. Without the key: 0.5 m.");
  map.get("angle", curve.angle, Range::between(0, M_PI, "rad"), "Angle between the arms. Without the key: pi/2.");
  assign(curve.edges, readEdges(map, "Number of edges, an even one. Without the key: 50."));
  return curve;
}

PolylineCurve readFile(YamlMap& map, const ReadContext& context)
{
  PolylineCurve curve;
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

/// That a rod along it gets at least.
template <class CurveKind>
double edgesOf(const CurveKind& curve)
{
  if constexpr (std::is_same_v<CurveKind, PolylineCurve>)
    return std::max(curve.edges.value_or(0), static_cast<int>(curve.points.size()));
  else
    return curve.edges;
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
  const auto edges = [](const auto& kind) { return edgesOf(kind); };
  return curve && context.claim(kinds.value(), std::visit(edges, *curve)) ? curve : std::nullopt;
}

}   // namespace slender
