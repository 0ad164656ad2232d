#pragma once

#include "slender_sim/contact/shape.h"
#include "slender_sim/geometry/pose.h"

namespace slender::study {

/// Whether two solids overlap, by more than rounding errors. The tests are those of FCL, but for planes.
bool overlap(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b);

/// Solid angle of a mesh seen from a point [sr] [Van Oosterom & Strackee 1983]. Where the mesh passes through the point
/// it jumps by 4 pi.
double solidAngle(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xi& triangles, const Eigen::Vector3d& p);

/// Whether a point is inside of a closed mesh.
bool isInsideMesh(const TriangleMesh& mesh, const Eigen::Vector3d& p);

}   // namespace slender::study
