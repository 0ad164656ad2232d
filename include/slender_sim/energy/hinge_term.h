#pragma once

#include "slender_sim/energy/hinge_kernel.h"
#include "slender_sim/energy/point_term.h"

namespace slender {

/// Bending energy of Discrete Shells [Grinspun et al. 2003], E = sum over inner edges 1/2 k (theta - rest)^2 with the
/// angle theta in (-pi, pi] between the normals of their faces, positive where the surface is convex seen from outside.
/// Its derivatives are closed forms [cf. Tamstorf & Grinspun 2013]. A deviation from rest is taken the shorter way
/// round. Faces without height give finite numbers.
///
/// Viscous moments count from angles, the shorter way round. Plastic hinges have their own rest angles and stiffening.
class HingeTerm final : public PointTerm
{
public:
  /// `hinges` as in MeshTopology; one stiffness [N m] and rest angle [rad] each. Throws std::invalid_argument for other
  /// numbers of them, for a stiffness that is negative or not finite, and for a rest angle that is not finite.
  HingeTerm(const Eigen::Matrix4Xi& hinges, const Eigen::VectorXd& stiffness, const Eigen::VectorXd& rest_angles);

  int count() const { return static_cast<int>(hinges_.cols()); }
  int paddedCount() const { return static_cast<int>(stiffness_.size()); }
  /// One per hinge [rad], then padding: room for paddedCount().
  void angles(const double* x, double* angles) const { hingeKernels().angles(arrays(), x, angles); }

  TermAccount account() const override { return TermAccount::bending; }
  Eigen::MatrixXi elements() const override { return hinges_; }
  void setPattern(const BlockMatrix& matrix) override;
  TermSums value(const double* x) override { return {count() ? hingeKernels().energy(arrays(), x) : 0.0}; }
  TermSums addGradient(const double* x, double* gradient) override
  {
    return {count() ? hingeKernels().gradient(arrays(), x, gradient) : 0.0};
  }
  TermSums addHessian(HessianKind kind, const double* x, double* gradient, double* values,
                      const double* from = nullptr) override;
  void takeStrains(const StrainReference& at) override;
  void setResponse(double ratio) override;
  void setPlasticState(const PlasticState& state) override;

private:
  HingeArrays arrays() const;
  void addAngles(const PointVector& x, double part);

  Eigen::Matrix4Xi hinges_;
  AlignedVector<int> points_[4];
  AlignedVector<double> stiffness_, rest_angle_, response_stiffness_, response_rest_;
  std::vector<int> slots_;
  AlignedVector<double> angles_, other_angles_, start_angles_;   ///< empty without viscous response
  AlignedVector<double> unstiffened_;                            ///< stiffness [N m]; empty without plastic hinges
};

}   // namespace slender
