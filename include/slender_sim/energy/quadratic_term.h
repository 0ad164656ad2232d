#pragma once

#include "slender_sim/energy/point_term.h"

namespace slender {

/// The term E = 1/2 x^T K x for each coordinate of the points, with a constant positive semidefinite matrix K:
/// isometric bending (see isometricBending()) and that of plates (see plateBending()).
class QuadraticTerm final : public PointTerm
{
public:
  /// Throws std::invalid_argument for a matrix without rows or with a number that is not finite.
  explicit QuadraticTerm(PointMatrix matrix);

  TermAccount account() const override { return TermAccount::bending; }
  const PointMatrix* constantMatrix() const override { return &matrix_; }
  TermSums value(const double* x) override;
  TermSums addGradient(const double* x, double* gradient) override;
  TermSums addHessian(HessianKind, const double* x, double* gradient, double*, const double*) override
  {
    return addGradient(x, gradient);
  }
  void takeStrains(const StrainReference& at) override;
  void setResponse(double ratio) override { ratio_ = ratio; }

private:
  PointMatrix matrix_;
  double ratio_ = 0;
  double reference_form_ = 0;   ///< of the matrix, at the reference
  PointVector reference_;       ///< empty without viscous response
  PointVector product_;
};

}   // namespace slender
