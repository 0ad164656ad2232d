#pragma once

#include "slender_sim/rod/rod_model.h"

/// Natural twist and curvature that the centreline of a rod does not show (thesis 4.2.3), and the frames that go with
/// them.
namespace slender {

/// Shares `total` [rad] among the nodes in proportion to their Voronoi lengths. The ends of an open rod get the share
/// of half an edge, which a clamp there uses.
Eigen::VectorXd evenTwist(const RodModel& model, double total);

/// Adds `twist` [rad], one entry per node, to the natural twist. The material frames turn along the natural shape,
/// which stays as it is: its curvature is expressed in the turned frames. In a closed rod the total may be any angle;
/// the curvature at node 0 is then the mean of what the frames on its two sides see. Throws std::invalid_argument for a
/// wrong number of entries or one that is not finite.
void addNaturalTwist(RodModel& model, const Eigen::VectorXd& twist);

/// Replaces the natural curvature: `curvature` has the columns (kappa1, kappa2) [1/m], one per node, in the frame half
/// way of the joint's twist. Call this after addNaturalTwist. Throws std::invalid_argument for a wrong number of
/// columns, or where a joint turns by 2 rad or more: such a joint needs shorter edges.
void setNaturalCurvature(RodModel& model, const Eigen::Matrix2Xd& curvature);

/// Turns the frames of a framed state by the running sum of `twist` [rad], one entry per node, and adds it to the
/// state's twist. The total of a closed rod must be whole turns. Call this before grasps are made.
void turnFramesAlong(RodState& state, const Eigen::VectorXd& twist);

/// Whether every joint bends alike in all directions.
bool isIsotropic(const RodModel& model);

}   // namespace slender
