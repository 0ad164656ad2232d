#pragma once

#include <Eigen/Geometry>

namespace slender {

/// Angular velocity of a rigid body with this angular momentum, world axes; inertia in body axes.
Eigen::Vector3d angularVelocity(const Eigen::Matrix3d& inertia, const Eigen::Quaterniond& q,
                                const Eigen::Vector3d& momentum);

/// Orientation, after h seconds without torque, of a rigid body with this angular momentum (world axes). The method is
/// the midpoint rule for the momentum in body axes; the turn of a part of the time is the exponential of the rotation
/// vector. The method is of second order and exact for rotation about a principal axis. It keeps momentum and energy to
/// round-off.
Eigen::Quaterniond rotateFreely(const Eigen::Matrix3d& inertia, const Eigen::Quaterniond& q,
                                const Eigen::Vector3d& momentum, double h);

}   // namespace slender
