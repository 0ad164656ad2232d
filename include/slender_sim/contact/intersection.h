#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/contact/contact_surface.h"
#include "slender_sim/contact/impulses/collision_surface.h"

/// Intersections of triangles as they stand, decided exactly whatever the rounding, and without any search structure of
/// the collision code: what studies and tests check results with.
namespace slender {

/// Sign of the volume of (a, b, c, d): positive if d lies on the side of the triangle a, b, c from which it is seen
/// clockwise. Exact.
int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d);

/// Whether a segment and a triangle have a point in common, touching included. Exact.
bool segmentMeetsTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// An edge of a sheet or solid that meets a triangle which has none of its points.
struct Intersection
{
  int edge[2], triangle[3];   ///< points: those of the sheets, then those of solids that are meshes
};

/// All intersections of a surface at points x [m] among pieces that may touch: of sheets with themselves, each other
/// and meshes. Faces that touch or enter other solids are given by two of their corners and the triangle -1, -1, solid.
std::vector<Intersection> intersections(const CollisionSurface& surface, const Eigen::Matrix3Xd& x,
                                        const std::vector<Pose>& solids);

}   // namespace slender
