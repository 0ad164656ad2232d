#include "slender_sim/node/run_statistics.h"

#include <algorithm>

namespace slender {

void RunStatistics::add(const StepReport& report, const Simulation& simulation, double simulated_seconds,
                        double busy_seconds)
{
  ++steps;
  iterations += static_cast<std::uint64_t>(report.iterations);
  substeps += static_cast<std::uint64_t>(report.substeps);
  cut_steps += static_cast<std::uint64_t>(report.cut_steps);
  simulated += simulated_seconds;
  busy += busy_seconds;
  worst_step = std::max(worst_step, busy_seconds);
  residual = std::max(residual, report.residual);
  max_strain = std::max(max_strain, report.max_strain);
  repulsions += static_cast<std::uint64_t>(report.repulsions);
  impulses += static_cast<std::uint64_t>(report.impulses);
  zones += static_cast<std::uint64_t>(report.zones);
  mended_folds += static_cast<std::uint64_t>(report.mended_folds);
  projection_iterations = std::max(projection_iterations, report.projection_iterations);
  tracking_error = std::max(tracking_error, report.tracking_error);
  forces_at_bound = std::max(forces_at_bound, report.forces_at_bound);
  constraint_error = std::max(constraint_error, report.constraint_error);
  max_force.resize(simulation.grasps().size());
  max_torque.resize(simulation.grasps().size());
  for (std::size_t g = 0; g < max_force.size(); ++g)
  {
    if (!simulation.grasps().isActive(static_cast<int>(g)))
      continue;
    const Wrench& wrench = simulation.grasps().wrench(static_cast<int>(g));
    max_force[g] = std::max(max_force[g], wrench.force.norm());
    max_torque[g] = std::max(max_torque[g], wrench.torque.norm());
  }
}

}   // namespace slender
