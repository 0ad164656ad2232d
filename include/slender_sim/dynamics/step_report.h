#pragma once

#include <limits>
#include <string>
#include <utility>

#include "slender_sim/dynamics/failure_place.h"

namespace slender {

/// Why a step was refused. The state is then what it was before the step.
enum class StepFailure
{
  none,
  newton_diverged,      ///< Newton did not reach its tolerance even after cutting the step
  folded_back,          ///< two consecutive tangents came (nearly) opposite: parallel transport is undefined there
  singular_matrix,      ///< the Hessian could not be made positive definite
  linear_unconverged,   ///< cloth: conjugate gradients, or the averages' bounded forces, did not reach their tolerance
  input_not_finite,     ///< an input (pose, velocity, wind) was NaN or infinite
  state_not_finite,     ///< explicit step blew up
  squeezed,             ///< contact: prescribed motions leave no room for what lies between them
  energy_grew,          ///< energy out of nothing: implicit_midpoint, generalized_alpha; cloth with one Newton step
  overstretched,        ///< projection: the edges cannot all keep their lengths
  /// isotropic formulation: the twist changed by about half a turn in one step, and could not be counted
  turned_too_far,
  /// cloth: more work than a step is given; the guide, or what holds it, moves too far at once or presses it too hard
  work_exceeded,
  passed_through,   ///< contact: something may have got around a rim or an end; a substep is only cut for it
  interrupted,      ///< the process was asked to end (interruptSteps()); nothing is wrong with the step
};

/// What one call of step() did. Sums and maxima run over all its substeps. RunStatistics sums many reports.
struct StepReport
{
  bool ok = true;
  StepFailure failure = StepFailure::none;
  std::string message;          ///< empty when ok; otherwise the reason and what to change
  FailurePlace place;           ///< of a failure: the node that it is about, where that is known
  long substeps = 0;            ///< steps actually taken (1 unless the step was cut or adapted)
  long cut_steps = 0;           ///< how often a step was halved because it could not be done
  long iterations = 0;          ///< Newton iterations
  long linear_iterations = 0;   ///< of conjugate gradients (cloth; islands of several parts)
  long factorizations = 0;      ///< banded factorisations (more than iterations when a Hessian was shifted)
  double residual = 0.0;        ///< largest unbalanced nodal force over the largest force on any node [-]
  double max_strain = 0.0;      ///< largest |stretch strain| over all edges [-]
  long repulsions = 0;          ///< cloth: pairs of pieces nearer than the thickness, or about to be
  long impulses = 0;            ///< cloth: collisions found and stopped
  long zones = 0;               ///< cloth: pieces that could only be kept apart by moving them rigidly
  /// threads: sharp folds that were taken out because the step could not be done with them
  long mended_folds = 0;
  bool stable = true;   ///< statics: no small motion lowers the energy (false: stationary only, a saddle)
  /// statics: elastic energy and that of gravity and forces [J]; torques about tangents have none
  double energy = 0.0;
  /// Statics: the lowest eigenvalue of the energy's second derivative against the masses [1/s^2]; negative: unstable.
  /// It is the square of the lowest angular frequency. 0: a motion that costs nothing. Infinite: not computed.
  double lowest_eigenvalue = std::numeric_limits<double>::infinity();
  int escapes = 0;                 ///< statics: unstable equilibria that were left on the way
  int projection_iterations = 0;   ///< of fast projection (explicit steps of inextensible rods), the most in a step
  double constraint_error = 0.0;   ///< largest | |e|^2/L^2 - 1 | that it left [-]
  /// greatest distance of an average of a tracked cloth or rod from that of its guide, over the guide's size [-]; of
  /// those that are met
  double tracking_error = 0.0;
  /// averages of tracked cloths whose forces are at their bounds, and which are therefore not met
  int forces_at_bound = 0;
  double error_estimate = 0.0;   ///< estimated local error [m]; 0: nothing asks for it
  long work = 0;                 ///< cloth: what the step did, in counts of a WorkBudget

  /// Takes the other report into this one (sums, maxima, first failure wins).
  void merge(const StepReport& other);
  /// Makes this the report of a step that failed, and returns it.
  StepReport& refuse(StepFailure why, std::string text)
  {
    ok = false;
    failure = why;
    message = std::move(text);
    return *this;
  }
};

const char* toString(StepFailure failure);
/// "2.5 ms", for messages: three digits however short the time [s] is.
std::string milliseconds(double seconds);

}   // namespace slender
