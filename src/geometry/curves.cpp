#include "slender_sim/geometry/curves.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <Eigen/Geometry>

namespace slender {

namespace {

template <class Value>
[[noreturn]] void refuse(const char* name, const Value& value, const char* allowed)
{
  std::ostringstream text;
  text << name << " = " << value << ": must be " << allowed;
  throw std::invalid_argument(text.str());
}

void checkEdges(int edges)
{
  if (edges < 1)
    refuse("edges", edges, "at least 1");
}

Eigen::Vector3d unitAxis(const Eigen::Vector3d& axis, const char* name)
{
  const double length = axis.norm();
  if (!(length > 1e-12) || !std::isfinite(length))
    refuse(name, axis.transpose(), "a vector of non-zero, finite length");
  return axis / length;
}

/// u > 0 with sinh(u) / u = ratio > 1.
double solveSinhQuotient(double ratio)
{
  // Newton on log(sinh(u)/u) - log(ratio), which is monotone and nearly linear for large u; sqrt(6 (ratio - 1)) is the
  // small-u expansion. log sinh u = u + log(1 - exp(-2u)) - log 2 does not overflow.
  const double target = std::log(ratio);
  double u = ratio < 3 ? std::sqrt(6 * (ratio - 1)) : std::log(2 * ratio) + std::log(std::log(2 * ratio));
  for (int k = 0; k < 100; ++k)
  {
    const double value =
        u < 1e-3 ? u * u / 6 - u * u * u * u / 180 : u + std::log1p(-std::exp(-2 * u)) - std::log(2 * u);
    const double slope = u < 1e-3 ? u / 3 : 1 / std::tanh(u) - 1 / u;
    const double next = std::max(0.1 * u, u - (value - target) / slope);
    if (std::abs(next - u) <= 1e-15 * u)
      break;
    u = next;
  }
  return u;
}

}   // namespace

Eigen::Matrix3Xd straightCurve(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int edges, double grading)
{
  checkEdges(edges);
  if (!(grading > 0) || !std::isfinite(grading))
    throw std::invalid_argument("grading must be positive, got " + std::to_string(grading));
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
  {
    const double u = static_cast<double>(i) / edges;
    const double s = grading == 1.0 ? u : u * (2 + (grading - 1) * u) / (1 + grading);
    nodes.col(i) = (1 - s) * from + s * to;
  }
  return nodes;
}

Eigen::Matrix3Xd arcCurve(const Eigen::Vector3d& center, const Eigen::Vector3d& start, const Eigen::Vector3d& axis,
                          double angle, int edges)
{
  checkEdges(edges);
  const Eigen::Vector3d n = unitAxis(axis, "axis");
  const Eigen::Vector3d arm = start - center;
  if (!(arm.cross(n).norm() > 1e-9 * (arm.norm() + 1e-300)))
    refuse("start", start.transpose(), "off the axis through center");
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
    nodes.col(i) = center + Eigen::AngleAxisd(angle * i / edges, n) * arm;
  return nodes;
}

Eigen::Matrix3Xd helixCurve(const Eigen::Vector3d& center, const Eigen::Vector3d& axis, double radius, double pitch,
                            double turns, int edges)
{
  checkEdges(edges);
  if (!(radius > 0))
    refuse("radius", radius, "> 0 m");
  const Eigen::Vector3d n = unitAxis(axis, "axis");
  // The seed is the coordinate axis least along n; x for a vertical helix, so that it starts at center + radius * x.
  int least = 0;
  n.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d u = (Eigen::Vector3d::Unit(least) - n[least] * n).normalized();
  const Eigen::Vector3d v = n.cross(u);
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
  {
    const double turn = turns * i / edges;
    const double angle = 2 * M_PI * turn;
    nodes.col(i) = center + radius * (std::cos(angle) * u + std::sin(angle) * v) + pitch * turn * n;
  }
  return nodes;
}

Eigen::Matrix3Xd catenaryCurve(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double length,
                               const Eigen::Vector3d& down, int edges)
{
  checkEdges(edges);
  const Eigen::Vector3d up = -unitAxis(down, "down");
  const Eigen::Vector3d span = to - from;
  const double distance = span.norm();
  if (!(length >= distance * (1 - 1e-12)) || !(length > 0))
    refuse("length", length, ("at least the distance of the ends, " + std::to_string(distance) + " m").c_str());
  const double rise = span.dot(up);
  const Eigen::Vector3d across = span - rise * up;
  const double width = across.norm();
  const double ratio = std::sqrt(std::max(0.0, (length - rise) * (length + rise))) / width;
  if (!(ratio > 1 + 1e-12) && width > 0)
    return straightCurve(from, to, edges);
  if (!(width > 1e-4 * length))
  {
    refuse("to", to.transpose(),
           "not above or below `from`: there the chain folds back on itself; give a polyline instead");
  }
  // y = a cosh((x - x0) / a); length and rise between the ends fix a and x0.
  const double u = solveSinhQuotient(ratio);
  const double a = width / (2 * u);
  const double middle = std::atanh(rise / length);   // (mean of x - x0) / a
  const double left = middle - u;                    // (0 - x0) / a
  const Eigen::Vector3d side = across / width;
  Eigen::Matrix3Xd nodes(3, edges + 1);
  for (int i = 0; i <= edges; ++i)
  {
    const double t = std::asinh(std::sinh(left) + length * i / (edges * a));
    nodes.col(i) = from + a * (t - left) * side + a * (std::cosh(t) - std::cosh(left)) * up;
  }
  nodes.col(edges) = to;
  return nodes;
}

Eigen::VectorXd edgeLengths(const Eigen::Matrix3Xd& nodes, bool closed)
{
  const Eigen::Index n = nodes.cols();
  const Eigen::Index edges = closed ? n : n - 1;
  Eigen::VectorXd lengths(std::max<Eigen::Index>(0, edges));
  for (Eigen::Index j = 0; j < edges; ++j)
    lengths[j] = (nodes.col((j + 1) % n) - nodes.col(j)).norm();
  return lengths;
}

Eigen::VectorXd lengthFractions(const Eigen::VectorXd& edge_lengths)
{
  const Eigen::Index n = edge_lengths.size();
  Eigen::VectorXd fractions(n + 1);
  double sum = 0;
  for (Eigen::Index j = 0; j < n; ++j)
  {
    fractions[j] = sum;
    sum += edge_lengths[j];
  }
  fractions /= sum;
  fractions[0] = 0;
  fractions[n] = 1;
  return fractions;
}

Eigen::Matrix3Xd resampleCurve(const Eigen::Matrix3Xd& points, bool closed, int edges)
{
  checkEdges(edges);
  return resampleCurve(points, closed, Eigen::VectorXd::LinSpaced(edges + 1, 0.0, 1.0));
}

Eigen::Matrix3Xd resampleCurve(const Eigen::Matrix3Xd& points, bool closed, const Eigen::VectorXd& fractions)
{
  if (points.cols() < 2)
    refuse("points", points.cols(), "at least 2 points");
  const Eigen::VectorXd lengths = edgeLengths(points, closed);
  const double total = lengths.sum();
  if (!(total > 0) || !std::isfinite(total))
    refuse("length of the polyline", total, "> 0 m");
  const Eigen::Index n = points.cols();
  const Eigen::Index count = closed ? fractions.size() - 1 : fractions.size();
  Eigen::Matrix3Xd nodes(3, count);
  Eigen::Index edge = 0;
  double passed = 0;   // length before `edge`
  for (Eigen::Index i = 0; i < count; ++i)
  {
    const double s = fractions[i] * total;
    while (edge + 1 < lengths.size() && s > passed + lengths[edge])
      passed += lengths[edge++];
    const double part = lengths[edge] > 0 ? std::clamp((s - passed) / lengths[edge], 0.0, 1.0) : 0.0;
    nodes.col(i) = (1 - part) * points.col(edge) + part * points.col((edge + 1) % n);
  }
  if (!closed)
    nodes.col(count - 1) = points.col(n - 1);   // exactly, whatever the sum's round-off
  return nodes;
}

}   // namespace slender
