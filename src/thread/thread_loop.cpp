#include "thread_loop.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

/// The substeps of a thread on its own.
class ThreadSubsteps : public SubstepEquations
{
public:
  ThreadSubsteps(ThreadStepper::Impl& thread, double duration) : thread_(thread), duration_(duration) {}

  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep&) override {}   // the attempt changes the work state only when it succeeds
  /// A shorter substep would hide that all of them are too long, or it would draw the thread out or thicken it bit by
  /// bit.
  bool shorterMayHelp(StepFailure failure) const override
  {
    return !thread_.explicit_step && failure != StepFailure::overstretched && thread_.overgrownEdge() < 0;
  }
  bool mend(StepReport& report) override;
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;

private:
  ThreadStepper::Impl& thread_;
  double duration_;
};

StepFailure ThreadSubsteps::attempt(const Substep& substep, StepReport& report)
{
  const double h = substep.to - substep.from;
  StepFailure failure = thread_.prepare(substep.from, substep.to, duration_);
  if (failure == StepFailure::none)
    failure = thread_.solveAlone(h, report);
  if (failure != StepFailure::none)
    return failure;
  thread_.takeOver(h);
  if (!thread_.remesh(nullptr))
    return StepFailure::overstretched;
  return thread_.overgrownEdge() >= 0 ? StepFailure::squeezed : StepFailure::none;
}

/// Takes out the sharpest fold, if there is one.
bool ThreadSubsteps::mend(StepReport& report)
{
  constexpr int kMostFolds = 20;   // in one step
  const int fold = thread_.foldedNode();
  if (report.mended_folds >= kMostFolds || fold < 0 || !mendFold(thread_.work, fold))
    return false;
  ++report.mended_folds;
  return true;
}

void ThreadSubsteps::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  if (failure == StepFailure::interrupted)
    thread_.refuse(report, failure, kStepInterrupted);
  else
    thread_.refuseUnsolved(report, failure, substep.length);
}

}   // namespace

StepReport advanceThread(ThreadStepper::Impl& thread, ThreadState& state, const ThreadInputs& inputs, double duration)
{
  StepReport report;
  if (!thread.begin(state, inputs, duration, report))
    return report;
  const double longest = thread.longestSubstep(duration);
  SubstepRule rule;
  rule.longest = duration / std::ceil(duration / longest * (1 - 1e-9));   // all but shortened substeps are equally long
  rule.max_cuts = thread.newton.max_cuts;
  ThreadSubsteps substeps(thread, duration);
  SubstepController(rule).run(substeps, duration, report);
  if (report.ok)
    std::swap(state, thread.work);
  return report;
}

}   // namespace slender
