#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "slender_sim/contact/shape.h"
#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

/// Inertia per mass from the second moments <x^2>, <y^2>, <z^2> about the centre.
Eigen::Matrix3d fromMoments(double xx, double yy, double zz)
{
  return Eigen::Vector3d(yy + zz, zz + xx, xx + yy).asDiagonal();
}

MassProperties of(const Plane&)
{
  throw std::invalid_argument("mass of a plane: it is infinite; give mass and inertia, or take a box");
}

MassProperties of(const Sphere& s)
{
  const double m = s.radius * s.radius / 5.0;
  return {4.0 / 3.0 * M_PI * std::pow(s.radius, 3), Eigen::Vector3d::Zero(), fromMoments(m, m, m)};
}

MassProperties of(const Box& b)
{
  const Eigen::Vector3d m = b.size.cwiseAbs2() / 12.0;
  return {b.size.prod(), Eigen::Vector3d::Zero(), fromMoments(m.x(), m.y(), m.z())};
}

MassProperties of(const Cylinder& c)
{
  const double m = c.radius * c.radius / 4.0;
  return {M_PI * c.radius * c.radius * c.length, Eigen::Vector3d::Zero(),
          fromMoments(m, m, c.length * c.length / 12.0)};
}

MassProperties of(const Capsule& c)
{
  const double r = c.radius, l = c.length, tube = M_PI * r * r * l, ball = 4.0 / 3.0 * M_PI * r * r * r,
               volume = tube + ball;
  // a half ball's centre is 3/8 r beyond its flat face
  const double across = (tube * r * r / 4.0 + ball * r * r / 5.0) / volume;
  const double axial = (tube * l * l / 12.0 + ball * (r * r / 5.0 + l * l / 4.0 + 0.375 * l * r)) / volume;
  return {volume, Eigen::Vector3d::Zero(), fromMoments(across, across, axial)};
}

/// Every edge must belong to two triangles, once in each direction.
void requireClosed(const TriangleMesh& mesh)
{
  std::vector<std::pair<int, int>> edges;
  for (Eigen::Index i = 0; i < mesh.triangles.cols(); ++i)
    for (int k = 0; k < 3; ++k)
      edges.emplace_back(mesh.triangles(k, i), mesh.triangles((k + 1) % 3, i));
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size(); ++i)
  {
    const bool twice = i > 0 && edges[i] == edges[i - 1];
    if (twice || !std::binary_search(edges.begin(), edges.end(), std::make_pair(edges[i].second, edges[i].first)))
      throw std::invalid_argument(
          "mass of a mesh: it is not closed and consistently oriented at the edge between vertices " +
          std::to_string(edges[i].first) + " and " + std::to_string(edges[i].second) +
          "; close the mesh, or give mass and inertia");
  }
}

MassProperties of(const std::shared_ptr<const TriangleMesh>& mesh)
{
  requireClosed(*mesh);
  // tetrahedra between the triangles and a point amid the vertices (not the origin: digits)
  const Eigen::Vector3d origin = mesh->vertices.rowwise().mean();
  double volume = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < mesh->triangles.cols(); ++i)
  {
    Eigen::Matrix3d p;
    for (int k = 0; k < 3; ++k)
      p.col(k) = mesh->vertices.col(mesh->triangles(k, i)) - origin;
    const double v = p.determinant() / 6.0;
    const Eigen::Vector3d sum = p.rowwise().sum();
    volume += v;
    first += v / 4.0 * sum;
    second += v / 20.0 * (sum * sum.transpose() + p * p.transpose());
  }
  if (!(volume > 0.0))
    throw std::invalid_argument("mass of a mesh: its volume is " + std::to_string(volume) +
                                " m^3; triangles must be counter-clockwise seen from outside");
  const Eigen::Vector3d center = first / volume;
  const Eigen::Matrix3d moments = second / volume - center * center.transpose();
  return {volume, origin + center, moments.trace() * Eigen::Matrix3d::Identity() - moments};
}

}   // namespace

MassProperties massProperties(const Shape& shape)
{
  checkShape(shape);
  return std::visit([](const auto& s) { return of(s); }, shape);
}

}   // namespace slender
