#pragma once

#include <vector>

#include <Eigen/Core>

namespace slender {

/// Everything that changes while a cloth moves; saving and restoring it restarts bit-equal.
struct ClothState
{
  Eigen::Matrix3Xd x;            ///< vertices [m], 3 x n
  Eigen::Matrix3Xd v;            ///< velocities [m/s], 3 x n
  Eigen::VectorXd rest_angles;   ///< per hinge [rad], hinge bending only: plastic flow moves them
  Eigen::VectorXd stiffening;    ///< per hinge: what plastic flow multiplied its stiffness by; with plasticity only
  std::vector<int> pins;         ///< held vertices, ascending
  int average_set = 0;           ///< of the model's, that is prescribed; whoever changes it clears at_bound
  std::vector<int> at_bound;     ///< averages of that set whose forces were at their bounds in the last step, ascending
  double next_step = 0;          ///< [s] of adaptive steps; 0: try the whole step
};

}   // namespace slender
