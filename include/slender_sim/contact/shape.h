#pragma once

#include <memory>
#include <variant>

#include <Eigen/Core>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Shapes of obstacles and rigid bodies, each in its own frame. Lengths in m.
struct Plane
{};   ///< solid where z < 0
struct Sphere
{
  double radius = 0.1;
};
struct Box
{
  Eigen::Vector3d size{0.1, 0.1, 0.1};
};   ///< full edge lengths, centred
struct Cylinder
{
  double radius = 0.1, length = 0.2;
};   ///< about z, centred
/// about z, centred; length between the centres of its caps
struct Capsule
{
  double radius = 0.1, length = 0.2;
};
using Shape = std::variant<Plane, Sphere, Box, Cylinder, Capsule, std::shared_ptr<const TriangleMesh>>;

struct MassProperties
{
  double volume = 0.0;                                          ///< [m^3]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();             ///< centre of mass [m]
  Eigen::Matrix3d unit_inertia = Eigen::Matrix3d::Identity();   ///< about the centre of mass, per mass [m^2]
};

/// Of a homogeneous solid. Throws std::invalid_argument: a plane, a mesh that is not closed, sizes that are not
/// positive.
MassProperties massProperties(const Shape& shape);

}   // namespace slender
