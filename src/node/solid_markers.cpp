#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "marker_tools.h"
#include "slender_sim/geometry/mesh_offsets.h"
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

void paintMesh(const TriangleMesh& mesh, Marker& marker)
{
  marker.type = Marker::TRIANGLE_LIST;
  marker.scale = toVector3(Vector3d::Ones());
  const geometry_msgs::Quaternion& q = marker.pose.orientation;
  const Eigen::Matrix3d R = Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix();
  const Eigen::Matrix3Xd normals = R * cornerNormals(mesh);
  marker.points.reserve(static_cast<std::size_t>(normals.cols()));
  marker.colors.reserve(static_cast<std::size_t>(normals.cols()));
  for (Eigen::Index c = 0; c < normals.cols(); ++c)
  {
    marker.points.push_back(toPoint(mesh.vertices.col(mesh.triangles.data()[c])));
    marker.colors.push_back(lit(marker.color, normals.col(c)));
  }
}

namespace {

constexpr double kPlaneSize = 10.0;   // [m] a piece of it is drawn

/// Fills type, scale and points of a marker whose pose and colour are set.
struct Drawing
{
  Marker& marker;

  void operator()(const Plane&)
  {
    const double h = 0.5 * kPlaneSize;
    TriangleMesh square{Eigen::Matrix3Xd(3, 4), Eigen::Matrix3Xi(3, 2)};
    square.vertices << -h, h, h, -h, -h, -h, h, h, 0, 0, 0, 0;
    square.triangles << 0, 0, 1, 2, 2, 3;
    paintMesh(square, marker);
  }

  void operator()(const Sphere& s)   // lit from the camera it looks as it should
  {
    marker.type = Marker::SPHERE;
    marker.scale = toVector3(Vector3d::Constant(2 * s.radius));
  }

  void operator()(const std::shared_ptr<const TriangleMesh>& mesh) { paintMesh(*mesh, marker); }

  template <class Solid>
  void operator()(const Solid& solid)
  {
    paintMesh(shapeMesh(solid), marker);
  }
};

}   // namespace

void addSolidMarkers(const Simulation& simulation, const std_msgs::Header& header, visualization_msgs::MarkerArray& out)
{
  const auto add = [&](const char* ns, std::size_t id, const Shape& shape, const Pose& X_WS,
                       const std_msgs::ColorRGBA& paint) {
    Marker marker = makeMarker(header, ns, static_cast<int>(id), Marker::CUBE);
    marker.color = paint;
    marker.pose = toMessage(X_WS);
    std::visit(Drawing{marker}, shape);
    out.markers.push_back(std::move(marker));
  };
  const SceneConfig& scene = simulation.config();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (scene.bodies[b].shape)
      add("bodies", b, *scene.bodies[b].shape, simulation.state().bodies[b].X_WB * scene.bodies[b].X_BS,
          color(0.70, 0.28, 0.24));
  for (std::size_t k = 0; k < scene.obstacles.size(); ++k)
    add("obstacles", k, scene.obstacles[k].shape, simulation.state().obstacles[k], color(0.62, 0.64, 0.66));
}

}   // namespace slender
