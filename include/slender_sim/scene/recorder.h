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

  /// Everything is on the disk afterwards; nothing may be recorded any more. Destruction without it does its best, silently.
  virtual void finish() = 0;
};

/// Tables in the given folder (made if missing), one header line that names columns and units:
///   nodes.csv    one row per instant and node: t, object, index, x y z, vx vy vz, d1 of the edge after the node (the last edge
///                at the end of an open rod), twist
///   grasps.csv   one row per instant and grasp: t, object, grasp, active, pose of the held section, force and torque of the rod or cloth
///                on the gripper about the section's origin, in world axes
///   bodies.csv   one row per instant and body, then per obstacle, if there are any: t, object, pose of its frame (simulated bodies:
///                origin at the centre of mass), velocity of the origin and angular velocity, in world axes
///   threads.csv  one row per instant and node of a thread, from the oldest on, if there are any: t, object, thread, id (never used again),
///                x y z, vx vy vz, radius of the edge after the node (the last edge at the newest end), deposited (1: lies on the floor)
///   cloths.csv   one row per instant and vertex of a cloth, if there are any: t, object, index, x y z, vx vy vz
///   tracking.csv one row per instant and test function of a tracked cloth, if there are any: t, object, function, its average over the guide x y z,
///                and the force with which the guide acts
/// Numbers are the shortest that read back to the same double.
std::unique_ptr<Recorder> makeCsvRecorder(const std::string& folder);

/// One Wavefront OBJ file per instant, frame_000000.obj ...: a polyline per rod and thread, and the triangles of each cloth [m].
std::unique_ptr<Recorder> makeObjRecorder(const std::string& folder);

}  // namespace slender
