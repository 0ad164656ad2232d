#include "slender_sim/dynamics/substep_controller.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

constexpr double kLengthRounding = 1e-9;   // relative; lengths that differ by less are equal

/// Takes over the work of a substep whose result is thrown away.
void countWork(const StepReport& substep, StepReport& report)
{
  report.iterations += substep.iterations;
  report.linear_iterations += substep.linear_iterations;
  report.factorizations += substep.factorizations;
}

}   // namespace

double evenSubstep(double duration, double longest)
{
  return longest < duration ? duration / std::ceil(duration / longest * (1.0 - kLengthRounding)) : duration;
}

void SubstepController::run(SubstepEquations& equations, double duration, StepReport& report)
{
  const bool adaptive = rule_.error_tolerance > 0;
  const double longest = std::min(rule_.longest, duration);
  double t = 0.0, h = rule_.first > 0 ? std::clamp(rule_.first, std::min(rule_.min_step, longest), longest) : longest;
  int cuts = 0;   // since the last success
  while (t < duration)
  {
    // The last substep ends exactly with the step. It may be slightly longer than h, because a sliver after it would be
    // worse.
    const bool last = t + h > duration * (1 - kLengthRounding);
    const double length = last ? duration - t : h;
    const Substep substep{t, last ? duration : t + length, length, mayHalve(length, cuts)};
    StepReport result;
    const StepFailure failure = equations.attempt(substep, result);
    const bool failed = failure != StepFailure::none;
    // Linear solvers and collision handling end early when they are interrupted, so that their result is not a
    // solution.
    if (stepsInterrupted())
    {
      countWork(result, report);
      return equations.refuse(substep, StepFailure::interrupted, report);
    }
    const double ratio = adaptive ? result.error_estimate / rule_.error_tolerance : 0.0;
    const bool inaccurate = !failed && ratio > 1 && 0.5 * length >= rule_.min_step;
    if (inaccurate)
    {
      countWork(result, report);
      h = std::max(length * std::clamp(lengthFactor(ratio), 0.2, 0.8), rule_.min_step);
      continue;
    }
    if (failed)
    {
      countWork(result, report);
      if (!equations.shorterMayHelp(failure))
        return equations.refuse(substep, failure, report);
      if (mayHalve(length, cuts))
      {
        ++cuts;
        ++report.cut_steps;
        h = 0.5 * length;
        continue;
      }
      if (!equations.mend(report))
        return equations.refuse(substep, failure, report);
      cuts = 0;
      h = longest;
      continue;
    }
    equations.accept(substep);
    t = substep.to;
    cuts = 0;
    ++result.substeps;
    report.merge(result);
    // The last substep may be short only because the step ends there.
    const double grown = length * (adaptive ? std::clamp(lengthFactor(ratio), 0.5, 2.0) : 2.0);
    h = std::min(std::max(last && adaptive ? h : 0.0, grown), longest);
  }
  next_length_ = adaptive ? h : 0.0;
}

/// `cuts`: how often the substep was halved since the last success.
bool SubstepController::mayHalve(double length, int cuts) const
{
  const double deepest =
      rule_.error_tolerance > 0 ? 0.0 : std::ldexp(rule_.longest, -rule_.max_cuts) * (1 - kLengthRounding);
  return cuts < rule_.max_cuts && 0.5 * length >= std::max(deepest, rule_.min_step);
}

/// Next length over the present one, for a local error that is `ratio` times the tolerance. The margin of 0.9 makes a
/// refusal unlikely.
double SubstepController::lengthFactor(double ratio) const
{
  return 0.9 * std::pow(std::max(ratio, 1e-12), -1.0 / (rule_.order + 1));
}

}   // namespace slender
