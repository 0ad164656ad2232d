#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// The merged reports of a stretch of steps, and more sums over it: for diagnostics (since the last report) and for the
/// closing summary (since the start).
struct RunStatistics : StepReport
{
  std::uint64_t steps = 0;
  double simulated = 0.0;    ///< [s]
  double busy = 0.0;         ///< wall time spent stepping and publishing [s]
  double worst_step = 0.0;   ///< wall time of the longest step [s]
  /// of the last state when it had been published: how far its stamp was behind the clock that it shall keep [s]
  double stamp_lag = 0.0;
  double worst_stamp_lag = 0.0;                ///< the largest [s]
  double skipped = 0.0;                        ///< of the clock, because steps took too long [s]
  std::vector<double> max_force, max_torque;   ///< per grasp [N], [N m]
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
