#include "thread_loop.h"

#include <algorithm>
#include <cmath>

#include "thread_contact.h"
#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

/// Threads that a step advances together, and what the last substep of them came to.
class ThreadSubsteps : public SubstepEquations
{
public:
  ThreadSubsteps(const SteppedThread* parts, int count, double duration, ThreadContact* contact)
    : parts_(parts),
      end_(parts + count),
      duration_(duration),
      contact_(contact),
      failed_(parts)
  {
  }

  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep&) override {}   // the attempt changes the parts' work states only when it succeeds
  bool shorterMayHelp(StepFailure failure) const override;
  bool mend(StepReport& report) override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;

private:
  const SteppedThread* farthestFromBalance() const;

  const SteppedThread *parts_, *end_;
  double duration_;
  ThreadContact* contact_;
  const SteppedThread* failed_;   ///< part that the last failure is about
};

/// The part on which the largest unbalanced force acts.
const SteppedThread* ThreadSubsteps::farthestFromBalance() const
{
  Largest force;
  for (const SteppedThread* p = parts_; p != end_; ++p)
    if (const Largest own = p->thread->unbalancedForce(); own.any())
      force.add(static_cast<int>(p - parts_), own.value());
  return parts_ + std::max(force.index(), 0);
}

StepFailure ThreadSubsteps::attempt(const Substep& substep, StepReport& report)
{
  const double from = substep.from, to = substep.to, h = to - from;
  for (failed_ = parts_; failed_ != end_; ++failed_)
    if (const StepFailure failure = failed_->thread->prepare(from, to, duration_); failure != StepFailure::none)
      return failure;
  failed_ = parts_;
  const StepFailure failure =
      contact_ ? contact_->solve(from / duration_, to / duration_, h, report) : parts_->thread->solveAlone(h, report);
  if (failure != StepFailure::none)
  {
    failed_ = farthestFromBalance();
    return failure;
  }
  for (const SteppedThread* p = parts_; p != end_; ++p)
    p->thread->takeOver(h);
  for (failed_ = parts_; failed_ != end_; ++failed_)
  {
    if (!failed_->thread->remesh(contact_))
      return StepFailure::overstretched;
    if (failed_->thread->overgrownEdge() >= 0)
      return StepFailure::squeezed;
  }
  return StepFailure::none;
}

/// A shorter substep would hide that all of them are too long, or it would draw the thread out or thicken it bit by
/// bit.
bool ThreadSubsteps::shorterMayHelp(StepFailure failure) const
{
  return !failed_->thread->explicit_step && failure != StepFailure::overstretched &&
         failed_->thread->overgrownEdge() < 0;
}

/// Takes out the sharpest fold of a part, if there is one.
bool ThreadSubsteps::mend(StepReport& report)
{
  constexpr int kMostFolds = 20;   // in one step
  if (report.mended_folds >= kMostFolds)
    return false;
  for (const SteppedThread* p = parts_; p != end_; ++p)
    if (const int fold = p->thread->foldedNode(); fold >= 0 && mendFold(p->thread->work, fold, contact_))
    {
      ++report.mended_folds;
      return true;
    }
  return false;
}

void ThreadSubsteps::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  const ThreadStepper::Impl& thread = *(failed_ == end_ ? parts_ : failed_)->thread;
  if (failure == StepFailure::interrupted)
    thread.refuse(report, failure, kStepInterrupted);
  else
    thread.refuseUnsolved(report, failure, substep.length);
}

}   // namespace

StepReport advanceThreads(const SteppedThread* parts, int count, double duration, ThreadContact* contact)
{
  StepReport report;
  const SteppedThread* const end = parts + count;
  double longest = duration;
  for (const SteppedThread* p = parts; p != end; ++p)
  {
    if (!p->thread->begin(*p->state, *p->inputs, duration, report))
      return report;
    longest = std::min(longest, p->thread->longestSubstep(duration));
  }
  SubstepRule rule;
  rule.longest = duration / std::ceil(duration / longest * (1 - 1e-9));   // all but shortened substeps are equally long
  rule.max_cuts = parts->thread->newton.max_cuts;
  ThreadSubsteps substeps(parts, count, duration, contact);
  SubstepController(rule).run(substeps, duration, report);
  if (!report.ok)
    return report;
  for (const SteppedThread* p = parts; p != end; ++p)
    std::swap(*p->state, p->thread->work);
  return report;
}

}   // namespace slender
