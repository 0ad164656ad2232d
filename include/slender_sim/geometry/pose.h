#pragma once

#include <Eigen/Geometry>

namespace slender {

/// Rigid pose X_AB: a point p_B in frame B has the coordinates position + orientation * p_B in frame A.
struct Pose
{
  Eigen::Vector3d position = Eigen::Vector3d::Zero();                ///< [m]
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();   ///< unit

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return position + orientation * p; }
  Pose operator*(const Pose& other) const
  {
    return {position + orientation * other.position, (orientation * other.orientation).normalized()};
  }
  Pose inverse() const
  {
    const Eigen::Quaterniond q = orientation.conjugate();
    return {-(q * position), q};
  }
};

/// Velocity of a moving frame, in world axes.
struct Twist
{
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();    ///< of the frame's origin [m/s]
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();   ///< [rad/s]
};

/// A force and a torque in world axes. Whoever gives a wrench says what exerts it, and about which point.
struct Wrench
{
  Eigen::Vector3d force = Eigen::Vector3d::Zero();    ///< [N]
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();   ///< [N m]

  /// Adds the force `more` [N], which acts at a point. `at` [m] is the way to this point from the point about which the
  /// torque is taken.
  void add(const Eigen::Vector3d& more, const Eigen::Vector3d& at)
  {
    force += more;
    torque += at.cross(more);
  }
};

}   // namespace slender
