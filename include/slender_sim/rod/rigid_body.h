#pragma once

#include <string>

#include <Eigen/Core>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// What matters of a rigid body if forces move it. Its frame has its origin at the centre of mass.
struct BodyProperties
{
  std::string name;
  double mass = 1.0;   ///< [kg] > 0
  /// about the centre of mass, body axes [kg m^2], positive definite and physical
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();
  bool gravity = true;
  Eigen::Vector3d force{0, 0, 0};    ///< constant, world axes, at the centre of mass [N]
  Eigen::Vector3d torque{0, 0, 0};   ///< constant, world axes [N m]
  double linear_damping = 0.0;       ///< force -c m v [1/s]
  double angular_damping = 0.0;      ///< torque -c I omega, about [1/s]
};

/// Fixed properties of a rigid body.
struct RigidBodyModel : BodyProperties
{
  bool simulated = true;   ///< false: its motion is given from outside, and mass and loads do not matter
};

/// Throws std::invalid_argument naming what is wrong with a simulated body: mass or inertia not positive, an inertia
/// that no distribution of mass has (the sum of two principal moments less than the third), numbers not finite.
void checkBody(const BodyProperties& body);

/// Everything that changes while a body moves.
struct RigidBodyState
{
  Pose X_WB;
  Twist velocity;   ///< linear: of the centre of mass; world axes

  /// Integrator memory, as of rods.
  double last_step = 0.0;   ///< length of the last substep [s]; 0: none
  Eigen::Vector3d linear_acceleration{0, 0, 0}, angular_acceleration{0, 0, 0};
  Pose X_previous;
  Twist velocity_previous;
};

/// Welds a section or edges of a rod to a body: grasp number `grasp` of that rod's state follows the body rigidly.
struct Weld
{
  int rod = 0, grasp = 0, body = 0;
  Pose X_BG;   ///< the grasp's frame in the body's
};

}   // namespace slender
