#pragma once

#include "slender_sim/energy/hinge.h"
#include "slender_sim/energy/point_term.h"

namespace slender {

/// The term of HingeBending. Viscous moments count from angles, the shorter way round. Plastic hinges have their own
/// rest angles and stiffening.
class HingeTerm final : public PointTerm
{
public:
  /// As HingeBending. Throws std::invalid_argument for a stiffness [N m] that is negative or not finite, and for a rest
  /// angle [rad] that is not finite, too.
  HingeTerm(const Eigen::Matrix4Xi& hinges, const Eigen::VectorXd& stiffness, const Eigen::VectorXd& rest_angles);

  TermAccount account() const override { return TermAccount::bending; }
  Eigen::MatrixXi elements() const override { return energy_.hinges(); }
  void setPattern(const BlockMatrix& matrix) override { slots_ = energy_.slotsIn(matrix); }
  TermSums value(const double* x) override { return {energy_.energy(x)}; }
  TermSums addGradient(const double* x, double* gradient) override { return {energy_.addGradient(x, gradient)}; }
  TermSums addHessian(HessianKind kind, const double* x, double* gradient, double* values, const double*) override
  {
    return {energy_.addHessian(kind, x, slots_, gradient, values)};
  }
  void takeStrains(const StrainReference& at) override;
  void setResponse(double ratio) override { energy_.setResponse(ratio, angles_.data()); }
  void setPlasticState(const PlasticState& state) override;

private:
  void addAngles(const PointVector& x, double part);

  HingeBending energy_;
  std::vector<int> slots_;
  AlignedVector<double> angles_, other_angles_, start_angles_;   ///< empty without viscous response
  Eigen::VectorXd unstiffened_;                                  ///< stiffness [N m]; empty without plastic hinges
};

}   // namespace slender
