#pragma once

#include <array>
#include <variant>

#include <Eigen/Core>

#include "slender_sim/contact/shape.h"
#include "slender_sim/geometry/pose.h"

namespace slender {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// A convex shape in its own frame. Meshes are taken triangle by triangle.
using ConvexPiece = std::variant<Plane, Sphere, Box, Cylinder, Capsule, Triangle>;

/// Distance of a point from a convex piece. It uses closed formulas. FCL's GJK finds the distance of
/// a capsule to 1e-10 m, but it takes 2 to 5 us where a whole softened contact takes 0.3 us here, and it does not give
/// the curvature and the unique place that smooth forces need (see bench/contact_benchmark.cpp). Outside it is once
/// continuously differentiable and convex in the point.
struct PieceDistance
{
  double distance = 0.0;                                 ///< [m] negative inside (a triangle has no inside)
  Eigen::Vector3d normal;                                ///< its gradient, unit
  Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();   ///< second derivative [1/m], positive semidefinite
};

/// p: in the piece's frame [m].
PieceDistance pieceDistance(const ConvexPiece& piece, const Eigen::Vector3d& p);

/// Radius [m] of the largest ball in a convex piece; infinite for a plane and for a triangle, which is a part of a
/// mesh.
double innerRadius(const ConvexPiece& piece);
/// Radius [m] of the ball about a point that reaches to the surface of a closed mesh around it. Zero if the point is
/// outside, or if the mesh is open.
double ballInMesh(const TriangleMesh& mesh, const Eigen::Vector3d& middle);
/// The part of a place p on a convex piece that rolling does not turn: from the centre of a sphere, or from the axis of
/// a capsule or of the side of a cylinder, to the place. It is zero on other pieces. All in the frame of the piece [m];
/// `normal`: of the contact, unit.
Eigen::Vector3d roundPart(const ConvexPiece& piece, const Eigen::Vector3d& p, const Eigen::Vector3d& normal);
/// What remains of a convex piece without the layer of this depth [m] below its surface. The depth must be less than
/// innerRadius(). A plane and a triangle stay as they are.
ConvexPiece withoutLayer(const ConvexPiece& piece, double depth);

/// Throws std::invalid_argument naming what is wrong with a shape: sizes that are not positive, indices out of range,
/// no triangles.
void checkShape(const Shape& shape);

/// Radius [m] of a ball about the frame's origin that holds the shape; infinite for a plane.
double boundingRadius(const Shape& shape);

/// Distance [m] of a segment from a shape, by places along the segment: enough to tell which of several shapes is
/// nearest.
double distanceToShape(const Shape& shape, const Pose& pose, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}   // namespace slender
