#pragma once

#include <cmath>

#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/geometry/rotation.h"
#include "test/support/random.h"

namespace slender::test {

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

/// dE/dx from the terms, 3 x points.
inline Eigen::Matrix3Xd gradient(const ContactPotential& potential, Eigen::Index points)
{
  Eigen::Matrix3Xd g = Eigen::Matrix3Xd::Zero(3, points);
  for (const ContactTerm& term : potential.terms())
    for (int i = 0; i < 4; ++i)
      if (term.point[i] >= 0)
        g.col(term.point[i]) -= term.weight[i] * term.force;
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
          block += term.weight[i] * term.weight[j] * term.stiffness;
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

}   // namespace slender::test
