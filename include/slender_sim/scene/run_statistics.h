#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// Sums over a stretch of steps, for diagnostics (since the last report) and for the closing summary (since the start).
struct RunStatistics
{
  std::uint64_t steps = 0, iterations = 0, substeps = 0, cut_steps = 0;
  double simulated = 0.0;    ///< [s]
  double busy = 0.0;         ///< wall time spent stepping and publishing [s]
  double worst_step = 0.0;   ///< wall time of the longest step [s]
  /// of the last state when it had been published: how far its stamp was behind the clock that it shall keep [s]
  double stamp_lag = 0.0;
  double worst_stamp_lag = 0.0;                            ///< the largest [s]
  double skipped = 0.0;                                    ///< of the clock, because steps took too long [s]
  double residual = 0.0;                                   ///< worst [-]
  double max_strain = 0.0;                                 ///< worst [-]
  int projection_iterations = 0;                           ///< of fast projection, the most in a step
  std::uint64_t repulsions = 0, impulses = 0, zones = 0;   ///< of cloths with contact
  std::uint64_t mended_folds = 0;                          ///< of threads
  int forces_at_bound = 0;                                 ///< most in a step
  double tracking_error = 0.0;                             ///< worst of tracked cloths and rods [-]
  double constraint_error = 0.0;                           ///< worst that it left [-]
  std::vector<double> max_force, max_torque;               ///< per grasp [N], [N m]
  std::chrono::steady_clock::time_point since = std::chrono::steady_clock::now();

  void add(const StepReport& report, const Simulation& simulation, double simulated_seconds, double busy_seconds);
  /// Simulated over computing time: how much faster than real time this machine could go; 0 before the first step.
  double realTimeFactor() const { return busy > 0.0 ? simulated / busy : 0.0; }
  double wallSeconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count(); }
};

/// Returns lines about grasps for the closing summary. At most ten grasps have a line, those with the largest force
/// first; one more line sums up the others. `names` are the names of all grasps of the scene.
std::vector<std::string> graspLines(const RunStatistics& statistics, const std::vector<std::string>& names);

/// Returns a text about the largest unbalanced force of a run, for summaries: "3e-09 of the largest force". With
/// `one_newton_step` the text adds that forces are not balanced by design, because a value near one is then no failure.
std::string residualText(const SceneConfig& scene, double residual);

}   // namespace slender
