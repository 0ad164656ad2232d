#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/linalg/point_matrix.h"

namespace slender {

/// E = 1/2 int H^2 of a surface, H the sum of the principal curvatures [-]: 8 pi for a sphere of any size. By Gauss and
/// Bonnet it differs by a constant from twice the Willmore energy int (H^2/4 - K) where the surface is closed, or its
/// boundary fixed up to first order.
///
/// Conforming as isometricBending(), but of the surface as it is: E = sum 1/2 |l_i|^2 / A_i over vertices, l_i = sum_j
/// (cot a_ij + cot b_ij) (x_j - x_i) / 2, which is minus the gradient of the area, and A_i a third of the faces around
/// (barycentric: Voronoi cells, cut off in obtuse faces, have no derivative at right angles). It is not changed by
/// motions and scaling of the surface. It converges where vertices are free to settle, by a small part of an edge, or
/// have like faces around; on a surface that neighbours with four and eight right-angled faces sample exactly
/// (GridPattern::alternating) it is 9/8 as large.
class WillmoreEnergy
{
public:
  /// `counted`: vertices that have a term; those on a boundary cannot, as their faces do not close around them. Faces
  /// that touch no counted vertex are not needed. Throws std::invalid_argument for sizes that do not fit.
  WillmoreEnergy(const Eigen::Matrix3Xi& faces, std::vector<char> counted);

  /// Points have 4 doubles. Infinite where a face has no area, or a number is not finite. Uses work space: one thread
  /// at a time.
  double energy(const double* x);
  /// Adds dE/dx; returns E, and adds nothing where that is infinite.
  double addGradient(const double* x, double* gradient);

  /// Whether a face's normal turns by a right angle or more between two shapes.
  bool foldsOver(const double* from, const double* to) const;

private:
  Eigen::Matrix3Xi faces_;
  std::vector<char> counted_;
  PointVector curvature_;   ///< of each vertex: l and A, then l/A and |l/A|^2 / 2
};

}   // namespace slender
