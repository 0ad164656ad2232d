// Implicit steps of a cloth on its own: solves the equations of their stages.
#include <algorithm>
#include <cmath>
#include <limits>

#include "cloth_stepper_impl.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

StepFailure failureOf(LinearOutcome outcome)
{
  return outcome == LinearOutcome::not_converged ? StepFailure::linear_unconverged : StepFailure::singular_matrix;
}

}   // namespace

/// From work_ to next_, alone.
StepFailure ClothStepper::Impl::implicitStep(double from, double to, StepReport& report)
{
  planStep(options.integrator, 1.0, to - from, 0.0, own_plan_);
  beginStep(own_plan_, from, to);
  for (std::size_t s = 0; s < own_plan_.stages.size(); ++s)
  {
    beginStage(s);
    const StepFailure failure = options.one_newton_step ? linearized(report) : minimize(report);
    if (failure != StepFailure::none)
      return failure;
    if (s + 1 < own_plan_.stages.size())
      endStage(s);
  }
  return finishStep(report);
}

StepFailure ClothStepper::Impl::finishStep(StepReport& report)
{
  constexpr double kUnbalanced = 0.1;   // of the largest force: not a solution
  if (averages)                         // to rounding
    averages->meetAverages(averages_, x);
  const ClothEvaluation end = system->evaluate(x);
  if (!std::isfinite(end.energy()))
    return StepFailure::state_not_finite;
  // before averages take from the gradient what they balance
  const double internal = largestInternal();
  double pin_work = 0.0, average_work = 0.0;
  for (const int p : work_.pins)
    pin_work += system->internalGradient(p).dot(point(x, p) - point(x_start_, p));
  if (averages)
  {
    average_work = workOnFree(system->gradient());
    averages->balanceAverages(average_forces);
    average_work -= workOnFree(system->gradient());
  }
  const ClothBalance balance = takeEnd(internal, end.max_strain, report);
  const bool elastic_alone = order(options.integrator) == 2 && model->stiffness_damping > 0;
  if (options.one_newton_step)
    return createsEnergy(elastic_alone ? system->elasticEnergy(x) : end.membrane + end.bending, average_work, pin_work)
               ? StepFailure::energy_grew
               : StepFailure::none;
  return balance.unbalanced > std::max(kUnbalanced * balance.force, resolvedForce()) ? StepFailure::newton_diverged
                                                                                     : StepFailure::none;
}

/// Of forces that change from the start of a step to x_ [J].
double ClothStepper::Impl::workOnFree(const PointVector& forces) const
{
  double work = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
    if (!system->held()[i])
      work += point(forces, i).dot(point(x, i) - point(x_start_, i));
  return work;
}

double ClothStepper::Impl::largest(const PointVector& d) const
{
  double square = 0.0;
  for (int i = 0; i < model->vertices(); ++i)
    square = std::max(square, point(d, i).squaredNorm());
  return std::sqrt(square);
}

/// One Newton step, what is held moving as prescribed: from the start of the stage, where the cloth is balanced, or for
/// methods of second order from the motion carried on, which is near enough to the end that the semidefinite matrix
/// costs no order.
StepFailure ClothStepper::Impl::linearized(StepReport& report)
{
  const bool ahead = order(options.integrator) == 2;
  for (int i = 0; i < model->vertices(); ++i)
  {
    const Eigen::Vector3d end = system->held()[i] ? Eigen::Vector3d(point(system->start(), i) + point(pin_motion_, i))
                                                  : Eigen::Vector3d(point(guess_, i));
    point(trial_, i) = ahead ? end : Eigen::Vector3d(point(system->start(), i));
    point(d_, i) = end - point(trial_, i);
  }
  const ClothEvaluation here = system->evaluateHessian(trial_, HessianKind::semidefinite);
  if (!ahead)
  {
    energy_start_ = here.membrane + here.bending;
    elastic_start_ = (1.0 + system->viscosity()) * energy_start_;   // strains are those that viscosity counts from
  }
  const LinearOutcome outcome = !averages ? linear->solve(d_, nullptr, report.linear_iterations, report.factorizations)
                                : averages->bounded()
                                    ? averages->solveBounded(d_, averages_, at_bound_, report.linear_iterations)
                                    : averages->solveTo(averages_, d_, report.linear_iterations);
  if (outcome != LinearOutcome::solved)
    return failureOf(outcome);
  ++report.iterations;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = trial_[i] + d_[i];
  return StepFailure::none;
}

/// Of a linearised step from work_ to next_: whether its end has more energy than the start and the work of loads, pins
/// and averages can give. A step of implicit Euler that is solved loses some, but for what buckling releases. A
/// linearised one that turns or swings stretched cloth too far for its tangent leaves forces unbalanced, whose work is
/// the energy that appears.
bool ClothStepper::Impl::createsEnergy(double energy_end, double average_work, double pin_work) const
{
  // of what there was: sound steps lose energy, those that blow up create many times that
  constexpr double kCreated = 0.1;
  const double strains = 1e-12 * (model->membrane.c11 + model->membrane.c22) *
                         static_cast<double>(model->rest.triangles.cols()) * shortest_edge_ * shortest_edge_;
  const double loads = system->loadWork(x_start_, x);
  double gain = energy_end - energy_start_ - average_work;
  double given = strains + elastic_start_ + std::abs(average_work);   // strains of a millionth: of a cloth at rest
  for (int i = 0; i < model->vertices(); ++i)
  {
    if (!system->held()[i])
    {
      const double before = 0.5 * model->mass[i] * work_.v.col(i).squaredNorm();
      gain += 0.5 * model->mass[i] * next_.v.col(i).squaredNorm() - before;
      given += before;
    }
  }
  gain -= loads + pin_work;
  given += std::abs(loads) + std::abs(pin_work);
  return gain > kCreated * given;
}

/// Newton's method on the energy of the step, with a watchdog as in minimize() of rods: nearly inextensible cloth gains
/// a little membrane energy in every full step that turns it, and a strict line search would creep. Where full steps do
/// not get below the best energy for a while, it returns there and becomes strict.
StepFailure ClothStepper::Impl::minimize(StepReport& report)
{
  constexpr double kArmijo = 1e-4;
  constexpr double kMostShift = 10.0;   // of the weight of inertia
  constexpr int kPatience = 5;
  placeGuess();
  if (averages)
    averages->meetAverages(averages_, x);
  bool near = false, strict = false;
  double best = std::numeric_limits<double>::infinity(), shift = 0.0;
  int misses = 0;
  for (int iteration = 0; iteration < options.newton.max_iterations; ++iteration)
  {
    // far away the matrix that is never indefinite; near by the exact one, shifted where wrinkles are about to grow
    HessianKind kind = near ? HessianKind::exact : HessianKind::semidefinite;
    ClothEvaluation here = system->evaluateHessian(x, kind);
    if (!std::isfinite(here.energy()))
      return StepFailure::state_not_finite;
    if (stepsInterrupted())
      return StepFailure::interrupted;
    if (budget_->spent())
      return StepFailure::work_exceeded;
    if (!strict && here.energy() > best + 1e-13 * here.magnitude())
    {
      strict = ++misses > kPatience;
      if (strict)
      {
        std::copy(best_.begin(), best_.end(), x.begin());
        kind = HessianKind::semidefinite;
        here = system->evaluateHessian(x, kind);
      }
    }
    else if (!strict)
    {
      best = here.energy();
      misses = 0;
      std::copy(x.begin(), x.end(), best_.begin());
    }
    LinearOutcome outcome = LinearOutcome::not_definite;
    for (double added = 0.0;;)
    {
      if (kind == HessianKind::exact && shift > added)
      {
        system->shiftMatrix(shift - added);
        added = shift;
      }
      std::fill(d_.begin(), d_.end(), 0.0);
      outcome = linear->solve(d_, &x, report.linear_iterations, report.factorizations);
      if (outcome == LinearOutcome::solved ||
          kind == HessianKind::semidefinite)   // near buckling conjugate gradients may not end either
        break;
      shift = std::max(0.2, 4.0 * shift);
      if (shift > kMostShift)
      {
        shift = 0.0;
        kind = HessianKind::semidefinite;
        system->evaluateHessian(x, kind);
      }
    }
    if (outcome != LinearOutcome::solved)
      return failureOf(outcome);
    ++report.iterations;
    const double increment = largest(d_) / shortest_edge_;
    if (!std::isfinite(increment))
      return StepFailure::state_not_finite;
    const double slope = pointKernels().dot(model->vertices(), system->gradient().data(), d_.data());
    const double noise = 1e-13 * here.magnitude();
    double alpha = 1.0;
    for (;; alpha *= 0.5)
    {
      for (std::size_t i = 0; i < x.size(); ++i)
        trial_[i] = x[i] + alpha * d_[i];
      if (!strict || increment <= options.newton.tolerance ||
          system->energy(trial_).energy() <= here.energy() + kArmijo * alpha * slope + noise)
        break;
      if (alpha < 1e-8)
        return StepFailure::newton_diverged;
    }
    std::swap(x, trial_);
    if (alpha == 1.0 && increment <= options.newton.tolerance)
      return StepFailure::none;
    near = increment < 0.1;
    shift = shift > 0.1 ? 0.25 * shift : 0.0;
  }
  return StepFailure::newton_diverged;
}

}   // namespace slender
