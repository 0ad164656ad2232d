#pragma once

#include <Eigen/Core>

/// Closest points of points, segments and triangles. Exact up to rounding for every position, degenerate ones included
/// (parallel or crossing segments, segments and triangles without extent).
namespace slender {

/// The point a + t (b - a), 0 <= t <= 1, nearest to p.
double closestOnSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Points a0 + s (a1 - a0) and b0 + t (b1 - b0).
struct SegmentPair
{
  double s = 0.0, t = 0.0;
};

/// Where two segments are nearest to each other; one of many places when they are parallel.
SegmentPair closestOfSegments(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                              const Eigen::Vector3d& b1);

/// Barycentric coordinates of the point of a triangle nearest to p; exactly zero for the corners that it does not
/// depend on [Ericson, Real-Time Collision Detection, 5.1.5].
Eigen::Vector3d closestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c);

/// Distance [m] of the points that the functions above find.
double pointSegmentDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b);
double segmentDistance(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                       const Eigen::Vector3d& b1);
double pointTriangleDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                             const Eigen::Vector3d& c);

}   // namespace slender
