#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/dynamics/step_report.h"

namespace slender {

/// One equilibrium of a scene.
struct StaticsRow
{
  double factor = 1.0;   ///< of the load
  /// of all rods and bodies together: residual, energy, lowest eigenvalue, stable, escapes
  StepReport report;
  double displacement = 0.0;             ///< largest of a node since the state that statics began with [m]
  std::vector<Eigen::Matrix3Xd> nodes;   ///< per rod: 3 x n [m]
  /// Per rod: mode of its lowest eigenvalue as RodStepper::lowestMode(), 4 x n; without columns for rods with contact
  /// or bodies.
  std::vector<Eigen::Matrix4Xd> modes;
};

/// The factor at which the equilibrium that begins at factor 0 ceases to be stable.
struct CriticalLoad
{
  double factor = 0.0;   ///< largest at which the equilibrium is still stable
  double beyond = 0.0;   ///< smallest at which it is unstable, or there is none near it
  /// no equilibrium is near beyond it (a limit load); otherwise paths branch there
  bool fold = false;
  StaticsRow at;   ///< the equilibrium at `factor`, and its lowest mode, along which it buckles
};

/// What Simulation::runStatics() found.
struct StaticsRun
{
  /// ok unless an equilibrium or the critical load was not found; then the message says why
  StepReport end;
  std::vector<StaticsRow> rows;   ///< those that were found, in order
  std::optional<CriticalLoad> critical;
};

/// Removes these tables of an earlier run, see clearEarlierRun().
void clearStatics(const std::string& folder);
/// Writes the tables statics.csv and statics_modes.csv into a folder that is there, in place of those of an earlier
/// run. The critical load is the last row, step -1. Throws std::runtime_error when writing fails.
void writeStatics(const std::string& folder, const StaticsRun& run, const std::vector<std::string>& rods);

}   // namespace slender
