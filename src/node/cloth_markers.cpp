#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "marker_tools.h"
#include "slender_sim/geometry/mesh_offsets.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/scene_markers.h"
#include "slender_sim/tracking/function_colors.h"

namespace slender {
namespace {

using Eigen::Vector3d;
using visualization_msgs::Marker;

const std::array<std_msgs::ColorRGBA, 4>& clothColors()
{
  static const std::array<std_msgs::ColorRGBA, 4> colors = {color(0.20, 0.47, 0.72), color(0.85, 0.38, 0.28),
                                                            color(0.40, 0.62, 0.38), color(0.87, 0.70, 0.32)};
  return colors;
}

/// Both sides look the same, since rviz draws one colour for both: brightness depends on the angle only, from two sides
/// so that a fold has a bright and a dark flank.
std_msgs::ColorRGBA shaded(const std_msgs::ColorRGBA& paint, const Vector3d& normal)
{
  static const Vector3d key = Vector3d(0.55, -0.65, 0.52).normalized(),
                        fill = Vector3d(-0.75, -0.30, 0.59).normalized();
  const double light = 0.28 + 0.62 * std::abs(normal.dot(key)) + 0.22 * std::abs(normal.dot(fill));
  const auto shade = [light](float c) { return std::min(1.0, c * light); };
  return color(shade(paint.r), shade(paint.g), shade(paint.b), paint.a);
}

/// `paints`: of each vertex (3 x n), or none.
void addTriangles(const Eigen::Matrix3Xi& triangles, const Eigen::Matrix3Xd& x, const std_msgs::ColorRGBA& paint,
                  const Eigen::Matrix3Xd& paints, Marker& marker)
{
  const Eigen::Matrix3Xd normals = vertexNormals({x, triangles});
  std::vector<geometry_msgs::Point> points(static_cast<std::size_t>(x.cols()));
  std::vector<std_msgs::ColorRGBA> colors(points.size());
  for (Eigen::Index i = 0; i < x.cols(); ++i)
  {
    points[i] = toPoint(x.col(i));
    colors[i] = shaded(paints.cols() ? color(paints(0, i), paints(1, i), paints(2, i)) : paint,
                       normals.col(i).isZero(0.0) ? Vector3d::UnitZ() : Vector3d(normals.col(i)));
  }
  marker.points.reserve(static_cast<std::size_t>(triangles.size()));
  marker.colors.reserve(static_cast<std::size_t>(triangles.size()));
  for (Eigen::Index k = 0; k < triangles.size(); ++k)
  {
    const int vertex = triangles.data()[k];
    marker.points.push_back(points[vertex]);
    marker.colors.push_back(colors[vertex]);
  }
}

void addEdges(const MeshTopology& topology, const Eigen::Matrix3Xd& x, Marker& marker)
{
  marker.points.reserve(2 * static_cast<std::size_t>(topology.edgeCount()));
  for (Eigen::Index e = 0; e < topology.edges.cols(); ++e)
    for (int end = 0; end < 2; ++end)
      marker.points.push_back(toPoint(x.col(topology.edges(end, e))));
}

}   // namespace

void addClothMarkers(const Simulation& simulation, const std_msgs::Header& header, const MarkerOptions& options,
                     double range, visualization_msgs::MarkerArray& out)
{
  const MarkerStyle style = options.style;
  std::vector<double> spacing;   // mean distance of neighbours, per cloth [m]
  for (std::size_t k = 0; k < simulation.state().cloths.size(); ++k)
  {
    const ClothModel& model = simulation.clothModel(static_cast<int>(k));
    const Eigen::Matrix3Xd& x = simulation.state().cloths[k].x;
    spacing.push_back(std::sqrt(faceAreas(model.rest).mean() * 4.0 / std::sqrt(3.0)));
    const bool lines = style == MarkerStyle::line;
    Marker marker = makeMarker(header, "cloths/" + model.name, 0, lines ? Marker::LINE_LIST : Marker::TRIANGLE_LIST);
    const std_msgs::ColorRGBA& paint = clothColors()[k % clothColors().size()];
    if (lines)
    {
      marker.scale.x = 0.05 * spacing.back();
      marker.color = paint;
      addEdges(model.topology, x, marker);
    }
    else
    {
      const auto& tracking = simulation.config().cloths[k].tracking;
      const bool regions = style == MarkerStyle::regions && tracking;
      Eigen::Matrix3Xd paints =
          regions ? functionColors(simulation.functions({ObjectRef::cloth, static_cast<int>(k)}).functions.tracked)
                  : Eigen::Matrix3Xd();
      const std::vector<double> values = shownValues(model, x, options.color);
      if (!values.empty())
        paints.resize(3, x.cols());
      for (std::size_t i = 0; i < values.size(); ++i)
      {
        const std_msgs::ColorRGBA c = valueColor(values[i] / range);
        paints.col(static_cast<Eigen::Index>(i)) << c.r, c.g, c.b;
      }
      addTriangles(model.rest.triangles, x, paint, paints, marker);
    }
    out.markers.push_back(std::move(marker));
    if (const auto& tracking = simulation.config().cloths[k].tracking)
    {
      Marker guide = makeMarker(header, "guides/" + model.name, 0, Marker::LINE_LIST);
      guide.scale.x = 0.08 * spacing.back();
      guide.color = color(0.15, 0.15, 0.18, 0.8);
      addEdges(meshTopology(tracking->guide.mesh), simulation.state().cloth_guides[k].points, guide);
      out.markers.push_back(std::move(guide));
    }
  }
  for (std::size_t g = 0; g < simulation.grasps().size(); ++g)
  {
    const auto& [object, index, config] = simulation.grasps()[g];
    if (!object.isCloth())
      continue;
    Marker marker = makeMarker(header, "grasps", static_cast<int>(g), Marker::SPHERE_LIST);
    const Eigen::Matrix3Xd& x = simulation.state().cloths[object.index].x;
    const ClothGrasp& grasp = simulation.state().cloth_grasps[object.index][index];
    marker.scale.x = marker.scale.y = marker.scale.z = 0.4 * spacing[object.index];
    marker.color =
        std::holds_alternative<FixedMotion>(config->motion) ? color(0.35, 0.37, 0.40) : color(0.22, 0.27, 0.33);
    for (const int vertex : grasp.vertices)
      marker.points.push_back(toPoint(x.col(vertex)));
    if (!grasp.active)
      marker.action = Marker::DELETE;
    out.markers.push_back(std::move(marker));
  }
}

}   // namespace slender
