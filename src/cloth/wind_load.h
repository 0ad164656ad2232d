#pragma once

#include <vector>

#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/linalg/block_matrix.h"
#include "slender_sim/linalg/point_matrix.h"

namespace slender {

/// Force of the air on a cloth. Each corner carries a third of its faces and feels the air by its own velocity.
class WindLoad
{
public:
  /// Throws std::invalid_argument for coefficients that are not valid.
  explicit WindLoad(const ClothModel& model);

  /// False: no force, and nothing else may be called.
  bool active() const { return !drag_.empty(); }

  /// For a step at whose end the velocities are (x - origin) / h; now they are v (3 x n), and the faces as they are at
  /// `start` count. What depends linearly on the velocities at the end becomes the potential below. Of drag and lift
  /// that is a positive semidefinite part of the derivative: all of it for the drag of a flow along the normal; the
  /// rest is taken at v. Adds to `force` what is constant.
  void begin(const PointVector& start, const PointVector& origin, const Eigen::Matrix3Xd& v,
             const Eigen::Vector3d& wind, double h, PointVector& force);
  /// Potential 1/2 (x - y)^T D (x - y) of a vertex at x; adds its gradient to `slope`.
  double addGradient(int vertex, const Eigen::Vector3d& x, Eigen::Vector3d& slope) const;
  void addHessian(BlockMatrix& matrix) const;

  /// Forces at the velocities v [N], added.
  void addForces(const PointVector& x, const PointVector& v, const Eigen::Vector3d& wind, PointVector& force) const;

private:
  const ClothModel& model_;
  double drag_factor_, lift_factor_;    ///< 1/2 rho C [kg/m^3]
  std::vector<Eigen::Matrix3d> drag_;   ///< D of each vertex
  PointVector target_;                  ///< y
};

}   // namespace slender
