#pragma once

#include "slender_sim/tracking/weak_constraints.h"

/// Test functions along a curve that tracks a polyline (thesis 6.4.3). Which points of the two belong together is told
/// by shares of their lengths: numbers that rise from 0 to 1, one per node, and of closed curves a last one, 1, for the
/// first node again (see lengthFractions()).
namespace slender {

/// Weights by which a polyline through nodes at the shares `guide` gives its points at the shares `nodes`: nodes x
/// guide nodes.
MassMatrix polylineWeights(const Eigen::VectorXd& guide, const Eigen::VectorXd& nodes, bool closed);

/// The guide's hat functions, one per node of the guide, at the nodes of the curve, for the weights above.
TestFunctions curveHats(const MassMatrix& weights);

/// `count` functions that are 1 on as many equal parts of the curve's length, 0 elsewhere; two share a node that lies
/// where they meet.
TestFunctions curveSegments(int count, const Eigen::VectorXd& nodes, bool closed);

/// Averages along the curve at rest (nodes 3 x n [m]): of itself, and of the guide's points that belong to its nodes. A
/// curve that lies on its guide so has its averages, however coarse that is.
WeakConstraints curveConstraints(TestFunctions functions, const MassMatrix& weights, const Eigen::Matrix3Xd& rest,
                                 bool closed);

}   // namespace slender
