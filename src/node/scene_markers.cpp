#include "slender_sim/node/scene_markers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "marker_tools.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {
namespace {

using Eigen::Vector3d;
using visualization_msgs::Marker;

constexpr int kSides = 16;                              // of a tube
constexpr int kCoarseSides = 8, kManySections = 1000;   // of one with more sections
constexpr int kMaxSections = 800;                       // per rod
// of all threads together: a coil has many turns, but 30 pictures a second must go through
constexpr int kMaxThreadSections = 3000;

const std::array<std_msgs::ColorRGBA, 4>& rodColors()
{
  static const std::array<std_msgs::ColorRGBA, 4> colors = {color(0.93, 0.55, 0.16), color(0.16, 0.50, 0.72),
                                                            color(0.35, 0.62, 0.30), color(0.62, 0.36, 0.66)};
  return colors;
}

std::vector<double> shares(std::vector<double> values, double range)
{
  for (double& value : values)
    value /= range;
  return values;
}

/// The stripes' edges are sharp because each side has one colour.
void addTube(const std::vector<TubeSection>& sections, const std_msgs::ColorRGBA& base, bool valued, bool striped,
             bool closed, Marker& marker)
{
  const int sides = sections.size() > kManySections ? kCoarseSides : kSides;
  const std_msgs::ColorRGBA stripe = color(0.20, 0.24, 0.30);
  const TriangleMesh mesh = tubeMesh(sections, sides, closed);
  const Eigen::Index walls = 2 * sides * (static_cast<Eigen::Index>(sections.size()) - 1);
  const int rings = static_cast<int>(sections.size()) - (closed ? 1 : 0);
  marker.points.reserve(static_cast<std::size_t>(mesh.triangles.size()));
  marker.colors.reserve(static_cast<std::size_t>(mesh.triangles.size()));
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = mesh.triangles.col(f);
    const bool wall = f < walls;
    const bool dark = wall && striped && (f / 2) % sides % (sides / 2) <= 1;   // two stripes: seen from everywhere
    const Vector3d a = mesh.vertices.col(t[0]),
                   cap = (mesh.vertices.col(t[1]) - a).cross(mesh.vertices.col(t[2]) - a).normalized();
    for (const int vertex : {t[0], t[1], t[2]})
    {
      // of the cap's middle it is that of its end
      const TubeSection& section = vertex < rings * sides    ? sections[vertex / sides]
                                   : vertex == rings * sides ? sections.front()
                                                             : sections.back();
      marker.points.push_back(toPoint(mesh.vertices.col(vertex)));
      marker.colors.push_back(lit(dark     ? stripe
                                  : valued ? valueColor(section.value)
                                           : base,
                                  wall ? tubeNormal(section, vertex % sides, sides) : cap));
    }
  }
}

void addFrames(const RodModel& model, const RodState& s, Marker& marker)
{
  const int edges = model.edges(), stride = std::max(1, edges / 60);
  const double length = std::max(4.0 * model.radius_a.maxCoeff(), 0.4 * model.rest_length.mean() * stride);
  marker.scale.x = 0.08 * length;
  forEachFrame(model, s, [&](int j, const Eigen::Matrix3d& axes) {
    if (j % stride != 0)
      return;
    const Vector3d middle = 0.5 * (s.x.col(j) + s.x.col((j + 1) % model.nodes()));
    for (int k = 0; k < 3; ++k)
    {
      marker.points.push_back(toPoint(middle));
      marker.points.push_back(toPoint(middle + length * axes.col(k)));
      marker.colors.insert(marker.colors.end(), 2, color(k == 0 ? 0.85 : 0.1, k == 1 ? 0.7 : 0.1, k == 2 ? 0.85 : 0.1));
    }
  });
}

Marker graspMarker(const std_msgs::Header& header, int id, const GraspConfig& config, const GraspState& grasp,
                   const RodModel& model)
{
  Marker marker = makeMarker(header, "grasps", id, Marker::SPHERE);
  if (!grasp.active)
  {
    marker.action = Marker::DELETE;
    return marker;
  }
  const int edge = std::min(grasp.first_node, model.edges() - 1);
  double length = 0.0;
  for (int j = grasp.first_node; j < grasp.last_node; ++j)
    length += model.rest_length[j % model.edges()];
  const double width = 3.6 * std::max(model.radius_a[edge], model.radius_b[edge]);
  marker.pose = toMessage(grasp.X_WG);
  marker.scale = toVector3(Vector3d::Constant(width));
  marker.color = std::holds_alternative<FixedMotion>(config.motion) ? color(0.35, 0.37, 0.40) : color(0.22, 0.27, 0.33);
  if (grasp.holds_frame)
    paintMesh(shapeMesh(Box{{length + width, width, width}}), marker);
  return marker;
}

Marker curveMarker(const std_msgs::Header& header, const std::string& ns, int id, MarkerStyle style,
                   const FramedLine& line, int most, const std_msgs::ColorRGBA& paint, bool striped, double width)
{
  Marker marker = makeMarker(header, ns, id, style == MarkerStyle::tube ? Marker::TRIANGLE_LIST : Marker::LINE_STRIP);
  const std::vector<TubeSection> curve = tubeSections(line, most);
  if (style == MarkerStyle::tube)
    addTube(curve, paint, !line.values.empty(), striped, line.closed, marker);
  else
  {
    marker.scale.x = width;
    marker.color = paint;
    for (const TubeSection& s : curve)
    {
      marker.points.push_back(toPoint(s.x));
      if (!line.values.empty())
        marker.colors.push_back(valueColor(s.value));
    }
  }
  return marker;
}

/// Of a thread and its pieces: one marker each.
void addThreadMarkers(const Simulation& simulation, const std_msgs::Header& header, const MarkerOptions& options,
                      double range, visualization_msgs::MarkerArray& out)
{
  const std_msgs::ColorRGBA honey = color(0.90, 0.60, 0.12), metal = color(0.55, 0.57, 0.60),
                            ground = color(0.42, 0.45, 0.50);
  double edges = 0.0;
  for (const ThreadGroupState& group : simulation.state().threads)
    for (const ThreadState& thread : group.threads)
      edges += thread.edges();
  for (std::size_t k = 0; k < simulation.state().threads.size(); ++k)
  {
    const ThreadConfig& config = simulation.config().threads[k];
    for (const ThreadState& thread : simulation.state().threads[k].threads)
    {
      const int share = std::max(2, static_cast<int>(kMaxThreadSections * thread.edges() / edges));
      double volume = 0.0, length = 0.0;
      for (int j = 0; j < thread.edges(); ++j)
        volume += thread.volume[j], length += thread.edge(j).norm();
      const FramedLine line =
          lineOf(snapshotOf(config.name, thread), shares(shownValues(thread, options.color), range));
      out.markers.push_back(curveMarker(header, "threads/" + config.name, static_cast<int>(thread.thread_id),
                                        options.style, line, share, honey, false,
                                        2.0 * std::sqrt(volume / (M_PI * length))));
    }
    if (config.nozzle)
    {
      Marker nozzle = makeMarker(header, "nozzles", static_cast<int>(k), Marker::TRIANGLE_LIST);
      const Pose& X = simulation.state().threads[k].threads.front().ends[1].X_WE;
      const double length = 4.0 * config.nozzle->diameter;
      nozzle.pose = toMessage(Pose{X.position - X.orientation * Vector3d(0.5 * length, 0, 0),
                                   X.orientation * rotationBetween(Vector3d::UnitZ(), Vector3d::UnitX())});
      nozzle.color = metal;
      paintMesh(shapeMesh(Cylinder{0.7 * config.nozzle->diameter, length}), nozzle);
      out.markers.push_back(nozzle);
    }
    if (config.floor)
    {
      // two triangles: rviz would light a flat box from the camera, and it looks black
      Marker floor = makeMarker(header, "floors", static_cast<int>(k), Marker::TRIANGLE_LIST);
      const Vector3d middle = config.nozzle ? config.nozzle->pose.position : Vector3d(0, 0, 0);
      const double size = config.nozzle ? std::max(0.1, 1.5 * (middle.z() - config.floor->height)) : 1.0;
      Vector3d low = middle - Vector3d(size, size, 0), high = middle + Vector3d(size, size, 0);
      if (config.region && (*config.region)[1].head<2>().cwiseAbs().maxCoeff() < 1e3 &&
          (*config.region)[0].head<2>().cwiseAbs().maxCoeff() < 1e3)
        low = (*config.region)[0], high = (*config.region)[1];
      const double z = config.floor->height;
      for (const auto& [x, y] : {std::pair(low.x(), low.y()),
                                 {high.x(), low.y()},
                                 {high.x(), high.y()},
                                 {low.x(), low.y()},
                                 {high.x(), high.y()},
                                 {low.x(), high.y()}})
      {
        floor.points.push_back(toPoint(Vector3d(x, y, z)));
        floor.colors.push_back(lit(ground, Vector3d::UnitZ()));
      }
      out.markers.push_back(floor);
    }
  }
}

}   // namespace

visualization_msgs::MarkerArray sceneMarkers(const Simulation& simulation, const std_msgs::Header& header,
                                             const MarkerOptions& options)
{
  visualization_msgs::MarkerArray out;
  const double range = shownRange(simulation, options);
  if (!simulation.state().threads.empty())
  {
    // pieces come and go; rviz takes this for all namespaces, so it can stand here only
    Marker gone = makeMarker(header, "threads", 0, Marker::TRIANGLE_LIST);
    gone.action = Marker::DELETEALL;
    out.markers.push_back(gone);
  }
  for (std::size_t r = 0; r < simulation.state().rods.size(); ++r)
  {
    const RodModel& model = simulation.rodModel(static_cast<int>(r));
    const RodState& state = simulation.state().rods[r];
    const std_msgs::ColorRGBA& base = rodColors()[r % rodColors().size()];
    FramedLine line = lineOf(snapshotOf(model, state));
    line.values = shares(shownValues(model, state, options.color), range);
    out.markers.push_back(curveMarker(header, "rods/" + model.name, 0, options.style, line, kMaxSections, base, true,
                                      2.0 * model.radius_a.mean()));
    if (simulation.config().rods[r].tracking)
    {
      const Eigen::Matrix3Xd& nodes = simulation.state().rod_guides[r].points;
      Marker guide = makeMarker(header, "guides/" + model.name, 0, Marker::LINE_STRIP);
      guide.scale.x = 0.6 * model.radius_a.mean();
      guide.color = color(0.15, 0.15, 0.18, 0.8);
      for (Eigen::Index k = 0; k < nodes.cols() + (model.closed ? 1 : 0); ++k)
        guide.points.push_back(toPoint(nodes.col(k % nodes.cols())));
      out.markers.push_back(std::move(guide));
    }
    if (options.frames)
    {
      Marker frames = makeMarker(header, "frames/" + model.name, 0, Marker::LINE_LIST);
      addFrames(model, state, frames);
      out.markers.push_back(std::move(frames));
    }
  }
  for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
  {
    const auto& [object, index, config] = simulation.grasps()[g];
    if (!object.isCloth())
      out.markers.push_back(graspMarker(header, static_cast<int>(g), *config,
                                        simulation.state().rods[object.index].grasps[index],
                                        simulation.rodModel(object.index)));
  }
  addThreadMarkers(simulation, header, options, range, out);
  addClothMarkers(simulation, header, options, range, out);
  addSolidMarkers(simulation, header, out);
  if (options.forces > 0.0)
    addForceMarkers(simulation, header, options.forces, out);
  addLegend(simulation, header, options, range, out);
  return out;
}

}   // namespace slender
