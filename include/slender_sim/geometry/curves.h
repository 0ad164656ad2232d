#pragma once

#include <Eigen/Core>

/// Node positions [m], 3 x (edges + 1), of the curves that scenes name. All throw std::invalid_argument with name,
/// value and range; `edges` is at least 1 everywhere.
namespace slender {

/// `grading`: length of the last edge over that of the first; lengths grow linearly along the line.
Eigen::Matrix3Xd straightCurve(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int edges, double grading = 1.0);

/// Turns `start` about the axis through `center` by `angle` [rad], at equal angles. `start` must not lie on the axis.
Eigen::Matrix3Xd arcCurve(const Eigen::Vector3d& center, const Eigen::Vector3d& start, const Eigen::Vector3d& axis,
                          double angle, int edges);

/// Right-handed about `axis` for turns > 0 and pitch > 0 (rise per turn along the axis) [m]; starts at height zero over
/// `center`.
Eigen::Matrix3Xd helixCurve(const Eigen::Vector3d& center, const Eigen::Vector3d& axis, double radius, double pitch,
                            double turns, int edges);

/// An inextensible chain of the given length [m] that hangs between two points, at equal arc lengths; `down` need not
/// be a unit vector. A length equal to the distance gives the straight line; a shorter one, or ends (nearly) above each
/// other, throw.
Eigen::Matrix3Xd catenaryCurve(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double length,
                               const Eigen::Vector3d& down, int edges);

/// An overhand (trefoil) knot tied loosely: two tails of equal length on one straight line through `center` along
/// `axis`, a round loop of the given radius on the side away from `up` and, where they meet, two strands wound about
/// each other by one and a half turns. `separation` is the distance of the strands' axes there: rods thicker than 0.8
/// of it may meet themselves. Equal arc lengths.
Eigen::Matrix3Xd trefoilCurve(const Eigen::Vector3d& center, const Eigen::Vector3d& axis, const Eigen::Vector3d& up,
                              double radius, double separation, double length, bool left_handed, int edges);

/// Winds `around` times about the axis through `center` and `through` times about the circle of the given radius, at
/// the distance `tube_radius` from it: 2, 3 is the closed trefoil. The last point is the first. `around` and `through`
/// have no common divisor.
Eigen::Matrix3Xd torusKnotCurve(const Eigen::Vector3d& center, const Eigen::Vector3d& axis, double radius,
                                double tube_radius, int around, int through, int edges);

/// Two straight arms of equal length from `tip`, in the plane with the given normal, at angle/2 [rad] to either side of
/// `direction`; starts on the side of -(normal x direction). `edges` is even, so that the tip is a node.
Eigen::Matrix3Xd veeCurve(const Eigen::Vector3d& tip, const Eigen::Vector3d& direction, const Eigen::Vector3d& normal,
                          double arm, double angle, int edges);

/// Points at equal arc lengths along the polyline through `points`. Closed: the polyline is joined back to its first
/// point, and the result has `edges` points (the joining edge is the last one).
Eigen::Matrix3Xd resampleCurve(const Eigen::Matrix3Xd& points, bool closed, int edges);

/// The same at given fractions of the length, which must rise from 0 to 1 and are as many as the result's points (for a
/// closed polyline the last fraction, 1, is left out of the result).
Eigen::Matrix3Xd resampleCurve(const Eigen::Matrix3Xd& points, bool closed, const Eigen::VectorXd& fractions);

/// Fractions of the length at the nodes of a curve with these edge lengths: 0 ... 1.
Eigen::VectorXd lengthFractions(const Eigen::VectorXd& edge_lengths);

/// Lengths [m] of the edges between consecutive nodes, and back to the first when closed.
Eigen::VectorXd edgeLengths(const Eigen::Matrix3Xd& nodes, bool closed);

}   // namespace slender
