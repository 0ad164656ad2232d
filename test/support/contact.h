#pragma once

#include <cmath>

#include "contact/contact_potential.h"
#include "slender_sim/geometry/rotation.h"
#include "test/support/random.h"

namespace slender::test {

constexpr double kContactGap = 0.02, kCurveRadius = 0.05;   // [m]

/// Appends a polyline as an object of a contact surface; x grows by its nodes.
inline void addCurve(ContactSurface& surface, Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& nodes, double radius,
                     double friction = 0.0, bool closed = false)
{
  const int first = surface.points, n = static_cast<int>(nodes.cols()),
            object = static_cast<int>(surface.objects.size());
  x.conservativeResize(3, first + n);
  x.rightCols(n) = nodes;
  surface.points += n;
  double start = 0.0;
  for (int i = 0; i + 1 < n + (closed ? 1 : 0); ++i)
  {
    const int next = (i + 1) % n;
    const double length = (nodes.col(next) - nodes.col(i)).norm();
    surface.segments.push_back({first + i, first + next, radius, object, start, length});
    start += length;
  }
  ContactObject curve;
  curve.curve_length = start;
  curve.closed = closed;
  curve.friction = friction;
  surface.objects.push_back(curve);
}

/// Appends triangles as an object of a contact surface; x grows by their corners. `triangles` counts from 0.
inline ContactObject& addSheet(ContactSurface& surface, Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& corners,
                               const Eigen::Matrix3Xi& triangles, double thickness, double friction = 0.0)
{
  const int first = surface.points, n = static_cast<int>(corners.cols());
  x.conservativeResize(3, first + n);
  x.rightCols(n) = corners;
  surface.points += n;
  for (Eigen::Index i = 0; i < triangles.cols(); ++i)
  {
    const Eigen::Vector3i t = triangles.col(i).array() + first;
    surface.triangles.push_back({{t[0], t[1], t[2]}, 0.5 * thickness, static_cast<int>(surface.objects.size())});
  }
  ContactObject sheet;
  sheet.friction = friction;
  sheet.thickness = thickness;
  sheet.first_point = first;
  surface.objects.push_back(sheet);
  return surface.objects.back();
}

/// dE/dx from the terms, 3 x points.
inline Eigen::Matrix3Xd gradient(const ContactPotential& potential, Eigen::Index points)
{
  Eigen::Matrix3Xd g = Eigen::Matrix3Xd::Zero(3, points);
  for (const ContactTerm& term : potential.terms())
    for (int i = 0; i < 4; ++i)
      if (term.point[i] >= 0)
        g.col(term.point[i]) -= term.share(i, term.force);
  return g;
}

/// Second derivative from the terms and rows with the solids at rest, 3 points x 3 points; `whole`: with what may be
/// negative.
inline Eigen::MatrixXd hessian(const ContactPotential& potential, Eigen::Index points, bool whole)
{
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(3 * points, 3 * points);
  for (const ContactTerm& term : potential.terms())
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        if (term.point[i] >= 0 && term.point[j] >= 0)
        {
          auto block = h.block<3, 3>(3 * term.point[i], 3 * term.point[j]);
          block += term.block(i, j, term.stiffness);
          if (whole)
            block += term.weight[i] * term.weight[j] * term.geometric;
        }
  for (const ContactRow& row : potential.rows())
  {
    Eigen::VectorXd r = Eigen::VectorXd::Zero(3 * points);
    for (int i = 0; i < 4; ++i)
      if (row.point[i] >= 0)
        r.segment<3>(3 * row.point[i]) += row.along[i] * row.normal + (whole ? row.across[i] : 0.0) * row.turning;
    h += row.stiffness * r * r.transpose();
  }
  return h;
}

/// The configuration reached from a pose by a small shift and turn about its origin.
inline Pose moved(const Pose& pose, const Eigen::Vector3d& shift, const Eigen::Vector3d& turn)
{
  return {pose.position + shift, fromRotationVector(turn) * pose.orientation};
}

/// Largest error of the gradient by central differences over the largest force, over points and, if any, the solids'
/// poses. The potential is that of the surface.
inline double gradientError(ContactPotential& potential, const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids,
                            double step = 1e-7)
{
  potential.evaluate(x, solids, false);
  const std::vector<ContactTerm> terms = potential.terms();
  const Eigen::Matrix3Xd g = gradient(potential, x.cols());
  double error = 0.0;
  for (Eigen::Index i = 0; i < x.size(); ++i)
  {
    Eigen::Matrix3Xd plus = x, minus = x;
    plus(i) += step;
    minus(i) -= step;
    const double slope =
        (potential.evaluate(plus, solids, false) - potential.evaluate(minus, solids, false)) / (2 * step);
    error = std::max(error, std::abs(slope - g(i)));
  }
  for (std::size_t k = 0; k < solids.size(); ++k)
  {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();   // on the solid
    for (const ContactTerm& term : terms)
      if (term.solid == static_cast<int>(k))
      {
        force -= term.force;
        torque -= (term.position - solids[k].position).cross(term.force);
      }
    for (int d = 0; d < 6; ++d)
    {
      const Eigen::Vector3d unit = step * Eigen::Vector3d::Unit(d % 3), none = Eigen::Vector3d::Zero();
      std::vector<Pose> plus = solids, minus = solids;
      plus[k] = moved(solids[k], d < 3 ? unit : none, d < 3 ? none : unit);
      minus[k] = moved(solids[k], d < 3 ? -unit : none, d < 3 ? none : -unit);
      const double slope = (potential.evaluate(x, plus, false) - potential.evaluate(x, minus, false)) / (2 * step);
      error = std::max(error, std::abs(slope + (d < 3 ? force : torque)[d % 3]));
    }
  }
  return error / g.colwise().norm().maxCoeff();
}

/// Largest error of the whole second derivative by central differences of forces along random displacements of the
/// points, over the largest change.
inline double hessianError(ContactPotential& potential, const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids,
                           Random& random, double step = 1e-7)
{
  potential.evaluate(x, solids, true);
  const Eigen::MatrixXd h = hessian(potential, x.cols(), true);
  double worst = 0.0;
  for (int trial = 0; trial < 3; ++trial)
  {
    Eigen::Matrix3Xd u(3, x.cols());
    for (int c = 0; c < 3; ++c)
      u.row(c) = random.numbers(static_cast<int>(x.cols()), step);
    potential.evaluate(x + u, solids, false);
    Eigen::Matrix3Xd change = gradient(potential, x.cols());
    potential.evaluate(x - u, solids, false);
    change = 0.5 * (change - gradient(potential, x.cols()));
    const Eigen::VectorXd predicted = h * Eigen::Map<const Eigen::VectorXd>(u.data(), u.size());
    worst = std::max(
        worst, (Eigen::Map<const Eigen::MatrixXd>(predicted.data(), 3, x.cols()) - change).norm() / change.norm());
  }
  return worst;
}

/// Moves a piece of a configuration along a direction until the clearance is as given: `at(s)` sets it at s [m] and
/// returns the clearance, which rises where pieces are apart. Returns false if none is found up to `most`.
template <class At>
bool bringTo(double clearance, double most, At at)
{
  double low = 0.0, high = most;
  for (int i = 0; i < 60; ++i)
  {
    const double s = 0.5 * (low + high);
    (at(s) > clearance ? high : low) = s;
  }
  return std::abs(at(high) - clearance) < 1e-6 * most;
}

/// A surface to test barriers of width kContactGap with.
struct ContactCase
{
  ContactSurface surface;
  Eigen::Matrix3Xd x;
  std::vector<Pose> solids;

  ContactPotential potential(double stiffness = 3.0) const
  {
    ContactOptions options;
    options.gap = kContactGap;
    ContactPotential p(surface, options);
    p.setStiffness(stiffness);
    return p;
  }
};

/// Central differences over 1e-7 m err by 1e-6 where the barrier's third derivative is at most 1e8 N/m^2 at forces of
/// some newtons.
constexpr double kDifferences = 2e-6;

}   // namespace slender::test
