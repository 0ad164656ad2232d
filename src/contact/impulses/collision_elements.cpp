#include "collision_elements.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

using Elements = CollisionElements;

void checkSheet(const CollisionSheet& sheet, int number, const Eigen::Matrix3Xd& rest)
{
  const auto fail = [&](const std::string& what) {
    throw std::invalid_argument("sheet " + std::to_string(number) + ": " + what);
  };
  if (!(sheet.thickness > 0.0) || !std::isfinite(sheet.thickness))
    fail("thickness is " + std::to_string(sheet.thickness) + " m; must be positive and finite");
  if (!(sheet.friction >= 0.0) || !std::isfinite(sheet.friction))
    fail("friction is " + std::to_string(sheet.friction) + "; must be zero or positive and finite");
  if (sheet.triangles.cols() == 0)
    fail("has no triangles");
  if (sheet.triangles.minCoeff() < 0 || sheet.triangles.maxCoeff() >= rest.cols())
    fail("a triangle names a point outside 0 ... " + std::to_string(rest.cols() - 1));
  for (Eigen::Index t = 0; t < sheet.triangles.cols(); ++t)
    for (int k = 0; k < 3; ++k)
    {
      if (sheet.triangles(k, t) == sheet.triangles((k + 1) % 3, t))
        fail("triangle " + std::to_string(t) + " names point " + std::to_string(sheet.triangles(k, t)) + " twice");
      if (rest.col(sheet.triangles(k, t)) == rest.col(sheet.triangles((k + 1) % 3, t)))
        fail("triangle " + std::to_string(t) + " has two corners in one place at rest");
    }
}

/// Prism around a cylinder, whose surface stays within `tolerance` of its own.
TriangleMesh prism(const Cylinder& c, double tolerance)
{
  constexpr int kFewest = 12, kMost = 720;
  int n = kFewest;
  while (n < kMost && c.radius / std::cos(M_PI / n) - c.radius > tolerance)
    ++n;
  const double radius = c.radius / std::cos(M_PI / n);
  TriangleMesh mesh;
  mesh.vertices.resize(3, 2 * n + 2);
  mesh.triangles.resize(3, 4 * n);
  for (int i = 0; i < n; ++i)
  {
    const double angle = 2.0 * M_PI * i / n;
    const int next = (i + 1) % n;
    mesh.vertices.col(i) << radius * std::cos(angle), radius * std::sin(angle), -0.5 * c.length;
    mesh.vertices.col(n + i) << mesh.vertices(0, i), mesh.vertices(1, i), 0.5 * c.length;
    mesh.triangles.col(4 * i) << i, next, n + next;
    mesh.triangles.col(4 * i + 1) << i, n + next, n + i;
    mesh.triangles.col(4 * i + 2) << 2 * n, next, i;
    mesh.triangles.col(4 * i + 3) << 2 * n + 1, n + i, n + next;
  }
  mesh.vertices.col(2 * n) << 0.0, 0.0, -0.5 * c.length;
  mesh.vertices.col(2 * n + 1) << 0.0, 0.0, 0.5 * c.length;
  return mesh;
}

TriangleMesh boxMesh(const Box& b)
{
  TriangleMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int i = 0; i < 8; ++i)
    mesh.vertices.col(i) = 0.5 * b.size.cwiseProduct(Eigen::Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  mesh.triangles.resize(3, 12);
  mesh.triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,   //
      3, 2, 5, 7, 1, 5, 7, 6, 4, 6, 3, 7,                 //
      1, 3, 7, 6, 5, 4, 3, 7, 6, 2, 7, 5;
  return mesh;
}

/// Collects points and elements of an object; finds the edges that its triangles share.
class Builder
{
public:
  explicit Builder(Elements& to) : to_(to) {}

  void add(const Eigen::Matrix3Xi& triangles, int first_point, int object)
  {
    const std::size_t from = to_.elements.size();
    sides_.clear();
    for (Eigen::Index t = 0; t < triangles.cols(); ++t)
    {
      Elements::Element e{{}, {-1, -1, -1}, object, 3, 0, 0};
      for (int k = 0; k < 3; ++k)
        e.v[k] = first_point + triangles(k, t);
      to_.elements.push_back(e);
      for (int k = 0; k < 3; ++k)
        sides_.push_back(
            {std::min(e.v[k], e.v[(k + 1) % 3]), std::max(e.v[k], e.v[(k + 1) % 3]), static_cast<int>(from + t), k});
    }
    std::sort(sides_.begin(), sides_.end(), [](const Side& a, const Side& b) {
      return std::tie(a.a, a.b, a.element, a.k) < std::tie(b.a, b.b, b.element, b.k);
    });
    for (std::size_t i = 0; i < sides_.size(); ++i)
    {
      const Side& s = sides_[i];
      if (i == 0 || s.a != sides_[i - 1].a || s.b != sides_[i - 1].b)
      {
        to_.edges.push_back({s.a, s.b, object, false});
        to_.elements[s.element].owns_edge |= 1 << s.k;
      }
      to_.elements[s.element].edge[s.k] = static_cast<int>(to_.edges.size()) - 1;
    }
    for (std::size_t i = from; i < to_.elements.size(); ++i)
      ownPoints(to_.elements[i]);
  }

  void addLone(int first_point, int corners, int object)
  {
    Elements::Element e{{first_point, first_point + corners - 1, first_point}, {-1, -1, -1}, object, corners, 0, 0};
    if (corners == 2)
    {
      e.edge[0] = static_cast<int>(to_.edges.size());
      e.owns_edge = 1;
      to_.edges.push_back({e.v[0], e.v[1], object, true});
    }
    ownPoints(e);
    to_.elements.push_back(e);
  }

private:
  struct Side
  {
    int a, b, element, k;
  };
  void ownPoints(Elements::Element& e)
  {
    for (int k = 0; k < e.corners; ++k)
    {
      int& owner = to_.point_object[e.v[k]];
      if (owner >= 0)
        continue;
      owner = e.object;
      e.owns_point |= 1 << k;
    }
  }

  Elements& to_;
  std::vector<Side> sides_;
};

}   // namespace

CollisionSurface asTaken(CollisionSurface surface)
{
  double thinnest = std::numeric_limits<double>::infinity();
  for (const CollisionSheet& sheet : surface.sheets)
    thinnest = std::min(thinnest, sheet.thickness);
  for (ContactSolid& solid : surface.solids)
    if (const auto* cylinder = std::get_if<Cylinder>(&solid.shape))
      solid.shape = std::make_shared<const TriangleMesh>(prism(*cylinder, 0.05 * thinnest));
  return surface;
}

CollisionElements::CollisionElements(const CollisionSurface& given)
{
  for (const ContactSolid& solid : given.solids)
    checkShape(solid.shape);
  const CollisionSurface surface = asTaken(given);
  sheet_points = static_cast<int>(surface.rest.cols());
  sheet_count = static_cast<int>(surface.sheets.size());
  if (!surface.rest.allFinite())
    throw std::invalid_argument("a point at rest is not finite");
  for (int s = 0; s < sheet_count; ++s)
  {
    checkSheet(surface.sheets[s], s, surface.rest);
    objects.push_back({0.5 * surface.sheets[s].thickness, 0.0, surface.sheets[s].friction, false});
  }
  std::vector<Eigen::Matrix3Xd> solid_points;
  std::vector<Eigen::Matrix3Xi> solid_triangles;
  int points = sheet_points;
  for (const ContactSolid& solid : surface.solids)
  {
    Object object{0.0, 0.0, solid.friction, true};
    TriangleMesh mesh;
    if (std::holds_alternative<Plane>(solid.shape))
      planes.push_back(static_cast<int>(objects.size()));
    else if (const auto* sphere = std::get_if<Sphere>(&solid.shape))
    {
      object.core = sphere->radius;
      mesh.vertices = Eigen::Vector3d::Zero();
    }
    else if (const auto* capsule = std::get_if<Capsule>(&solid.shape))
    {
      object.core = capsule->radius;
      mesh.vertices.setZero(3, 2);
      mesh.vertices.row(2) << -0.5 * capsule->length, 0.5 * capsule->length;
    }
    else if (const auto* box = std::get_if<Box>(&solid.shape))
      mesh = boxMesh(*box);
    else
      mesh = *std::get<std::shared_ptr<const TriangleMesh>>(solid.shape);
    objects.push_back(object);
    points += static_cast<int>(mesh.vertices.cols());
    solid_points.push_back(mesh.vertices);
    solid_triangles.push_back(mesh.triangles);
  }
  reference.resize(3, points);
  reference.leftCols(sheet_points) = surface.rest;
  point_object.assign(points, -1);
  Builder builder(*this);
  for (int s = 0; s < sheet_count; ++s)
    builder.add(surface.sheets[s].triangles, 0, s);
  int first = sheet_points;
  for (std::size_t k = 0; k < solid_points.size(); ++k)
  {
    const int count = static_cast<int>(solid_points[k].cols()), object = sheet_count + static_cast<int>(k);
    reference.middleCols(first, count) = solid_points[k];
    if (solid_triangles[k].cols() > 0)
      builder.add(solid_triangles[k], first, object);
    else if (count > 0)
      builder.addLone(first, count, object);
    for (int i = first; i < first + count; ++i)   // unused vertices of a mesh move with it all the same
      point_object[i] = object;
    first += count;
  }
  const std::size_t n = objects.size();
  touching.assign(n * n, 0);
  for (int a = 0; a < sheet_count; ++a)
  {
    const CollisionSheet& sheet = surface.sheets[a];
    for (int b = 0; b < sheet_count; ++b)
      touching[a * n + b] = a == b ? sheet.self : sheet.others && surface.sheets[b].others;
    for (std::size_t k = 0; k < surface.solids.size(); ++k)
    {
      const std::vector<int>& ignores = surface.solids[k].ignores;
      const bool touches = sheet.solids && std::find(ignores.begin(), ignores.end(), a) == ignores.end();
      touching[a * n + sheet_count + k] = touching[(sheet_count + k) * n + a] = touches;
    }
  }
}

double CollisionElements::friction(int a, int b) const
{
  const double p = objects[a].friction, q = objects[b].friction;
  return p < 0.0 ? q : q < 0.0 ? p : std::sqrt(p * q);
}

void CollisionElements::place(const std::vector<Pose>& poses, Eigen::Matrix3Xd& x) const
{
  for (Eigen::Index i = sheet_points; i < reference.cols(); ++i)
    x.col(i) = poses[point_object[i] - sheet_count] * Eigen::Vector3d(reference.col(i));
}

}   // namespace slender
