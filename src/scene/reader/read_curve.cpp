#include <algorithm>
#include <type_traits>

#include "read_parts.h"

#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/reader.h"

namespace slender {

namespace {

const Range positive = Range::above(0, kMaxCoordinate, "m");

std::optional<int> readEdges(YamlMap& map) { return map.get("edges").integer(1, max_edges); }

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
  assign(curve.from, map.get("from").vector3(kCoordinate));
  assign(curve.to, map.get("to").vector3(kCoordinate));
  assign(curve.edges, readEdges(map));
  assign(curve.grading, map.get("grading").number(Range::closed(0.01, 100)));
  if (!((curve.to - curve.from).norm() > 0))
    map.at().problem("from and to are the same point; must differ");
  return curve;
}

PolylineCurve readPolyline(YamlMap& map)
{
  PolylineCurve curve;
  curve.points = readPoints(map.require("points"));
  curve.edges = readEdges(map);
  return curve;
}

ArcCurve readArc(YamlMap& map)
{
  ArcCurve curve;
  assign(curve.center, map.get("center").vector3(kCoordinate));
  assign(curve.start, map.get("start").vector3(kCoordinate));
  assign(curve.axis, map.get("axis").vector3(kCoordinate));
  const YamlCursor angle = map.get("angle");
  assign(curve.angle, angle.number(Range::closed(-2e5 * M_PI, 2e5 * M_PI, "rad")));
  if (curve.angle == 0)
    angle.problem("must not be zero");
  assign(curve.edges, readEdges(map));
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
  assign(curve.center, map.get("center").vector3(kCoordinate));
  assign(curve.axis, map.get("axis").vector3(kCoordinate));
  assign(curve.radius, map.get("radius").number(positive));
  assign(curve.pitch, map.get("pitch").number(kCoordinate));
  const YamlCursor turns = map.get("turns");
  assign(curve.turns, turns.number(Range::closed(-1e5, 1e5)));
  if (curve.turns == 0)
    turns.problem("must not be zero; negative turns give a left-handed helix");
  assign(curve.edges, readEdges(map));
  return curve;
}

CatenaryCurve readCatenary(YamlMap& map)
{
  CatenaryCurve curve;
  assign(curve.from, map.get("from").vector3(kCoordinate));
  assign(curve.to, map.get("to").vector3(kCoordinate));
  assign(curve.length, map.get("length").number(positive));
  assign(curve.edges, readEdges(map));
  return curve;
}

TrefoilCurve readTrefoil(YamlMap& map)
{
  TrefoilCurve curve;
  assign(curve.center, map.get("center").vector3(kCoordinate));
  assign(curve.axis, map.get("axis").vector3(kCoordinate));
  assign(curve.up, map.get("up").vector3(kCoordinate));
  assign(curve.radius, map.get("radius").number(positive));
  assign(curve.separation, map.get("separation").number(positive));
  assign(curve.length, map.get("length").number(positive));
  assign(curve.left_handed, map.get("left_handed").boolean());
  assign(curve.edges, readEdges(map));
  return curve;
}

TorusKnotCurve readTorusKnot(YamlMap& map)
{
  TorusKnotCurve curve;
  assign(curve.center, map.get("center").vector3(kCoordinate));
  assign(curve.axis, map.get("axis").vector3(kCoordinate));
  assign(curve.radius, map.get("radius").number(positive));
  assign(curve.tube_radius, map.get("tube_radius").number(positive));
  assign(curve.around, map.get("around").integer(1, 1000));
  assign(curve.through, map.get("through").integer(1, 1000));
  assign(curve.edges, readEdges(map));
  return curve;
}

VeeCurve readVee(YamlMap& map)
{
  VeeCurve curve;
  assign(curve.tip, map.get("tip").vector3(kCoordinate));
  assign(curve.direction, map.get("direction").vector3(kCoordinate));
  assign(curve.normal, map.get("normal").vector3(kCoordinate));
  assign(curve.arm, map.get("arm").number(positive));
  assign(curve.angle, map.get("angle").number(Range::between(0, M_PI, "rad")));
  assign(curve.edges, readEdges(map));
  return curve;
}

FileCurve readFile(YamlMap& map, const ReadContext& context)
{
  FileCurve curve;
  const YamlCursor path = map.require("path");
  curve.edges = readEdges(map);
  if (const auto text = path.text())
  {
    curve.path = context.resolve(*text);
    try
    {
      curve.points = readPointFile(curve.path);
      if (curve.points.size() < 2 || curve.points.size() > max_edges + 1u)
      {
        path.problem("holds " + std::to_string(curve.points.size()) + " points; must hold 2 to " +
                     std::to_string(max_edges + 1));
      }
    }
    catch (const SceneError& error)
    {
      path.problem(error.what());
    }
  }
  return curve;
}

/// That a rod along it gets at least.
template <class CurveKind>
double edgesOf(const CurveKind& curve)
{
  if constexpr (std::is_same_v<CurveKind, PolylineCurve> || std::is_same_v<CurveKind, FileCurve>)
    return std::max(curve.edges.value_or(0), static_cast<int>(curve.points.size()));
  else
    return curve.edges;
}

}   // namespace

std::optional<Curve> readCurve(const YamlCursor& at, const ReadContext& context)
{
  if (!at.present())
    return std::nullopt;
  const std::size_t before = at.problems().size();
  YamlMap kinds(at);
  std::optional<Curve> curve;
  int given = 0;
  const auto read = [&](const char* kind, auto reader) {
    const YamlCursor value = kinds.get(kind);
    if (value.present())
    {
      ++given;
      YamlMap map(value);
      const auto read_curve = reader(map);
      map.finish();
      context.claim(value, edgesOf(read_curve));
      curve = read_curve;
    }
  };
  read("straight", readStraight);
  read("polyline", readPolyline);
  read("arc", readArc);
  read("helix", readHelix);
  read("catenary", readCatenary);
  read("trefoil", readTrefoil);
  read("torus_knot", readTorusKnot);
  read("vee", readVee);
  read("file", [&](YamlMap& map) { return readFile(map, context); });
  kinds.finish();
  if (given != 1 && at.problems().size() == before)
  {
    at.problem("names " + std::to_string(given) +
               " curves; must name one of: straight, polyline, arc, helix, catenary, trefoil, torus_knot, vee, file");
  }
  return at.problems().size() == before ? curve : std::nullopt;
}

}   // namespace slender
