#pragma once

#include <memory>
#include <string>

#include "slender_sim/scene/snapshot.h"

namespace slender {

/// Writes instants to tables in the given folder (made if missing), one header line that names columns and units:
///   nodes.csv    one row per instant and node: t, object, index, x y z, vx vy vz, d1 of the edge after the node (the
///   last edge
///                at the end of an open rod), twist
///   grasps.csv   one row per instant and grasp: t, object, grasp, active, pose of the held section, force and torque
///   of the rod or cloth
///                on the gripper about the section's origin (zero while released), in world axes; empty cells: not
///                recorded
///   bodies.csv   one row per instant and body, then per obstacle, if there are any: t, object, pose of its frame
///   (simulated bodies:
///                origin at the centre of mass), velocity of the origin and angular velocity, in world axes
///   threads.csv  one row per instant and node of a thread, from the oldest on, if there are any: t, object, thread, id
///   (never used again),
///                x y z, vx vy vz, radius of the edge after the node (the last edge at the newest end), deposited (1:
///                lies on the floor)
///   cloths.csv   one row per instant and vertex of a cloth, if there are any: t, object, index, x y z, vx vy vz
///   tracking.csv one row per instant and test function of a tracked cloth or rod, if there are any: t, object,
///   function, its average over the guide x y z,
///                and the force with which the guide acts
///   rod_fields.csv, cloth_fields.csv, energies.csv: what `record.fields` of the scene asks for (FieldTable), one row
///   per instant and node
///                or vertex (energies: and object); docs/quantities.md defines every column; empty cells: not
///                determined
/// Numbers are the shortest that read back to the same double. All throw std::runtime_error when writing fails.
class CsvTables
{
public:
  explicit CsvTables(const std::string& folder);
  ~CsvTables();
  void write(const SceneSnapshot& instant);
  /// Everything is in the files afterwards; nothing may be written any more.
  void finish();

private:
  struct Files;
  std::unique_ptr<Files> files_;
};

}   // namespace slender
