#include "thread_loop.h"

#include <algorithm>
#include <cmath>

#include "thread_contact.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

/// The part on which the largest unbalanced force acts.
const ThreadPart* farthestFromBalance(const ThreadPart* parts, const ThreadPart* end)
{
  Largest force;
  for (const ThreadPart* p = parts; p != end; ++p)
    if (const Largest own = p->thread->unbalancedForce(); own.any())
      force.add(static_cast<int>(p - parts), own.value());
  return parts + std::max(force.index(), 0);
}

/// Of the parts from `parts` to `end`; on failure `failed` is the part it is about.
StepFailure substep(const ThreadPart* parts, const ThreadPart* end, double from, double to, double duration, ThreadContact* contact,
                    StepReport& report, const ThreadPart*& failed)
{
  const double h = to - from;
  for (failed = parts; failed != end; ++failed)
    if (const StepFailure failure = failed->thread->prepare(from, to, duration); failure != StepFailure::none)
      return failure;
  failed = parts;
  const StepFailure failure =
    contact ? contact->solve(from / duration, to / duration, h, report) : parts->thread->solveAlone(h, report);
  if (failure != StepFailure::none)
  {
    failed = farthestFromBalance(parts, end);
    return failure;
  }
  for (const ThreadPart* p = parts; p != end; ++p)
    p->thread->takeOver(h);
  for (failed = parts; failed != end; ++failed)
  {
    if (!failed->thread->remesh(contact))
      return StepFailure::overstretched;
    if (failed->thread->overgrownEdge() >= 0)
      return StepFailure::squeezed;
  }
  return StepFailure::none;
}

/// Takes out the sharpest fold of a part, if there is one.
bool mend(const ThreadPart* parts, const ThreadPart* end, const RemeshGuard* guard)
{
  for (const ThreadPart* p = parts; p != end; ++p)
    if (const int fold = p->thread->foldedNode(); fold >= 0 && mendFold(p->thread->work, fold, guard))
      return true;
  return false;
}

}  // namespace

StepReport advanceThreads(const ThreadPart* parts, int count, double duration, ThreadContact* contact)
{
  constexpr int kMostFolds = 20;   // in one step
  StepReport report;
  const ThreadPart* const end = parts + count;
  const ThreadPart* failed = parts;
  double longest = duration;
  for (const ThreadPart* p = parts; p != end; ++p)
  {
    if (!p->thread->begin(*p->state, *p->inputs, duration, report))
      return report;
    longest = std::min(longest, p->thread->longestSubstep(duration));
  }
  const double first = duration / std::ceil(duration / longest * (1 - 1e-9)), shortest = std::ldexp(first, -parts->thread->newton.max_cuts);
  double t = 0.0, h = first;
  while (t < duration)
  {
    const bool last = t + h > duration * (1 - 1e-9);
    const double length = last ? duration - t : h;
    StepReport sub;
    const StepFailure failure = substep(parts, end, t, last ? duration : t + length, duration, contact, sub, failed);
    report.merge(sub);
    if (failure != StepFailure::none)
    {
      const ThreadStepper::Impl& thread = *failed->thread;
      if (stepsInterrupted())
        return thread.refuse(report, StepFailure::interrupted, kStepInterrupted);
      // a shorter step now would only hide that all of them are too long, or draw the thread out or thicken it bit by bit
      if (thread.explicit_step || failure == StepFailure::overstretched || thread.overgrownEdge() >= 0)
        return thread.refuseUnsolved(report, failure, length);
      if (0.5 * length < shortest * (1 - 1e-9))
      {
        if (report.mended_folds >= kMostFolds || !mend(parts, end, contact))
          return thread.refuseUnsolved(report, failure, length);
        ++report.mended_folds;
        h = first;
        continue;
      }
      ++report.cut_steps;
      h = 0.5 * length;
      continue;
    }
    ++report.substeps;
    t = last ? duration : t + length;
    h = std::min(2.0 * length, first);
  }
  for (const ThreadPart* p = parts; p != end; ++p)
    std::swap(*p->state, p->thread->work);
  return report;
}

}  // namespace slender
