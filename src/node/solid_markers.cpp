#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "marker_tools.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/scene/snapshot_meshes.h"

namespace slender {

using Eigen::Vector3d;
using visualization_msgs::Marker;

std_msgs::ColorRGBA color(double r, double g, double b, double a)
{
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(r);
  c.g = static_cast<float>(g);
  c.b = static_cast<float>(b);
  c.a = static_cast<float>(a);
  return c;
}

Marker makeMarker(const std_msgs::Header& header, const std::string& ns, int id, int type)
{
  Marker marker;
  marker.header = header;
  marker.ns = ns;
  marker.id = id;
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
  marker.color = color(1, 1, 1);
  return marker;
}

std_msgs::ColorRGBA lit(const std_msgs::ColorRGBA& paint, const Vector3d& normal)
{
  static const Vector3d light = Vector3d(0.45, -0.35, 0.85).normalized();
  const double diffuse = 0.5 + 0.5 * normal.dot(light);   // wraps round: no side is black
  const double gloss = 0.35 * std::pow(std::max(0.0, normal.dot(light)), 24.0);
  const auto shade = [&](float c) { return std::min(1.0, c * (0.45 + 0.65 * diffuse) + gloss); };
  return color(shade(paint.r), shade(paint.g), shade(paint.b), paint.a);
}

namespace {

constexpr double kPlaneSize = 10.0;      // [m] a piece of it is drawn

/// Fills type, scale and points of a marker whose pose is `X` and whose colour is set.
struct Drawing
{
  const Pose& X;
  Marker& marker;

  void simple(int type, const Vector3d& size, const Vector3d& center = Vector3d::Zero())
  {
    marker.type = type;
    marker.pose.position = toPoint(X * center);
    marker.scale = toVector3(size);
  }

  void triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c)
  {
    const std_msgs::ColorRGBA paint = lit(marker.color, (X.orientation * (b - a).cross(c - a)).normalized());
    for (const Vector3d* p : {&a, &b, &c})
    {
      marker.points.push_back(toPoint(*p));
      marker.colors.push_back(paint);
    }
  }

  void operator()(const Plane&)   // rviz would light a cube from the camera: seen at a glance it is black
  {
    marker.type = Marker::TRIANGLE_LIST;
    const double h = 0.5 * kPlaneSize;
    triangle({-h, -h, 0}, {h, -h, 0}, {h, h, 0});
    triangle({-h, -h, 0}, {h, h, 0}, {-h, h, 0});
  }

  void operator()(const Sphere& s) { simple(Marker::SPHERE, Vector3d::Constant(2 * s.radius)); }
  void operator()(const Box& b) { simple(Marker::CUBE, b.size); }
  void operator()(const Cylinder& c) { simple(Marker::CYLINDER, {2 * c.radius, 2 * c.radius, c.length}); }

  void operator()(const Capsule& c) { (*this)(std::make_shared<const TriangleMesh>(shapeMesh(c))); }

  void operator()(const std::shared_ptr<const TriangleMesh>& mesh)
  {
    marker.type = Marker::TRIANGLE_LIST;
    for (Eigen::Index i = 0; i < mesh->triangles.cols(); ++i)
    {
      const auto corner = [&](int k) -> Vector3d { return mesh->vertices.col(mesh->triangles(k, i)); };
      triangle(corner(0), corner(1), corner(2));
    }
  }
};

}  // namespace

void addSolidMarkers(const Simulation& simulation, const std_msgs::Header& header, visualization_msgs::MarkerArray& out)
{
  const auto add = [&](const char* ns, std::size_t id, const Shape& shape, const Pose& X_WS, const std_msgs::ColorRGBA& paint) {
    Marker marker = makeMarker(header, ns, static_cast<int>(id), Marker::CUBE);
    marker.color = paint;
    marker.pose = toMessage(X_WS);
    Drawing drawing{X_WS, marker};
    std::visit(drawing, shape);
    out.markers.push_back(std::move(marker));
  };
  const SceneConfig& scene = simulation.config();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (scene.bodies[b].shape)
      add("bodies", b, *scene.bodies[b].shape, simulation.state().bodies[b].X_WB * scene.bodies[b].X_BS, color(0.70, 0.28, 0.24));
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    add("obstacles", k, scene.obstacles[k].shape, simulation.state().obstacles[k], color(0.62, 0.64, 0.66));
}

}  // namespace slender
