#pragma once

#include <map>
#include <string>

#include "slender_sim/scene/sweep_plan.h"

/// The runs of a sweep and their files: DIR/points/K.csv is there, whole, when run K is done. Engines only start runs.
namespace slender::sweep {

/// Throws BadInput when the plan names a measure or a column to plot that does not exist, or a measure that its scene
/// cannot give.
void checkPlan(const SweepPlan& plan);

/// Makes DIR. Throws BadInput when it holds runs of another plan or scene.
void prepare(const SweepPlan& plan, const std::string& out);

/// File of a run's line of results; it exists when the run is done.
std::string pointFile(const std::string& out, long point);

/// Runs a point that is not done yet; a failed run is a result with its reason.
void runPoint(const SweepPlan& plan, const std::string& out, long point);

/// Writes a file whole or not at all. Throws std::runtime_error.
void writeWhole(const std::string& path, const std::string& text);

/// DIR/results.csv and the plan's plot. `crashed`: points without a result, and why. Returns the number of runs that
/// failed.
long collect(const SweepPlan& plan, const std::string& out, const std::map<long, std::string>& crashed);

}   // namespace slender::sweep
