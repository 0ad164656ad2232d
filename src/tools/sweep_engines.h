#pragma once

#include <map>
#include <string>

#include "slender_sim/scene/sweep_plan.h"

/// What starts the runs of a sweep: processes here, GNU parallel, or Slurm.
namespace slender::sweep {

struct Engine
{
  std::string kind = "local";   ///< local, parallel, slurm
  std::string options;          ///< words handed to the engine: "--sshlogin a,b", "--partition=long --time=10"
  long jobs = 1;                ///< runs at a time
};

/// Starts this program once per point that is not done, as `sweep PLAN --out DIR --point K`, waits, and shows progress.
/// Returns the points that left no result, to be tried again by the next call, and why. Throws BadInput for an engine
/// that is not installed or refuses its options.
std::map<long, std::string> runMissing(const SweepPlan& plan, const std::string& plan_file, const std::string& out,
                                       const Engine& engine);

}   // namespace slender::sweep
