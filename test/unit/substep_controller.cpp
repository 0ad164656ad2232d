#include "slender_sim/dynamics/substep_controller.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "slender_sim/linalg/interruption.h"

namespace slender {
namespace {

/// Equations that succeed for substeps below a length, and note what they are asked for.
class Scripted : public SubstepEquations
{
public:
  double solvable = 1e9;         ///< longest substep that succeeds [s]
  double hard_until = 1e9;       ///< after this instant every substep succeeds [s]
  double error_per_second = 0;   ///< error estimate of a substep over its length [m/s]
  bool helpless = false;         ///< no shorter substep would help
  int mends = 0;                 ///< how often the state can be mended
  std::vector<Substep> tried, accepted;
  std::vector<StepFailure> refusals;
  double refused_length = 0;

  StepFailure attempt(const Substep& substep, StepReport& report) override
  {
    tried.push_back(substep);
    report.iterations = 3;
    report.error_estimate = error_per_second * substep.length;
    return substep.from < hard_until && substep.length > solvable ? StepFailure::newton_diverged : StepFailure::none;
  }
  void accept(const Substep& substep) override { accepted.push_back(substep); }
  bool shorterMayHelp(StepFailure) const override { return !helpless; }
  bool mend(StepReport& report) override
  {
    if (report.mended_folds >= mends)
      return false;
    solvable = 1e9;
    return ++report.mended_folds > 0;
  }
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override
  {
    report.ok = false;
    report.failure = failure;
    refused_length = substep.length;
    refusals.push_back(failure);
  }
};

SubstepRule rule(double longest, int max_cuts = 10)
{
  SubstepRule r;
  r.longest = longest;
  r.max_cuts = max_cuts;
  return r;
}

StepReport runScripted(Scripted& equations, const SubstepRule& r, double duration)
{
  StepReport report;
  SubstepController(r).run(equations, duration, report);
  return report;
}

/// Accepted substeps follow each other without gaps and end exactly with the step.
void expectSeamless(const Scripted& equations, double duration)
{
  double t = 0.0;
  for (const Substep& s : equations.accepted)
  {
    EXPECT_EQ(s.from, t);
    EXPECT_NEAR(s.to - s.from, s.length, 1e-15);
    t = s.to;
  }
  EXPECT_EQ(t, duration);
}

TEST(SubstepController, aStepThatSucceedsIsOneSubstep)
{
  Scripted equations;
  const StepReport report = runScripted(equations, rule(0.01), 0.01);
  EXPECT_TRUE(report.ok);
  EXPECT_EQ(report.substeps, 1);
  EXPECT_EQ(report.cut_steps, 0);
  EXPECT_EQ(report.iterations, 3);
  expectSeamless(equations, 0.01);
}

TEST(SubstepController, halvesWhatFailsAndLengthensAgain)
{
  Scripted equations;
  equations.solvable = 0.3;
  equations.hard_until = 0.5;
  const StepReport report = runScripted(equations, rule(1.0), 1.0);
  EXPECT_TRUE(report.ok);
  expectSeamless(equations, 1.0);
  // 1 and 1/2 fail; 1/4 succeeds; 1/2 is tried and fails; 1/4 ends at 1/2, after which 1/2 succeeds.
  ASSERT_EQ(equations.accepted.size(), 3u);
  EXPECT_EQ(equations.accepted[2].length, 0.5);
  EXPECT_EQ(report.cut_steps, 3);
  EXPECT_EQ(report.substeps, 3);
  EXPECT_EQ(report.iterations, 3 * 6) << "failed attempts count, too";
}

TEST(SubstepController, neverHalvesBelowTheDepthOfMaxCuts)
{
  for (const int cuts : {0, 1, 4})
  {
    Scripted equations;
    equations.solvable = 0.0;
    const StepReport report = runScripted(equations, rule(1.0, cuts), 1.0);
    EXPECT_FALSE(report.ok);
    EXPECT_EQ(report.failure, StepFailure::newton_diverged);
    EXPECT_EQ(report.cut_steps, cuts);
    EXPECT_EQ(equations.refused_length, std::ldexp(1.0, -cuts));
    EXPECT_EQ(equations.refusals.size(), 1u);
    EXPECT_TRUE(equations.accepted.empty());
  }
}

TEST(SubstepController, neverHalvesBelowTheShortestLength)
{
  Scripted equations;
  equations.solvable = 0.0;
  SubstepRule r = rule(1.0);
  r.min_step = 0.2;
  runScripted(equations, r, 1.0);
  EXPECT_EQ(equations.refused_length, 0.25);
}

TEST(SubstepController, endsAtOnceWhereNoShorterSubstepHelps)
{
  Scripted equations;
  equations.solvable = 0.0;
  equations.helpless = true;
  const StepReport report = runScripted(equations, rule(1.0), 1.0);
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(equations.tried.size(), 1u);
  EXPECT_EQ(report.cut_steps, 0);
}

TEST(SubstepController, mendsWhenTheShortestSubstepHasFailed)
{
  Scripted equations;
  equations.solvable = 0.0;
  equations.mends = 1;
  const StepReport report = runScripted(equations, rule(1.0, 2), 1.0);
  EXPECT_TRUE(report.ok);
  EXPECT_EQ(report.mended_folds, 1);
  EXPECT_EQ(report.cut_steps, 2);
  ASSERT_EQ(equations.accepted.size(), 1u) << "after mending the longest substep is tried";
}

TEST(SubstepController, dividesIntoEqualSubstepsAtMostAsLongAsAskedFor)
{
  Scripted equations;
  const StepReport report = runScripted(equations, rule(0.25), 1.0);
  EXPECT_EQ(report.substeps, 4);
  expectSeamless(equations, 1.0);
  for (const Substep& s : equations.accepted)
    EXPECT_EQ(s.length, 0.25);
}

TEST(SubstepController, errorControlShortensAndPassesItsLengthOn)
{
  Scripted equations;
  equations.error_per_second = 4e-3;
  SubstepRule r = rule(1.0);
  r.error_tolerance = 1e-3;   // met by substeps of 0.25 s and less
  r.order = 1;
  SubstepController controller(r);
  StepReport report;
  controller.run(equations, 1.0, report);
  EXPECT_TRUE(report.ok);
  EXPECT_EQ(report.cut_steps, 0) << "inaccuracy is no failure";
  expectSeamless(equations, 1.0);
  for (const Substep& s : equations.accepted)
    EXPECT_LE(s.length, 0.25);
  EXPECT_GT(controller.nextLength(), 0.1);
  EXPECT_LE(controller.nextLength(), 0.5);
  r.first = controller.nextLength();
  Scripted next;
  next.error_per_second = 4e-3;
  StepReport second;
  SubstepController(r).run(next, 1.0, second);
  EXPECT_EQ(next.tried.front().length, r.first);
}

TEST(SubstepController, anInterruptedStepIsRefused)
{
  Scripted equations;
  interruptSteps();
  const StepReport report = runScripted(equations, rule(1.0), 1.0);
  allowSteps();
  EXPECT_FALSE(report.ok);
  EXPECT_EQ(report.failure, StepFailure::interrupted);
  EXPECT_TRUE(equations.accepted.empty());
}

}   // namespace
}   // namespace slender
