#include "slender_sim/energy/quadratic_term.h"

#include <cmath>
#include <stdexcept>

#include "slender_sim/linalg/point_kernel.h"

namespace slender {

QuadraticTerm::QuadraticTerm(PointMatrix matrix) : matrix_(std::move(matrix))
{
  if (matrix_.size() == 0)
    throw std::invalid_argument("bending: the constant matrix has no rows");
  for (const double value : matrix_.values())
    if (!std::isfinite(value))
      throw std::invalid_argument("bending: the constant matrix [N/m] must be finite, got " + std::to_string(value));
  product_.assign(4 * static_cast<std::size_t>(matrix_.size()), 0.0);
}

/// Viscous response: (1 + ratio) K about the mean of zero and the reference, weighted 1 : ratio.
TermSums QuadraticTerm::value(const double* x)
{
  const double form = matrix_.multiply(x, product_.data());
  double energy = 0.5 * (1.0 + ratio_) * form;
  if (ratio_ > 0)
    energy += ratio_ * (0.5 * ratio_ / (1.0 + ratio_) * reference_form_ -
                        pointKernels().dot(matrix_.size(), reference_.data(), product_.data()));
  return {energy};
}

TermSums QuadraticTerm::addGradient(const double* x, double* gradient)
{
  double energy = 0.5 * (1.0 + ratio_) * matrix_.addProduct(1.0 + ratio_, x, gradient);
  if (ratio_ > 0)
  {
    matrix_.multiply(reference_.data(), product_.data());
    energy += ratio_ * (0.5 * ratio_ / (1.0 + ratio_) * reference_form_ -
                        pointKernels().dot(matrix_.size(), x, product_.data()));
    for (std::size_t i = 0; i < product_.size(); ++i)
      gradient[i] -= ratio_ * product_[i];
  }
  return {energy};
}

void QuadraticTerm::takeStrains(const StrainReference& at)
{
  const PointVector& x = *at.x;
  reference_ = x;
  for (std::size_t i = 0; i < x.size(); ++i)
    reference_[i] += (at.move ? (*at.move)[i] : 0.0) + (at.share != 0.0 ? at.share * ((*at.other)[i] - x[i]) : 0.0);
  reference_form_ = matrix_.multiply(reference_.data(), product_.data());
}

}   // namespace slender
