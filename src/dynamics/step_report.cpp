#include "slender_sim/dynamics/step_report.h"

#include <algorithm>

#include "slender_sim/dynamics/failure_place.h"

namespace slender {

void StepReport::merge(const StepReport& other)
{
  if (ok && !other.ok)
  {
    ok = false;
    failure = other.failure;
    message = other.message;
    place = other.place;
  }
  substeps += other.substeps;
  cut_steps += other.cut_steps;
  iterations += other.iterations;
  linear_iterations += other.linear_iterations;
  factorizations += other.factorizations;
  repulsions += other.repulsions;
  impulses += other.impulses;
  zones += other.zones;
  work += other.work;
  mended_folds += other.mended_folds;
  residual = std::max(residual, other.residual);
  max_strain = std::max(max_strain, other.max_strain);
  stable = stable && other.stable;
  energy += other.energy;
  lowest_eigenvalue = std::min(lowest_eigenvalue, other.lowest_eigenvalue);
  escapes += other.escapes;
  projection_iterations = std::max(projection_iterations, other.projection_iterations);
  constraint_error = std::max(constraint_error, other.constraint_error);
  tracking_error = std::max(tracking_error, other.tracking_error);
  forces_at_bound = std::max(forces_at_bound, other.forces_at_bound);
  error_estimate = std::max(error_estimate, other.error_estimate);
}

const char* toString(StepFailure failure)
{
  switch (failure)
  {
    case StepFailure::none: return "none";
    case StepFailure::newton_diverged: return "newton_diverged";
    case StepFailure::folded_back: return "folded_back";
    case StepFailure::singular_matrix: return "singular_matrix";
    case StepFailure::input_not_finite: return "input_not_finite";
    case StepFailure::state_not_finite: return "state_not_finite";
    case StepFailure::squeezed: return "squeezed";
    case StepFailure::linear_unconverged: return "linear_unconverged";
    case StepFailure::energy_grew: return "energy_grew";
    case StepFailure::overstretched: return "overstretched";
    case StepFailure::work_exceeded: return "work_exceeded";
    case StepFailure::passed_through: return "passed_through";
    case StepFailure::interrupted: return "interrupted";
    case StepFailure::turned_too_far: return "turned_too_far";
  }
  return "unknown";
}

std::string milliseconds(double seconds) { return shortNumber(1e3 * seconds, 3) + " ms"; }

}   // namespace slender
