#include "body_surface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <variant>

namespace slender {

namespace {

BodySurface capsule(double radius, double length)
{
  BodySurface out;
  out.points.resize(3, 2);
  out.points.col(0) << 0.0, 0.0, -0.5 * length;
  out.points.col(1) << 0.0, 0.0, 0.5 * length;
  out.segments = {{0, 1, radius}};
  return out;
}

constexpr double kRounding = 1e-3;   // of the shortest side

/// Bit k of the number of a corner tells on which side it is along axis k. The diagonals of the faces connect four of
/// the corners. So half a turn about the middle of a face maps its triangles, and those around it, to each other, and
/// what presses evenly on a face does not turn the box.
BodySurface facesOf(const Box& box)
{
  BodySurface out;
  out.radius = kRounding * box.size.minCoeff();
  const Eigen::Vector3d half = 0.5 * box.size.array() - out.radius;
  out.points.resize(3, 8);
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k)
      out.points(k, i) = i >> k & 1 ? half[k] : -half[k];
  for (int k = 0; k < 3; ++k)
    for (int side = 0; side < 2; ++side)
    {
      const int first = side << k, u = 1 << (k + 1) % 3, v = 1 << (k + 2) % 3;
      int corner[4] = {first, first | u, first | u | v, first | v};   // in turn
      if (side == 1)
        std::rotate(corner, corner + 1, corner + 4);
      out.triangles.push_back({corner[0], corner[1], corner[2]});
      out.triangles.push_back({corner[0], corner[2], corner[3]});
    }
  return out;
}

BodySurface facesOf(const Cylinder& cylinder)
{
  BodySurface out;
  out.radius = kRounding * std::min(2.0 * cylinder.radius, cylinder.length);
  const int n = kSidesOfCylinder;
  out.points.setZero(3, 2 * n + 2);   // the rims, and the middles of the ends
  out.points(2, 2 * n + 1) = 0.5 * cylinder.length - out.radius;
  out.points(2, 2 * n) = -out.points(2, 2 * n + 1);
  for (int i = 0; i < n; ++i)
  {
    const double angle = 2.0 * M_PI * i / n;
    const Eigen::Vector2d rim = (cylinder.radius - out.radius) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    out.points.col(i) << rim, -0.5 * cylinder.length + out.radius;
    out.points.col(n + i) << rim, 0.5 * cylinder.length - out.radius;
    const int next = (i + 1) % n;
    out.triangles.push_back({i, next, n + next});
    out.triangles.push_back({i, n + next, n + i});
    out.triangles.push_back({2 * n, next, i});
    out.triangles.push_back({2 * n + 1, n + i, n + next});
  }
  return out;
}

BodySurface facesOf(const TriangleMesh& mesh)
{
  BodySurface out;
  const Eigen::Vector3d size = mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  out.radius = kRounding * std::max(size.minCoeff(), 0.1 * size.maxCoeff());
  out.points = mesh.vertices;
  for (Eigen::Index i = 0; i < mesh.triangles.cols(); ++i)
    out.triangles.push_back({mesh.triangles(0, i), mesh.triangles(1, i), mesh.triangles(2, i)});
  return out;
}

}   // namespace

BodySurface makeBodySurface(const Shape& shape, const Pose& X_BS)
{
  struct
  {
    BodySurface operator()(const Plane&) const { throw std::invalid_argument("a body cannot be a plane"); }
    BodySurface operator()(const Sphere& s) const { return capsule(s.radius, 0.0); }
    BodySurface operator()(const Capsule& s) const { return capsule(s.radius, s.length); }
    BodySurface operator()(const Box& s) const { return facesOf(s); }
    BodySurface operator()(const Cylinder& s) const { return facesOf(s); }
    BodySurface operator()(const std::shared_ptr<const TriangleMesh>& s) const { return facesOf(*s); }
  } make;
  BodySurface out = std::visit(make, shape);
  for (Eigen::Index i = 0; i < out.points.cols(); ++i)
    out.points.col(i) = X_BS * Eigen::Vector3d(out.points.col(i));
  return out;
}

}   // namespace slender
