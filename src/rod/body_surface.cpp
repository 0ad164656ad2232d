#include "body_surface.h"

#include <stdexcept>

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

BodySurface edgesOf(const Box& box)
{
  constexpr double kRounding = 0.05;   // of the shortest side
  BodySurface out;
  const double radius = kRounding * box.size.minCoeff();
  const Eigen::Vector3d half = 0.5 * box.size.array() - radius;
  out.points.resize(3, 8);
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k)
      out.points(k, i) = i >> k & 1 ? half[k] : -half[k];
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k)
      if (!(i >> k & 1))
        out.segments.push_back({i, i | 1 << k, radius});
  return out;
}

}   // namespace

bool hasBodySurface(const Shape& shape)
{
  return std::holds_alternative<Sphere>(shape) || std::holds_alternative<Capsule>(shape) ||
         std::holds_alternative<Box>(shape);
}

BodySurface makeBodySurface(const Shape& shape, const Pose& X_BS)
{
  if (!hasBodySurface(shape))
    throw std::invalid_argument("a body of this shape has no surface that touches solids");
  const auto* sphere = std::get_if<Sphere>(&shape);
  const auto* rounded = std::get_if<Capsule>(&shape);
  BodySurface out = sphere    ? capsule(sphere->radius, 0.0)
                    : rounded ? capsule(rounded->radius, rounded->length)
                              : edgesOf(std::get<Box>(shape));
  for (Eigen::Index i = 0; i < out.points.cols(); ++i)
    out.points.col(i) = X_BS * Eigen::Vector3d(out.points.col(i));
  return out;
}

}   // namespace slender
