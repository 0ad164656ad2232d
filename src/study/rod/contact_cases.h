#pragma once

#include "group_cases.h"

namespace slender::study {

/// Appends a rod that touches everything. Returns its index.
int addTouching(GroupSetup& group, const RodSetup& rod, double friction);
int addObstacle(GroupSetup& group, const Shape& shape, const Pose& pose, double friction = -1.0);

/// A rod (naturally straight, free) through the given points, resampled to equal edges.
RodSetup rodThrough(const Eigen::Matrix3Xd& points, bool closed, double radius, double youngs_modulus, double density,
                    int edges);

/// Points of an open overhand (trefoil) knot about the origin whose tails leave along -x and +x; `size` is about the
/// radius of its loops.
Eigen::Matrix3Xd overhandKnot(double size, double tail);

/// Smallest distance between surfaces of rods that may touch, and of these and obstacles (plane, sphere, capsule);
/// negative when they penetrate. All pairs, by formulas of its own.
double bruteForceClearance(const GroupSetup& group);

}   // namespace slender::study
