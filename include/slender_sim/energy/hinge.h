#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/energy/hinge_kernel.h"
#include "slender_sim/linalg/block_matrix.h"

namespace slender {

enum class HessianKind
{
  exact,
  semidefinite   ///< positive semidefinite and not below the exact one, so that a Newton step descends
};

/// Bending energy of Discrete Shells [Grinspun et al. 2003], E = sum over inner edges 1/2 k (theta - rest)^2 with the
/// angle theta in (-pi, pi] between the normals of their faces, positive where the surface is convex seen from outside.
/// Its derivatives are closed forms [cf. Tamstorf & Grinspun 2013]. A deviation from rest is taken the shorter way
/// round. Faces without height give finite numbers.
class HingeBending
{
public:
  /// `hinges` as in MeshTopology; one stiffness [N m] and rest angle [rad] each.
  HingeBending(const Eigen::Matrix4Xi& hinges, const Eigen::VectorXd& stiffness, const Eigen::VectorXd& rest_angles);

  int count() const { return static_cast<int>(hinges_.cols()); }
  const Eigen::Matrix4Xi& hinges() const { return hinges_; }
  double stiffness(int hinge) const { return stiffness_[hinge]; }
  void setStiffness(int hinge, double stiffness) { stiffness_[hinge] = response_stiffness_[hinge] = stiffness; }
  void setRestAngle(int hinge, double angle) { rest_angle_[hinge] = response_rest_[hinge] = angle; }

  /// Elastic response; with ratio > 0 a viscous one as well, of moment ratio k (theta - viscous_angle): the one of
  /// stiffness (1 + ratio) k about the weighted mean of both angles.
  void setResponse(double ratio, const double* viscous_angles);

  /// One per hinge, then padding: room for paddedCount().
  void angles(const double* x, double* angles) const { hingeKernels().angles(arrays(), x, angles); }
  int paddedCount() const { return static_cast<int>(stiffness_.size()); }
  double energy(const double* x) const { return count() ? hingeKernels().energy(arrays(), x) : 0.0; }
  double addGradient(const double* x, double* gradient) const
  {
    return count() ? hingeKernels().gradient(arrays(), x, gradient) : 0.0;
  }
  /// `slots` from slotsIn().
  double addHessian(HessianKind kind, const double* x, const std::vector<int>& slots, double* gradient,
                    double* values) const;
  std::vector<int> slotsIn(const BlockMatrix& matrix) const;

private:
  HingeArrays arrays() const;

  Eigen::Matrix4Xi hinges_;
  AlignedVector<int> points_[4];
  AlignedVector<double> stiffness_, rest_angle_, response_stiffness_, response_rest_;
};

}   // namespace slender
