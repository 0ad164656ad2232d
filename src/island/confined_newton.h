#pragma once

#include <algorithm>

#include "contact/contact_potential.h"
#include "slender_sim/dynamics/newton.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

/// Outcome of moving towards a target configuration while contact may block the way.
enum class Approach
{
  arrived,
  partly,    ///< moved until contact blocked the rest of the way
  squeezed   ///< could not move at all
};

/// The tolerance of increments where a solution with contact ends [-]. `gap`: of contact, over the shortest edge.
/// Friction that is about to slip and contacts that run along a curve converge slowly at the end, far below what gaps
/// resolve.
inline double fineTolerance(const NewtonConfig& newton, double gap) { return std::max(newton.tolerance, 1e-3 * gap); }

/// The largest motion at contacts with which a solution ends, over the smallest gap.
constexpr double kFineGap = 1e-3;

/// Minimises the energy of a system with contact whose held parts and driven solids move from the fraction `from` of a
/// time step to `to`. They advance until contact blocks them; a solution lets the blocking parts give way; and so on.
/// Then it solves at `to`, with friction forces from the previous solution, until these no longer change. `gap` is the
/// gap of contact over the shortest edge. The solution is left as the trial.
///
/// System offers what minimize() needs, and:
/// - approach(from, to, reached): goes from the base towards the present trial, as far as nothing touches. That
///   becomes the base, where all that is prescribed stands at the fraction `reached`;
/// - advance(from, to): puts what is held or driven, in the trial, where it is at `to`, or less far, and moves along
///   what is pushed. Returns the fraction that it aims at;
/// - resolve(tolerance, gap_tolerance): how incrementSize() measures, over the shortest edge and over the smallest gap;
/// - lagFriction() and stiffen(converged): those of ContactPotential, after which what has changed is solved again;
/// - contact(): the ContactPotential.
template <class System>
NewtonResult minimizeConfined(System& system, double from, double to, const NewtonConfig& newton, double gap)
{
  constexpr int kMaxApproaches = 200, kMaxIdle = 10, kMaxSolutions = 24, kMaxFailures = 8;
  constexpr int kAdvances = 3;             // between two solutions
  constexpr double kLeastAdvance = 1e-3;   // of the way; less is none
  NewtonResult total;
  const auto solve = [&](const NewtonConfig& config, double gap_tolerance) {
    system.resolve(config.tolerance, gap_tolerance);
    system.contact()->beginSolution();
    const NewtonResult r = minimize(system, config);
    const int iterations = total.iterations + r.iterations, factorizations = total.factorizations + r.factorizations;
    total = r;
    total.iterations = iterations;
    total.factorizations = factorizations;
    if (!r.ok())   // back to the last good configuration
    {
      system.moveAlong(0.0);
      system.evaluate(false);
    }
    return r.ok();
  };
  NewtonConfig fine = newton;
  fine.balances = false;   // What has converged has settled by then, and more solutions follow where contact changes.
  NewtonConfig loose = fine;
  fine.tolerance = fineTolerance(newton, gap);
  fine.max_iterations = 2 * newton.max_iterations;   // contacts that come and go cost more than a substep cut in two
  loose.tolerance = std::max(newton.tolerance, 0.02 * gap);
  loose.max_iterations = 12;
  const double way = to - from;
  double aim = to;
  for (int k = 0, idle = 0;; ++k)
  {
    double reached = aim;
    const bool stuck = k == kMaxApproaches || idle == kMaxIdle || stepsInterrupted();
    const Approach approach = stuck ? Approach::squeezed : system.approach(from, aim, reached);
    if (approach == Approach::squeezed)
    {
      total.failure = StepFailure::squeezed;
      return total;
    }
    if (approach == Approach::arrived && aim == to)
      break;
    // An advance is an iteration of Newton's method, in which what is in the way moves along. A solution lets it give
    // way where that does not suffice.
    idle = reached - from < kLeastAdvance * way ? idle + 1 : 0;
    if (idle > 0 || way == 0.0 || k % kAdvances == kAdvances - 1)
    {
      system.stiffen(solve(loose, 0.1));
      if (total.failure == StepFailure::work_exceeded)
        return total;
      system.accept();
    }
    from = reached;
    aim = system.advance(from, to);
    ++total.iterations;
    ++total.factorizations;
  }
  for (int k = 0, failures = 0;; ++k)
  {
    const bool good = solve(fine, kFineGap);
    if (stepsInterrupted())
    {
      total.failure = StepFailure::interrupted;
      return total;
    }
    const bool changed = system.stiffen(good);
    if (!good && !(changed && ++failures <= kMaxFailures))
      return total;
    if (good && !changed && (system.lagFriction() <= ContactPotential::kLagTolerance || k >= kMaxSolutions))
      return total;
    system.accept();
  }
}

}   // namespace slender
