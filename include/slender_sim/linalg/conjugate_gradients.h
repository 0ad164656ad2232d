#pragma once

#include <cmath>

#include "slender_sim/linalg/interruption.h"
#include "slender_sim/linalg/point_kernel.h"
#include "slender_sim/linalg/point_matrix.h"

namespace slender {

struct LinearResult
{
  int iterations = 0;
  /// over the right-hand side's (or the reference), in the preconditioner's norm sqrt(r . P r)
  double residual = 0.0;
  double scale = 0.0;     ///< that norm: of the right-hand side, or the reference
  bool definite = true;   ///< no direction of negative curvature was met
};

/// Vectors of points, four doubles each, of which the fourth does not count.
struct PointSpace
{
  using Vector = PointVector;
  static double dot(const Vector& x, const Vector& y)
  {
    return pointKernels().dot(static_cast<int>(x.size() / 4), x.data(), y.data());
  }
};

/// Preconditioned conjugate gradients, with memory of its own. `Space`: the vectors and their inner product.
template <class Space>
class ConjugateGradientsIn
{
public:
  using Vector = typename Space::Vector;

  /// `numbers`: of a vector.
  void resize(std::size_t numbers)
  {
    for (Vector* v : {&r_, &z_, &p_, &ap_})
      v->assign(numbers, 0.0);
  }

  /// Solves A x = b from x = 0. apply(p, ap) writes A p, precondition(r, z) writes P r and may take out of r what no
  /// direction of the search sees; both leave fixed points zero. Stops when the residual is the
  /// tolerance times that of b, or times `reference` if that is positive; after max_iterations; or at negative
  /// curvature with the x so far.
  template <class Apply, class Precondition>
  LinearResult solve(const Vector& b, Vector& x, double tolerance, int max_iterations, Apply apply,
                     Precondition precondition, double reference = 0.0)
  {
    LinearResult result;
    std::fill(x.begin(), x.end(), 0.0);
    std::copy(b.begin(), b.end(), r_.begin());
    precondition(r_, z_);
    double rz = Space::dot(r_, z_);
    const double scale = reference > 0 ? reference * reference : rz;
    if (!(rz > 0))
    {
      result.definite = rz == 0.0;
      return result;
    }
    result.scale = std::sqrt(scale);
    result.residual = std::sqrt(rz / scale);
    std::copy(z_.begin(), z_.end(), p_.begin());
    while (result.residual > tolerance && result.iterations < max_iterations && !stepsInterrupted())
    {
      apply(p_, ap_);
      const double curvature = Space::dot(p_, ap_);
      if (!(curvature > 0))
      {
        result.definite = false;
        break;
      }
      const double alpha = rz / curvature;
      for (std::size_t i = 0; i < x.size(); ++i)
      {
        x[i] += alpha * p_[i];
        r_[i] -= alpha * ap_[i];
      }
      ++result.iterations;
      precondition(r_, z_);
      const double next = Space::dot(r_, z_);
      result.residual = std::sqrt(std::abs(next) / scale);
      const double beta = next / rz;
      rz = next;
      for (std::size_t i = 0; i < p_.size(); ++i)
        p_[i] = z_[i] + beta * p_[i];
    }
    return result;
  }

private:
  Vector r_, z_, p_, ap_;
};

using ConjugateGradients = ConjugateGradientsIn<PointSpace>;

}   // namespace slender
