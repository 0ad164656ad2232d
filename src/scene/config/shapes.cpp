#include "slender_sim/scene/shapes.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "slender_sim/geometry/curves.h"

namespace slender {

namespace {

constexpr double coincident = 1e-7;   // of the curve's length: nodes closer than this are one

bool endsMeet(const Eigen::Matrix3Xd& nodes)
{
  const double length = edgeLengths(nodes, false).sum();
  return nodes.cols() > 2 && (nodes.col(nodes.cols() - 1) - nodes.col(0)).norm() <= coincident * length;
}

Eigen::Matrix3Xd dropLast(const Eigen::Matrix3Xd& nodes) { return nodes.leftCols(nodes.cols() - 1); }

/// Returns the points of the curve. A formula makes so many edges. A polyline keeps its points.
Eigen::Matrix3Xd curvePoints(const Curve& curve, const Eigen::Vector3d& gravity, int edges)
{
  if (curve.formula)
    return curve.formula(edges, gravity);
  return Eigen::Map<const Eigen::Matrix3Xd>(curve.points.at(0).data(), 3,
                                            static_cast<Eigen::Index>(curve.points.size()));
}

}   // namespace

Curve straightLine(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int edges, double grading)
{
  return {edges, [=](int n, const Eigen::Vector3d&) { return straightCurve(from, to, n, grading); }};
}

Eigen::Matrix3Xd curveNodes(const Curve& curve, const Eigen::Vector3d& gravity)
{
  return curvePoints(curve, gravity, curve.edges.value_or(0));
}

Eigen::Matrix3Xd restNodes(const RodConfig& rod, const Eigen::Vector3d& gravity)
{
  Eigen::Matrix3Xd nodes = curveNodes(rod.centerline, gravity);
  if (rod.closed && endsMeet(nodes))
    nodes = dropLast(nodes);
  const bool resampled = !rod.centerline.formula && rod.centerline.edges;
  return resampled ? resampleCurve(nodes, rod.closed, *rod.centerline.edges) : nodes;
}

Eigen::Matrix3Xd initialNodes(const RodConfig& rod, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& gravity)
{
  if (!rod.initial)
    return rest;
  const Eigen::VectorXd lengths = edgeLengths(rest, rod.closed);
  const bool uniform = lengths.maxCoeff() - lengths.minCoeff() <= 1e-9 * lengths.mean();
  const int edges = static_cast<int>(lengths.size());
  // Formulas give the nodes themselves where the rest edges are equal; else many points, to be sampled at the rest
  // spacing.
  const int asked = uniform ? edges : 16 * edges;
  Eigen::Matrix3Xd points = curvePoints(*rod.initial, gravity, asked);
  if (rod.closed)
    points = endsMeet(points) ? dropLast(points) : curvePoints(*rod.initial, gravity, asked - 1);
  const bool as_given = points.cols() == rest.cols() && (rod.initial->formula ? uniform : !rod.initial->edges);
  return as_given ? points : resampleCurve(points, rod.closed, lengthFractions(lengths));
}

std::vector<double> perEdge(const std::vector<double>& values, int edges, const char* name)
{
  const auto count = static_cast<std::size_t>(edges);
  if (values.size() == count)
    return values;
  if (values.size() == 1)
    return std::vector<double>(count, values[0]);
  if (values.size() == 2)
  {
    std::vector<double> all(count);
    for (std::size_t j = 0; j < count; ++j)
    {
      const double s = count > 1 ? static_cast<double>(j) / static_cast<double>(count - 1) : 0.5;
      all[j] = (1 - s) * values[0] + s * values[1];
    }
    return all;
  }
  throw std::invalid_argument(std::string(name) + " has " + std::to_string(values.size()) +
                              " entries; must have 1, 2 (taper) or " + std::to_string(edges) + " (one per edge)");
}

std::vector<RodSection> rodSections(const RodConfig& rod, int edges)
{
  const std::vector<double> a = perEdge(rod.cross_section.a, edges, "cross_section (a)");
  const std::vector<double> b = perEdge(rod.cross_section.b, edges, "cross_section (b)");
  const Material& material = rod.material;
  const double youngs = material.youngs_modulus;
  const double shear = youngs / (2 * (1 + material.poissons_ratio));
  std::vector<RodSection> sections(static_cast<std::size_t>(edges));
  for (std::size_t j = 0; j < sections.size(); ++j)
  {
    RodSection& section = sections[j];
    const double a2 = a[j] * a[j], b2 = b[j] * b[j];
    const double area = M_PI * a[j] * b[j];
    const double torsion = material.torsion == Torsion::polar ? area * (a2 + b2) / 4 : area * a2 * b2 / (a2 + b2);
    section.a = a[j];
    section.b = b[j];
    section.linear_density = material.linear_density.value_or(material.density * area);
    section.stretch_modulus = material.stretch_modulus.value_or(youngs * area);
    section.bend_modulus =
        material.bend_modulus.value_or(Eigen::Matrix2d(Eigen::Vector2d(a2, b2).asDiagonal()) * (youngs * area / 4));
    section.twist_modulus = material.twist_modulus.value_or(shear * torsion);
  }
  return sections;
}

}   // namespace slender
