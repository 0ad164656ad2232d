#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "slender_sim/geometry/curves.h"

namespace slender {

namespace {

using Eigen::Vector3d;

void check(bool good, const char* name, double value, const std::string& allowed)
{
  if (!good)
  {
    std::ostringstream text;
    text << name << " = " << value << ": must be " << allowed;
    throw std::invalid_argument(text.str());
  }
}

std::string metres(double x)
{
  std::ostringstream text;
  text << x << " m";
  return text.str();
}

/// Unit vectors: first along `main`, second as `other` lets it be.
std::pair<Vector3d, Vector3d> plane(const Vector3d& main, const char* main_name, const Vector3d& other,
                                    const char* other_name)
{
  check(main.norm() > 0 && main.allFinite(), main_name, main.norm(), "a vector of non-zero, finite length");
  const Vector3d e1 = main.normalized();
  const Vector3d across = other - e1.dot(other) * e1;
  check(across.norm() > 1e-9 * other.norm() && other.allFinite(), other_name, across.norm(),
        std::string("a vector not along ") + main_name);
  return {e1, across.normalized()};
}

/// Rises from 0 to 1 with two derivatives zero at both ends.
double smoothStep(double u) { return u * u * u * (10 + u * (6 * u - 15)); }

}   // namespace

Eigen::Matrix3Xd trefoilCurve(const Vector3d& center, const Vector3d& axis, const Vector3d& up, double radius,
                              double separation, double length, bool left_handed, int edges)
{
  check(edges >= 1, "edges", edges, "at least 1");
  check(radius > 0, "radius", radius, "> 0 m");
  check(separation > 0 && separation <= 0.25 * radius, "separation", separation,
        "in (0, " + metres(0.25 * radius) + "], a quarter of the radius");
  Vector3d e1, e2;   // no structured binding: C++17 lets no lambda have those
  std::tie(e1, e2) = plane(axis, "axis", up, "up");
  const Vector3d e3 = (left_handed ? -1.0 : 1.0) * e1.cross(e2);

  // The loop is a circle about the origin; the strands are wound about its upper part, -half to half, and tails leave
  // it tangentially and bend back to e1.
  constexpr int steps = 600;
  constexpr double half = M_PI / 4;
  const double h = 0.5 * separation;
  const double tail_height = (radius + h) * std::cos(half) - radius * (1 - std::cos(half));
  const double tail_start = (2 * radius + h) * std::sin(half);
  std::vector<Vector3d> points;
  const auto add = [&](double x, double y, double z) {
    points.push_back(center + x * e1 + (y - tail_height) * e2 + z * e3);
  };
  const auto onTorus = [&](double angle, double turn) {   // angle from the top, towards e1
    const double r = radius + h * std::cos(turn);
    add(r * std::sin(angle), r * std::cos(angle), h * std::sin(turn));
  };
  const auto bend = [&](double side, double heading) {
    add(side * (tail_start - radius * std::sin(heading)), tail_height + radius * (1 - std::cos(heading)), 0);
  };
  const auto sweep = [&](auto point) {   // without the last
    for (int k = 0; k < steps; ++k)
    {
      point(static_cast<double>(k) / steps);
    }
  };
  sweep([&](double u) { bend(-1, half * u); });
  sweep([&](double u) { onTorus((2 * u - 1) * half, 3 * M_PI * smoothStep(u)); });
  sweep([&](double u) { onTorus(half + u * 2 * (M_PI - half), M_PI); });
  sweep([&](double u) { onTorus((2 * u - 1) * half, M_PI + 3 * M_PI * smoothStep(u)); });
  sweep([&](double u) { bend(1, half * (1 - u)); });
  bend(1, 0);

  double knot = 0.0;
  for (std::size_t k = 1; k < points.size(); ++k)
    knot += (points[k] - points[k - 1]).norm();
  check(length >= knot, "length", length, "at least " + metres(knot) + ", the length of the knot itself");
  const double tail = 0.5 * (length - knot);
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(points.size()) + (tail > 0 ? 2 : 0));
  const Eigen::Index first = tail > 0 ? 1 : 0;
  for (std::size_t k = 0; k < points.size(); ++k)
    all.col(first + static_cast<Eigen::Index>(k)) = points[k];
  if (tail > 0)
  {
    all.col(0) = points.front() - tail * e1;
    all.rightCols<1>() = points.back() + tail * e1;
  }
  return resampleCurve(all, false, edges);
}

Eigen::Matrix3Xd torusKnotCurve(const Vector3d& center, const Vector3d& axis, double radius, double tube_radius,
                                int around, int through, int edges)
{
  check(edges >= 1, "edges", edges, "at least 1");
  check(radius > 0, "radius", radius, "> 0 m");
  check(tube_radius > 0 && tube_radius < radius, "tube_radius", tube_radius, "in (0, " + metres(radius) + ")");
  check(around >= 1, "around", around, "at least 1");
  check(through >= 1 && std::gcd(around, through) == 1, "through", through,
        "at least 1 and without a common divisor with around = " + std::to_string(around));
  Eigen::Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  Vector3d e3, e1;
  std::tie(e3, e1) = plane(axis, "axis", Vector3d::Unit(least), "axis");
  const Vector3d e2 = e3.cross(e1);
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
  {
    const double t = 2 * M_PI * (i % edges) / edges;
    const double r = radius + tube_radius * std::cos(through * t);
    nodes.col(i) =
        center + r * (std::cos(around * t) * e1 + std::sin(around * t) * e2) + tube_radius * std::sin(through * t) * e3;
  }
  return nodes;
}

Eigen::Matrix3Xd veeCurve(const Vector3d& tip, const Vector3d& direction, const Vector3d& normal, double arm,
                          double angle, int edges)
{
  check(edges >= 2 && edges % 2 == 0, "edges", edges, "even");
  check(arm > 0, "arm", arm, "> 0 m");
  check(angle > 0 && angle < M_PI, "angle", angle, "in (0, pi) rad");
  Vector3d e1, e3;
  std::tie(e1, e3) = plane(direction, "direction", normal, "normal");
  const Vector3d across = e3.cross(e1);
  Eigen::Matrix3Xd nodes(3, edges + 1);
  const int half = edges / 2;
  for (int i = 0; i <= edges; ++i)
  {
    const double s = arm * (i - half) / half;
    nodes.col(i) = tip + std::abs(s) * std::cos(0.5 * angle) * e1 + s * std::sin(0.5 * angle) * across;
  }
  return nodes;
}

}   // namespace slender
