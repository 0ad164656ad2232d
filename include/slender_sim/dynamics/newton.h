#pragma once

#include <algorithm>
#include <cmath>

#include "slender_sim/dynamics/hessian_shift.h"
#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/dynamics/time_config.h"
#include "slender_sim/linalg/banded_ldlt.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

struct NewtonResult
{
  StepFailure failure = StepFailure::none;
  int iterations = 0, factorizations = 0;
  double residual = 0.0;   ///< unbalanced force over the force scale [-]
  double max_strain = 0.0;
  bool ok() const { return failure == StepFailure::none; }
};

/// 1 + t.t' below which a trial is refused: consecutive tangents within about 1.8 degrees of opposite. There the
/// discrete curvature 2 tan(phi/2) has grown to 126 and parallel transport is about to become undefined.
constexpr double kFoldedChi = 5e-4;

/// Returns whether a full step of this increment ends Newton's method. So it does if the increment after it would be
/// within the tolerance, by the rate at which increments shrink [Hairer and Wanner, Solving Ordinary Differential
/// Equations II, IV.8]. `before` is the increment before, or 0 if that was not a full step. A shifted Hessian shortens
/// the increment, so a saddle (a step's equation may well have one) must show by its residual.
template <class System>
bool isLastIncrement(System& system, const NewtonConfig& config, const HessianShift& shift, double increment,
                     double before)
{
  constexpr double kSlowest = 0.3;   // rate from which on two increments tell nothing of the next one
  constexpr double kSafety = 0.5;
  if (shift.none() && increment < kSlowest * before &&
      increment * increment <= kSafety * (before - increment) * config.tolerance &&
      system.sticksAfter(increment / before))
    return true;
  if (increment <= config.tolerance && shift.none())
    return true;
  if (increment >= 1e-2)
    return false;
  const double residual = system.residual();
  return residual <= system.noiseLevel() || (increment <= config.tolerance && residual < 1e-9 * system.forceScale()) ||
         // shifts of angles shorten it no more than tenfold
         (shift.position == 0.0 && increment <= 1e-3 * config.tolerance && system.anglesMayKeepShift());
}

/// Sets the residual of the result, and returns whether forces are balanced well enough where an increment was the last
/// one. This increment turns the edges of a stiff rod, and so stretches them by a force that may be large beside all
/// others. Where balance is not demanded, three more such increments try for it; `tried` tells how many have.
template <class System>
bool isBalanced(const System& system, const NewtonConfig& config, NewtonResult& result, int tried)
{
  constexpr double kBalanced = 0.05;   // residual that is not worth another iteration
  constexpr int kMostTries = 3;
  const double residual = system.residual(), scale = system.forceScale(), most = system.mostUnbalanced();
  result.residual = scale > 0.0 ? residual / scale : 0.0;   // Without forces nothing is out of balance.
  if (residual <= system.noiseLevel())
    return true;
  const bool tries =
      std::isinf(most) && config.balances && tried < kMostTries && result.iterations < config.max_iterations;
  return result.residual <= (tries ? kBalanced : most);
}

/// Minimises a system's energy by Newton's method from its trial configuration.
///
/// System offers evaluate(with_hessian, shift), solve(), moveAlong(alpha), accept(), saveBase(), restoreBase() and
/// the measures used below (see RodSystem and Equations). A Hessian with negative eigenvalues (known from the
/// inertia of its LDL^T) is shifted by a positive diagonal until it is definite, so that the direction descends. Steps
/// are accepted by a watchdog [Nocedal & Wright, Numerical Optimization, 15.6]: nearly inextensible bodies gain a
/// little stretching energy in every full step that turns them, and a strict line search would creep. Full steps may
/// raise the energy a few times; if it does not then fall below its best, the search returns there and becomes strict.
/// With `one_step` it takes one full step and leaves forces unbalanced.
template <class System>
NewtonResult minimize(System& system, const NewtonConfig& config)
{
  constexpr int kPatience = 5;
  constexpr double kArmijo = 1e-4, kProgress = 0.1, kMaxShift = 1e12;
  NewtonResult result;
  const auto fail = [&](StepFailure why) {
    result.failure = why;
    return result;
  };

  HessianShift shift;
  auto trial = system.evaluate(true, shift);
  ++result.factorizations;
  if (trial.min_chi <= kFoldedChi)   // first: a perfect fold has an infinite energy
    return fail(StepFailure::folded_back);
  if (!std::isfinite(trial.energy()) || !std::isfinite(trial.min_chi))
    return fail(StepFailure::state_not_finite);
  system.accept();
  double energy = trial.energy(), best = energy, before = 0.0;
  int misses = 0, unbalanced = 0;
  bool strict = false;

  for (;;)
  {
    const StepFailure why = stepsInterrupted() ? StepFailure::interrupted : system.givesUp();
    if (why != StepFailure::none)
      return fail(why);
    // round-off of the energy's sum; differences below it mean nothing
    const double noise = 1e-13 * (std::abs(trial.stretch) + std::abs(trial.bend_twist) + std::abs(trial.potential));
    while (!trial.inertia.positiveDefinite())
    {
      if (const StepFailure hopeless = system.givesUp(); hopeless != StepFailure::none)
        return fail(hopeless);
      shift.raise();
      if (shift.position > kMaxShift)
        return fail(StepFailure::singular_matrix);
      system.moveAlong(0.0);
      trial = system.evaluate(true, shift);
      ++result.factorizations;
    }
    system.solve();
    ++result.iterations;

    if (config.one_step)
    {
      system.moveAlong(1.0);
      trial = system.evaluate(false);
      result.max_strain = trial.max_strain;
      return std::isfinite(trial.energy()) ? result : fail(StepFailure::state_not_finite);
    }

    const double increment = system.incrementSize(), slope = system.slope();
    if (!std::isfinite(increment))
      return fail(StepFailure::state_not_finite);
    double alpha = system.stepLimit();
    if (alpha == 1.0 && isLastIncrement(system, config, shift, increment, before))
    {
      system.moveAlong(1.0);
      trial = system.evaluate(false);
      result.max_strain = trial.max_strain;
      if (std::isfinite(trial.energy()) && trial.min_chi > kFoldedChi &&
          isBalanced(system, config, result, unbalanced++))
        return result;
    }
    if (result.iterations >= config.max_iterations)
      return fail(StepFailure::newton_diverged);

    before = alpha == 1.0 && shift.none() ? increment : 0.0;
    shift.relax();
    for (;;)
    {
      system.moveAlong(alpha);
      trial = system.evaluate(true, shift);
      ++result.factorizations;
      const bool sound = std::isfinite(trial.energy()) && trial.min_chi > kFoldedChi;
      if (sound && (!strict || trial.energy() <= energy + kArmijo * alpha * slope + noise))
        break;
      alpha *= 0.5;
      if (alpha < 1e-8)
        return fail(trial.min_chi > kFoldedChi ? StepFailure::newton_diverged : StepFailure::folded_back);
    }
    if (trial.energy() <= best + noise && (trial.energy() < best + kProgress * slope || std::abs(slope) < noise))
    {
      best = std::min(best, trial.energy());
      misses = 0;
    }
    else if (!strict)   // higher, or no lower than before: full steps may go round in circles
    {
      if (misses == 0)
        system.saveBase();
      if (++misses > kPatience)
      {
        system.restoreBase();
        system.moveAlong(0.0);
        trial = system.evaluate(true, shift);
        ++result.factorizations;
        strict = true;
      }
    }
    system.accept();
    energy = trial.energy();
  }
}

}   // namespace slender
