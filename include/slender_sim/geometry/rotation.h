#pragma once

#include <cmath>

#include <Eigen/Geometry>

namespace slender {

/// v carried from tangent a to tangent b by the smallest rotation (thesis 3.9). a, b unit; undefined for a = -b.
inline Eigen::Vector3d parallelTransport(const Eigen::Vector3d& v, const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  const Eigen::Vector3d c = a.cross(b);
  const double d = a.dot(b);
  return d * v + c * (c.dot(v) / (1.0 + d)) + c.cross(v);
}

/// The matrix of the cross product: skew(v) * w = v x w.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v)
{
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// v turned about the unit axis by `angle` [rad].
inline Eigen::Vector3d rotateAbout(const Eigen::Vector3d& v, const Eigen::Vector3d& axis, double angle)
{
  const double c = std::cos(angle), s = std::sin(angle);
  return c * v + s * axis.cross(v) + ((1.0 - c) * axis.dot(v)) * axis;
}

/// Angle about the unit axis that takes u to v, both normal to it, in (-pi, pi] [rad].
inline double signedAngle(const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector3d& axis)
{
  return std::atan2(u.cross(v).dot(axis), u.dot(v));
}

/// The angle equal to `angle` modulo 2 pi that lies nearest to `expected` [rad].
inline double unwrapNear(double angle, double expected)
{
  return angle + 2.0 * M_PI * std::nearbyint((expected - angle) / (2.0 * M_PI));
}

/// Some unit vector normal to the unit vector t, chosen continuously except at one direction.
inline Eigen::Vector3d anyNormal(const Eigen::Vector3d& t)
{
  Eigen::Index smallest;
  t.cwiseAbs().minCoeff(&smallest);
  return t.cross(Eigen::Vector3d::Unit(smallest)).normalized();
}

/// Returns the smallest rotation that takes the direction of `from` to the direction of `to`. Neither vector may be
/// zero. For opposite directions this rotation is not unique; the half turn about anyNormal(from) is returned.
Eigen::Quaterniond rotationBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Axis times angle of a rotation, |angle| <= pi [rad].
inline Eigen::Vector3d rotationVector(const Eigen::Quaterniond& q)
{
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const double s = q.vec().norm();
  return s < 1e-12 ? Eigen::Vector3d(2.0 * sign * q.vec())
                   : Eigen::Vector3d(q.vec() * (sign * 2.0 * std::atan2(s, sign * q.w()) / s));
}

/// Inverse of rotationVector.
inline Eigen::Quaterniond fromRotationVector(const Eigen::Vector3d& w)
{
  const double angle = w.norm();
  const double scale = angle < 1e-8 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  return Eigen::Quaterniond(std::cos(0.5 * angle), scale * w.x(), scale * w.y(), scale * w.z()).normalized();
}

/// Angular velocity of the rotation exp(r(t)), axes fixed in space: rotationRate(r) r'. In body axes it is
/// rotationRate(-r) r'.
inline Eigen::Matrix3d rotationRate(const Eigen::Vector3d& r)
{
  const double a2 = r.squaredNorm(), a = std::sqrt(a2);
  Eigen::Matrix3d c;
  c << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  const double f = a < 1e-3 ? 0.5 - a2 / 24.0 : (1.0 - std::cos(a)) / a2;
  const double g = a < 1e-3 ? 1.0 / 6.0 - a2 / 120.0 : (a - std::sin(a)) / (a2 * a);
  return Eigen::Matrix3d::Identity() + f * c + g * c * c;
}

}   // namespace slender
