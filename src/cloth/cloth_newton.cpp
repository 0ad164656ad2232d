// Solves the equation of an implicit stage.
#include <algorithm>
#include <cmath>
#include <limits>

#include "cloth_stepper_impl.h"

namespace slender {

double ClothStepper::Impl::largest(const PointVector& d) const
{
  double square = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
    square = std::max(square, point(d, i).squaredNorm());
  return std::sqrt(square);
}

/// One Newton step, what is held moving as prescribed: from the start of the stage, where the cloth is balanced, or for methods of second order
/// from the motion carried on, which is near enough to the end that the semidefinite matrix costs no order.
StepFailure ClothStepper::Impl::linearized(StepReport& report)
{
  const bool ahead = order(options.integrator) == 2;
  for (int i = 0; i < model->vertices(); ++i)
  {
    const Eigen::Vector3d end = system.held()[i] ? Eigen::Vector3d(point(system.start(), i) + point(pin_motion_, i)) : Eigen::Vector3d(point(guess_, i));
    point(trial_, i) = ahead ? end : Eigen::Vector3d(point(system.start(), i));
    point(d_, i) = end - point(trial_, i);
  }
  system.evaluateHessian(trial_, HessianKind::semidefinite);
  const bool solved = model->average_bounds.size() > 0
                        ? system.solveBounded(d_, averages_, at_bound_, report.linear_iterations)
                        : system.solve(d_, nullptr, report.linear_iterations, report.factorizations, 0.0, model->averages ? &averages_ : nullptr);
  if (!solved)
    return StepFailure::singular_matrix;
  ++report.iterations;
  for (std::size_t i = 0; i < x_.size(); ++i)
    x_[i] = trial_[i] + d_[i];
  return StepFailure::none;
}

/// Newton's method on the energy of the step, with a watchdog as in minimize() of rods: nearly inextensible cloth gains a little membrane
/// energy in every full step that turns it, and a strict line search would creep. Where full steps do not get below the best energy
/// for a while, it returns there and becomes strict.
StepFailure ClothStepper::Impl::minimize(StepReport& report)
{
  constexpr double kArmijo = 1e-4;
  constexpr double kMostShift = 10.0;   // of the weight of inertia
  constexpr int kPatience = 5;
  for (int i = 0; i < model->vertices(); ++i)
    point(x_, i) = system.held()[i] ? Eigen::Vector3d(point(system.start(), i) + point(pin_motion_, i)) : Eigen::Vector3d(point(guess_, i));
  if (model->averages)
    system.meetAverages(averages_, x_);
  bool near = false, strict = false;
  double best = std::numeric_limits<double>::infinity(), shift = 0.0;
  int misses = 0;
  for (int iteration = 0; iteration < options.newton.max_iterations; ++iteration)
  {
    // far away the matrix that is never indefinite; near by the exact one, shifted where wrinkles are about to grow
    HessianKind kind = near ? HessianKind::exact : HessianKind::semidefinite;
    ClothEvaluation here = system.evaluateHessian(x_, kind);
    if (!std::isfinite(here.energy()))
      return StepFailure::state_not_finite;
    if (!strict && here.energy() > best + 1e-13 * here.magnitude())
    {
      strict = ++misses > kPatience;
      if (strict)
      {
        std::copy(best_.begin(), best_.end(), x_.begin());
        kind = HessianKind::semidefinite;
        here = system.evaluateHessian(x_, kind);
      }
    }
    else if (!strict)
    {
      best = here.energy();
      misses = 0;
      std::copy(x_.begin(), x_.end(), best_.begin());
    }
    bool solved = false;
    for (double added = 0.0; !solved;)
    {
      if (kind == HessianKind::exact && shift > added)
      {
        system.shiftMatrix(shift - added);
        added = shift;
      }
      std::fill(d_.begin(), d_.end(), 0.0);
      solved = system.solve(d_, &x_, report.linear_iterations, report.factorizations);
      if (solved || kind == HessianKind::semidefinite)
        break;
      shift = std::max(0.2, 4.0 * shift);
      if (shift > kMostShift)
      {
        shift = 0.0;
        kind = HessianKind::semidefinite;
        system.evaluateHessian(x_, kind);
      }
    }
    if (!solved)
      return StepFailure::singular_matrix;
    ++report.iterations;
    const double increment = largest(d_) / shortest_edge_;
    if (!std::isfinite(increment))
      return StepFailure::state_not_finite;
    const double slope = pointKernels().dot(model->vertices(), system.gradient().data(), d_.data());
    const double noise = 1e-13 * here.magnitude();
    double alpha = 1.0;
    for (;; alpha *= 0.5)
    {
      for (std::size_t i = 0; i < x_.size(); ++i)
        trial_[i] = x_[i] + alpha * d_[i];
      if (!strict || increment <= options.newton.tolerance || system.energy(trial_).energy() <= here.energy() + kArmijo * alpha * slope + noise)
        break;
      if (alpha < 1e-8)
        return StepFailure::newton_diverged;
    }
    std::swap(x_, trial_);
    if (alpha == 1.0 && increment <= options.newton.tolerance)
      return StepFailure::none;
    near = increment < 0.1;
    shift = shift > 0.1 ? 0.25 * shift : 0.0;
  }
  return StepFailure::newton_diverged;
}

}  // namespace slender
