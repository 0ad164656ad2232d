#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/contact/shape.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

/// What a simulated body shows to solids: segments and triangles with a radius, between points in the frame of the
/// body. Where two bodies meet, the pieces of each touch the solid of the other.
struct BodySurface
{
  struct Segment
  {
    int a, b;        ///< points
    double radius;   ///< [m]
  };
  Eigen::Matrix3Xd points;   ///< [m]
  std::vector<Segment> segments;
  std::vector<std::array<int, 3>> triangles;
  double radius = 0.0;   ///< of the triangles [m]
  bool empty() const { return segments.empty() && triangles.empty(); }
};

constexpr int kSidesOfCylinder = 64;   ///< of the prism that stands for a cylinder

/// The surface of a shape in the frame X_BS: one segment of a sphere (without length) or a capsule, the faces of a box,
/// of a prism inside a cylinder, or of a mesh. Edges of a box and of a prism are rounded by a thousandth of their
/// shortest side. A mesh grows on all sides by a thousandth of the shortest side of the box around it, and by no less
/// than a ten-thousandth of the longest one. Throws std::invalid_argument for a plane.
BodySurface makeBodySurface(const Shape& shape, const Pose& X_BS);

}   // namespace slender
