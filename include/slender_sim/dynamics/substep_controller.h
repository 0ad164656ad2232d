#pragma once

#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/dynamics/time_config.h"

namespace slender {

/// A part of a step. Times are [s] from the start of the step.
struct Substep
{
  double from = 0.0, to = 0.0;
  double length = 0.0;      ///< to - from without its rounding error [s]
  bool may_halve = false;   ///< if the attempt fails, the next one is half as long
};

/// How a step is divided into substeps.
struct SubstepRule
{
  double longest = 0.0;           ///< no substep is longer [s], > 0
  double first = 0.0;             ///< length of the first substep [s]; 0: the longest
  double error_tolerance = 0.0;   ///< on StepReport::error_estimate of a substep [m]; 0: no error control
  double min_step = 0.0;          ///< no substep is halved below this length [s]
  int order = 1;                  ///< of the integrator; for error control
  int max_cuts = 0;               ///< how often a substep is halved in succession, see NewtonConfig
};

/// Length of equal substeps of a step, none longer than `longest` [s].
double evenSubstep(double duration, double longest);

/// The equations that a SubstepController advances: those of one object, or of objects that touch.
class SubstepEquations
{
public:
  virtual ~SubstepEquations() = default;

  /// Solves one substep from the present state, which stays as it is until accept(). The report gets counts, maxima and
  /// error_estimate.
  virtual StepFailure attempt(const Substep& substep, StepReport& report) = 0;

  /// Takes the end of the last attempt as the present state.
  virtual void accept(const Substep& substep) = 0;

  /// Whether a shorter substep may succeed where the last attempt failed.
  virtual bool shorterMayHelp(StepFailure) const { return true; }

  /// Called when the shortest substep has failed. Returns true if the present state was changed so that longer substeps
  /// may succeed.
  virtual bool mend(StepReport&) { return false; }

  /// Completes the report of a step that is refused: failure, message and place. `substep` is the last attempt.
  virtual void refuse(const Substep& substep, StepFailure failure, StepReport& report) = 0;
};

/// Divides a step into substeps: halves those that fail, lengthens them again after success, and follows the estimated
/// error if the rule asks for it. Every stepper uses this class, so that max_cuts, min_step and error_tolerance mean
/// the same for all of them.
class SubstepController
{
public:
  explicit SubstepController(const SubstepRule& rule) : rule_(rule) {}

  /// Advances `equations` by `duration` [s] > 0 and adds to the report. The step is complete if report.ok is true.
  void run(SubstepEquations& equations, double duration, StepReport& report);

  /// After run() with error control: the length with which the next step should begin [s]. Without error control: 0.
  double nextLength() const { return next_length_; }

private:
  bool mayHalve(double length, int cuts) const;
  double lengthFactor(double ratio) const;

  SubstepRule rule_;
  double next_length_ = 0.0;
};

}   // namespace slender
