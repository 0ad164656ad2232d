// Rods that track a guide curve.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "read_parts.h"
#include "read_tracking.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/scene/pose_file.h"
#include "slender_sim/scene/shapes.h"
#include "slender_sim/tracking/curve_functions.h"

namespace slender {

namespace {

constexpr int most_functions = 2000;   // their equations are dense

/// The rod beside which a guide is read; without nodes when it could not be.
struct TrackedCurve
{
  Eigen::Matrix3Xd rest, start;   ///< nodes [m]
  Eigen::VectorXd shares;         ///< of the length at rest at its nodes
  bool closed = false;
};

struct GuideNodes
{
  Eigen::Matrix3Xd nodes;   ///< [m]; none when reported
  Eigen::VectorXd shares;   ///< of the rod's length that belong to them
};

std::vector<Eigen::Vector3d> readPoints(const YamlCursor& points, const YamlCursor& file, const ReadContext& context)
{
  std::vector<Eigen::Vector3d> out;
  if (const auto path = file.present() ? file.text() : std::nullopt)
  {
    file.attempt([&] {
      out = readPointFile(context.resolve(*path));
      for (const Eigen::Vector3d& point : out)
        requireCoordinates(point);
    });
  }
  for (const YamlCursor& item : points.items())
    if (const auto point = item.vector3(kCoordinate))
      out.push_back(*point);
  return out;
}

/// Evenly spaced nodes of the rod where it starts, or points, which lie along it by their shares of the polyline's
/// length.
GuideNodes readNodes(YamlMap& map, const ReadContext& context, const TrackedCurve& rod)
{
  const YamlCursor nodes = map.get("nodes",
                                   "Number of nodes of the guide: as many nodes of the rod where it starts, evenly "
                                   "spaced. Give one of `nodes`, `points` and `file`.");
  const YamlCursor points =
      map.get("points", "Nodes of the guide. They lie along the rod by their shares of the polyline's length.");
  const YamlCursor file = map.get("file", "CSV file with a node x,y,z of the guide per line.");
  GuideNodes guide;
  const int fewest = rod.closed ? 3 : 2;
  nodes.takes("a whole number, from 2 (of a closed rod 3) to the number of the rod's nodes");
  if (!map.hasOne({nodes, points, file},
                  "must have one of nodes: N (of the rod), points: [[x, y, z], ...], file: PATH"))
    return guide;
  if (nodes.present())
  {
    const int most = rod.rest.cols() > 0 ? static_cast<int>(rod.rest.cols()) : max_edges + 1;
    const auto count = nodes.integer(fewest, most, rod.closed ? "nodes of the loop" : "nodes of the rod");
    if (count && rod.rest.cols() > 0)
    {
      const double spacing = static_cast<double>(rod.shares.size() - 1) / (rod.closed ? *count : *count - 1);
      guide.nodes.resize(3, *count);
      guide.shares.resize(*count + (rod.closed ? 1 : 0));
      for (int k = 0; k < *count; ++k)
      {
        const auto node = static_cast<Eigen::Index>(std::lround(k * spacing));
        guide.nodes.col(k) = rod.start.col(node);
        guide.shares[k] = rod.shares[node];
      }
      guide.shares[guide.shares.size() - 1] = 1.0;
    }
    return guide;
  }
  const std::size_t before = map.at().problems().size();
  const std::vector<Eigen::Vector3d> given = readPoints(points, file, context);
  if (map.at().problems().size() != before)
    return guide;
  (points.present() ? points : file).attempt([&] {
    if (static_cast<int>(given.size()) < fewest)
    {
      throw std::invalid_argument("has " + std::to_string(given.size()) + " points; a guide" +
                                  (rod.closed ? " of a closed rod" : "") + " needs at least " + std::to_string(fewest));
    }
    const Eigen::Matrix3Xd nodes_given =
        Eigen::Map<const Eigen::Matrix3Xd>(given[0].data(), 3, static_cast<Eigen::Index>(given.size()));
    const Eigen::VectorXd lengths = edgeLengths(nodes_given, rod.closed);
    Eigen::Index shortest = 0;
    if (!(lengths.minCoeff(&shortest) > 1e-9 * lengths.sum()))
    {
      throw std::invalid_argument("points " + std::to_string(shortest) + " and " +
                                  std::to_string((shortest + 1) % lengths.size()) +
                                  " are at the same place; must differ");
    }
    guide.nodes = nodes_given;
    guide.shares = lengthFractions(lengths);
  });
  return guide;
}

std::optional<PointTrajectory> readTable(const YamlCursor& at, int nodes)
{
  PointTrajectory points;
  at.takes("rows [t, x0, y0, z0, x1, ...], t in s and lengths in m");
  for (const YamlCursor& item : at.items(1))
  {
    const auto row = item.numbers(kCoordinate);
    if (!row)
      return std::nullopt;
    if (row->size() != 1 + 3 * static_cast<std::size_t>(nodes))
    {
      return item.problem("has " + std::to_string(row->size()) +
                          " numbers; must be [t, x0, y0, z0, x1, ...] of the guide's " + std::to_string(nodes) +
                          " nodes");
    }
    if (!item.attempt([&] { appendPoints(points, *row); }))
      return std::nullopt;
  }
  return points.empty() ? std::nullopt : std::optional<PointTrajectory>(std::move(points));
}

std::optional<PointTrajectory> readMotionFile(const YamlCursor& at, const ReadContext& context, int nodes)
{
  const auto path = at.text();
  if (!path)
    return std::nullopt;
  PointTrajectory points;
  const bool good = at.attempt([&] {
    points = readPointMotion(context.resolve(*path), nodes);
    for (const Eigen::Matrix3Xd& frame : points.frames())
      requireCoordinates(frame);
  });
  return good ? std::make_optional(std::move(points)) : std::nullopt;
}

void readCurveMotion(const YamlCursor& at, const ReadContext& context, GuideConfig& guide)
{
  if (!at.present())
    return;
  if (at.isScalar())
  {
    at.choice<bool>({{"fixed", true}});
    return;
  }
  YamlMap map(at);
  const YamlCursor table =
      map.get("table", "Motion of all nodes of the guide: rows [t, x0, y0, z0, x1, ...], interpolated smoothly.");
  const YamlCursor file = map.get("file", "CSV file with the motion of all nodes of the guide: rows t,x0,y0,z0,x1,...");
  const YamlCursor topic = map.get("topic", "The guide comes by messages on `guide/points`, nodes in order.");
  const YamlCursor late = map.get("late",
                                  "What the guide does when no message comes: hold the last one, or go on at the last "
                                  "speed, which dies out. Without the key: hold.");
  const YamlCursor tf = map.get("tf", "Name of a frame of tf that carries the whole guide; a node looks it up.");
  const YamlCursor offset = map.get(
      "offset", "With `tf`: pose of the guide in the frame. Without the key, the guide is carried as `attach` says.");
  const YamlCursor attach = map.get("attach",
                                    "With `tf`. `initial`: the frame carries the guide from where both are at first. "
                                    "`frame`: the guide is given in the frame. Without the key: initial.");
  map.finish();
  if (!map.hasOne({table, file, topic, tf},
                  "must be fixed or one of {table: [[t, x0, y0, z0, x1, ...], ...]}, {file: FILE.csv}, {topic: "
                  "points}, {tf: FRAME}"))
    return;
  if (late.present() && !topic.present() && !tf.present())
    late.problem("is for guides by topic or tf");
  for (const YamlCursor& key : {offset, attach})
    if (key.present() && !tf.present())
      key.problem("is for guides by tf");
  assign(guide.coast, readLate(late));
  if (tf.present())
  {
    readFramedMotion(tf, offset, attach, guide);
    return;
  }
  if (topic.present())
  {
    if (topic.choice<bool>({{"points", true}}))
      guide.motion = TopicGuide{};
    return;
  }
  const int nodes = static_cast<int>(guide.mesh.vertices.cols());
  if (nodes == 0)
    return;   // reported
  auto points = table.present() ? readTable(table, nodes) : readMotionFile(file, context, nodes);
  if (points)
  {
    if (points->times().front() <= 0)   // else the guide stands still until then
      points->startInMotion();
    guide.motion = FrameGuide{std::move(*points)};
  }
}

TestFunctions readCurveFunctions(const YamlCursor& at, const TrackedCurve& rod, const MassMatrix& weights)
{
  if (!at.present())
    return curveHats(weights);
  YamlMap map(at);
  const YamlCursor basis = map.get("basis", "The guide's hat functions: one average per node of the guide.");
  const YamlCursor segments =
      map.get("segments", "Number of equal parts of the rod's length whose averages are prescribed.");
  segments.takes("a whole number, from 1 to the number of the rod's nodes");
  map.finish();
  if (!map.hasOne({basis, segments}, "must be one of {basis: hats}, {segments: N}"))
    return {};
  if (basis.present())
    return basis.choice<bool>({{"hats", true}}) ? curveHats(weights) : TestFunctions{};
  const auto count =
      segments.integer(1, rod.rest.cols() > 0 ? static_cast<long>(rod.rest.cols()) : max_edges + 1, "segments");
  return count && rod.rest.cols() > 0 ? curveSegments(*count, rod.shares, rod.closed) : TestFunctions{};
}

}   // namespace

std::shared_ptr<const TrackingConfig> readTrackedCurve(const YamlCursor& at, const ReadContext& context,
                                                       const RodConfig& config)
{
  if (!at.present())
    return nullptr;
  TrackedCurve rod;
  rod.closed = config.closed;
  rod.shares = Eigen::Vector2d(0, 1);
  if (config.edges > 0)
  {
    try
    {
      rod.rest = restNodes(config, context.gravity);
      rod.start = initialNodes(config, rod.rest, context.gravity);
      rod.shares = lengthFractions(edgeLengths(rod.rest, rod.closed));
    }
    catch (const std::invalid_argument&)
    {
      rod = TrackedCurve();   // reported as `initial`
    }
  }
  auto tracking = std::make_shared<TrackingConfig>();
  YamlMap map(at), guide_map(map.require("guide", "The guide curve, a polyline: give `nodes`, `points` or `file`."));
  const GuideNodes guide = readNodes(guide_map, context, rod);
  tracking->guide.mesh.vertices = guide.nodes;
  readCurveMotion(guide_map.get("motion", "How the guide moves. Without the key: fixed."), context, tracking->guide);
  guide_map.finish();
  const bool good = guide.nodes.cols() > 0 && rod.rest.cols() > 0;
  const MassMatrix weights = good ? polylineWeights(guide.shares, rod.shares, rod.closed) : MassMatrix(0, 0);
  FunctionSet set;
  const YamlCursor at_functions = map.get("test_functions",
                                          "Averages of the rod that are prescribed: give `basis` or `segments`. "
                                          "Without the key: the guide's hat functions.");
  set.functions = readCurveFunctions(at_functions, rod, weights);
  map.finish();
  if (config.stretching == Stretching::projected)
    at.problem("takes implicit steps; with it stretching must be stiff");
  if (set.functions.count() > most_functions ||
      12.0 * set.functions.count() * static_cast<double>(rod.rest.cols()) > kMaxGuideNumbers)
  {
    (at_functions.present() ? at_functions : at)
        .problem("makes " + std::to_string(set.functions.count()) + " test functions of " +
                 std::to_string(rod.rest.cols()) + " nodes, too many for one rod; leave out some");
  }
  if (!good || !map.sound())
    return nullptr;
  const bool independent = (at_functions.present() ? at_functions : at).attempt([&] {
    auto constraints =
        std::make_shared<WeakConstraints>(curveConstraints(set.functions, weights, rod.rest, rod.closed));
    std::vector<char> held;
    for (const GraspConfig& grasp : config.grasps)
    {
      held.resize(static_cast<std::size_t>(rod.rest.cols()), 0);
      for (int i = std::max(0, grasp.first_node); i <= grasp.last_node && i < rod.rest.cols();
           ++i)   // others were reported
        held[static_cast<std::size_t>(i)] = 1;
    }
    constraints->requireIndependent(held);
    set.constraints = std::move(constraints);
  });
  if (!independent)
    return nullptr;
  tracking->sets.push_back(std::move(set));
  tracking->size = edgeLengths(rod.rest, rod.closed).sum();
  return tracking;
}

}   // namespace slender
