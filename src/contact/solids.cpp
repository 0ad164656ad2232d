#include "slender_sim/contact/solids.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

#include "slender_sim/contact/distance.h"

namespace slender {

namespace {

using Vector = Eigen::Vector3d;

/// Distance from the nearest point of a feature, e.g. the centre of a sphere. `across` projects on the directions in
/// which that point stays where it is.
PieceDistance fromPoint(const Vector& offset, double radius, const Eigen::Matrix3d& across)
{
  const double d = offset.norm();
  PieceDistance out;
  out.distance = d - radius;
  out.normal = d > 0.0 ? Vector(offset / d) : Vector(Vector::UnitZ());
  if (d > 0.0)
    out.curvature = (across - out.normal * out.normal.transpose()) / d;
  return out;
}

PieceDistance of(const Plane&, const Vector& p) { return {p.z(), Vector::UnitZ()}; }

PieceDistance of(const Sphere& s, const Vector& p) { return fromPoint(p, s.radius, Eigen::Matrix3d::Identity()); }

PieceDistance of(const Capsule& c, const Vector& p)
{
  const double z = std::min(std::max(p.z(), -0.5 * c.length), 0.5 * c.length);
  return fromPoint({p.x(), p.y(), p.z() - z}, c.radius, Vector(1.0, 1.0, z == p.z() ? 0.0 : 1.0).asDiagonal());
}

PieceDistance of(const Box& b, const Vector& p)
{
  const Vector beyond = p.cwiseAbs() - 0.5 * b.size;
  if ((beyond.array() > 0.0).any())
  {
    Vector offset, across;
    for (int k = 0; k < 3; ++k)
    {
      offset[k] = beyond[k] > 0.0 ? std::copysign(beyond[k], p[k]) : 0.0;
      across[k] = beyond[k] > 0.0 ? 1.0 : 0.0;
    }
    return fromPoint(offset, 0.0, across.asDiagonal());
  }
  int k;
  const double d = beyond.maxCoeff(&k);
  return {d, std::copysign(1.0, p[k]) * Vector::Unit(k)};
}

PieceDistance of(const Cylinder& c, const Vector& p)
{
  const double rho = std::hypot(p.x(), p.y()), side = rho - c.radius, end = std::abs(p.z()) - 0.5 * c.length;
  const Vector radial = rho > 0.0 ? Vector(p.x() / rho, p.y() / rho, 0.0) : Vector(Vector::UnitX());
  const Vector axial = std::copysign(1.0, p.z()) * Vector::UnitZ(), around(-radial.y(), radial.x(), 0.0);
  if (side > 0.0 && end > 0.0)   // the rim: a circle, whose meridian sections are points
  {
    const double d = std::hypot(side, end);
    const Vector meridian = (end * radial - side * axial) / d;
    return {d, (side * radial + end * axial) / d,
            meridian * meridian.transpose() / d + around * around.transpose() * (side / (rho * d))};
  }
  if (side > end)
    return {side, radial, around * around.transpose() * (rho > 0.0 ? 1.0 / rho : 0.0)};
  return {end, axial};
}

PieceDistance of(const Triangle& t, const Vector& p)
{
  const Vector w = closestOnTriangle(p, t[0], t[1], t[2]);
  const int corners = (w.array() > 0.0).count();
  Eigen::Matrix3d across = Eigen::Matrix3d::Identity();
  if (corners == 3)
  {
    const Vector n = (t[1] - t[0]).cross(t[2] - t[0]);
    across = n * n.transpose() / n.squaredNorm();
  }
  else if (corners == 2)
  {
    const int absent = w[0] > 0.0 ? (w[1] > 0.0 ? 2 : 1) : 0;
    const Vector edge = t[(absent + 2) % 3] - t[(absent + 1) % 3];
    across -= edge * edge.transpose() / edge.squaredNorm();
  }
  return fromPoint(p - w[0] * t[0] - w[1] * t[1] - w[2] * t[2], 0.0, across);
}

void requirePositive(const char* what, double value)
{
  if (!(value > 0.0) || !std::isfinite(value))
    throw std::invalid_argument(std::string(what) + " is " + std::to_string(value) + " m; must be positive and finite");
}

}   // namespace

PieceDistance pieceDistance(const ConvexPiece& piece, const Eigen::Vector3d& p)
{
  return std::visit([&](const auto& shape) { return of(shape, p); }, piece);
}

void checkShape(const Shape& shape)
{
  if (const auto* s = std::get_if<Sphere>(&shape))
    requirePositive("sphere: radius", s->radius);
  else if (const auto* b = std::get_if<Box>(&shape))
    requirePositive("box: smallest edge length", b->size.allFinite() ? b->size.minCoeff() : b->size.sum());
  else if (const auto* c = std::get_if<Cylinder>(&shape))
  {
    requirePositive("cylinder: radius", c->radius);
    requirePositive("cylinder: length", c->length);
  }
  else if (const auto* k = std::get_if<Capsule>(&shape))
  {
    requirePositive("capsule: radius", k->radius);
    requirePositive("capsule: length", k->length);
  }
  else if (const auto* m = std::get_if<std::shared_ptr<const TriangleMesh>>(&shape))
  {
    if (!*m || (*m)->triangles.cols() == 0)
      throw std::invalid_argument("mesh: has no triangles");
    if (!(*m)->vertices.allFinite())
      throw std::invalid_argument("mesh: a vertex is not finite");
    if ((*m)->triangles.minCoeff() < 0 || (*m)->triangles.maxCoeff() >= (*m)->vertices.cols())
      throw std::invalid_argument("mesh: a triangle names a vertex outside 0 ... " +
                                  std::to_string((*m)->vertices.cols() - 1));
  }
}

double innerRadius(const ConvexPiece& piece)
{
  if (const auto* s = std::get_if<Sphere>(&piece))
    return s->radius;
  if (const auto* b = std::get_if<Box>(&piece))
    return 0.5 * b->size.minCoeff();
  if (const auto* c = std::get_if<Cylinder>(&piece))
    return std::min(c->radius, 0.5 * c->length);
  if (const auto* k = std::get_if<Capsule>(&piece))
    return k->radius;
  return std::numeric_limits<double>::infinity();
}

/// Seen from inside, the triangles of a closed mesh fill all directions: 4 pi [Van Oosterom and Strackee, The solid
/// angle of a plane triangle, IEEE Trans. Biomed. Eng. 30, 1983].
double ballInMesh(const TriangleMesh& mesh, const Eigen::Vector3d& middle)
{
  double angle = 0.0, radius = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < mesh.triangles.cols(); ++i)
  {
    const auto corner = [&](int k) { return Eigen::Vector3d(mesh.vertices.col(mesh.triangles(k, i)) - middle); };
    const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la);
    radius = std::min(radius, pointTriangleDistance(Eigen::Vector3d::Zero(), a, b, c));
  }
  constexpr double kRounding = 1e-6;
  return std::abs(std::abs(angle) - 4.0 * M_PI) < kRounding ? radius : 0.0;
}

Eigen::Vector3d roundPart(const ConvexPiece& piece, const Eigen::Vector3d& p, const Eigen::Vector3d& normal)
{
  constexpr double kSide = 0.5;   // sine of the angle to the side of a cylinder at which its end begins
  if (std::holds_alternative<Sphere>(piece))
    return p;
  if (const auto* k = std::get_if<Capsule>(&piece))
    return {p.x(), p.y(), p.z() - std::clamp(p.z(), -0.5 * k->length, 0.5 * k->length)};
  if (std::holds_alternative<Cylinder>(piece) && std::abs(normal.z()) < kSide)
    return {p.x(), p.y(), 0.0};
  return Eigen::Vector3d::Zero();
}

ConvexPiece withoutLayer(const ConvexPiece& piece, double depth)
{
  if (const auto* s = std::get_if<Sphere>(&piece))
    return Sphere{s->radius - depth};
  if (const auto* b = std::get_if<Box>(&piece))
    return Box{b->size.array() - 2.0 * depth};
  if (const auto* c = std::get_if<Cylinder>(&piece))
    return Cylinder{c->radius - depth, c->length - 2.0 * depth};
  if (const auto* k = std::get_if<Capsule>(&piece))
    return Capsule{k->radius - depth, k->length};
  return piece;
}

double boundingRadius(const Shape& shape)
{
  if (const auto* s = std::get_if<Sphere>(&shape))
    return s->radius;
  if (const auto* b = std::get_if<Box>(&shape))
    return 0.5 * b->size.norm();
  if (const auto* c = std::get_if<Cylinder>(&shape))
    return std::hypot(c->radius, 0.5 * c->length);
  if (const auto* k = std::get_if<Capsule>(&shape))
    return k->radius + 0.5 * k->length;
  if (const auto* m = std::get_if<std::shared_ptr<const TriangleMesh>>(&shape))
    return (*m)->vertices.colwise().norm().maxCoeff();
  return std::numeric_limits<double>::infinity();
}

double distanceToShape(const Shape& shape, const Pose& pose, const Eigen::Vector3d& from, const Eigen::Vector3d& to)
{
  const int places = from == to ? 0 : 16;
  const Eigen::Vector3d a = pose.inverse() * from, e = pose.inverse() * to - a;
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](const ConvexPiece& piece) {
    for (int k = 0; k <= places; ++k)
      least = std::min(least, pieceDistance(piece, a + e * k / 16).distance);
  };
  std::visit(
      [&](const auto& s) {
        using T = std::decay_t<decltype(s)>;
        if constexpr (std::is_same_v<T, std::shared_ptr<const TriangleMesh>>)
          for (Eigen::Index i = 0; i < s->triangles.cols(); ++i)
            look(Triangle{s->vertices.col(s->triangles(0, i)), s->vertices.col(s->triangles(1, i)),
                          s->vertices.col(s->triangles(2, i))});
        else
          look(s);
      },
      shape);
  return least;
}

}   // namespace slender
