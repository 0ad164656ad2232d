#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/contact/shape.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

/// What a simulated body shows to solids: segments with a radius between points in the frame of the body. Where two
/// bodies meet, the segments of each touch the solid of the other.
struct BodySurface
{
  struct Segment
  {
    int a, b;        ///< points
    double radius;   ///< [m]
  };
  Eigen::Matrix3Xd points;   ///< [m]
  std::vector<Segment> segments;
};

/// Whether bodies of this shape touch solids: spheres, capsules and boxes do.
bool hasBodySurface(const Shape& shape);

/// The surface of a shape in the frame X_BS: one segment of a sphere (without length) or a capsule; the edges of a box,
/// which are rounded by a twentieth of its shortest side. Throws std::invalid_argument for other shapes.
BodySurface makeBodySurface(const Shape& shape, const Pose& X_BS);

}   // namespace slender
