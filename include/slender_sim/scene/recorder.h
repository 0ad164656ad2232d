#pragma once

#include <memory>
#include <string>

#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Writes the states of a simulation somewhere, one instant at a time. All throw std::runtime_error when writing fails.
class Recorder
{
public:
  virtual ~Recorder() = default;

  /// The state as it is now. `report` is that of the step that led here (default for the initial state).
  virtual void record(const Simulation& simulation, const StepReport& report) = 0;

  /// Everything is on the disk afterwards; nothing may be recorded any more. Destruction without it does its best,
  /// silently.
  virtual void finish() = 0;
};

/// The tables of scene/csv_tables.h, one instant per record().
std::unique_ptr<Recorder> makeCsvRecorder(const std::string& folder);

/// First line of an OBJ file of one instant [s].
std::string objComment(const std::string& scene, double time);

/// One Wavefront OBJ file per instant, frame_000000.obj ...: a polyline per rod and thread, and the triangles of each
/// cloth [m].
std::unique_ptr<Recorder> makeObjRecorder(const std::string& folder);

}   // namespace slender
