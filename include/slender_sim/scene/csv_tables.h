#pragma once

#include <memory>
#include <string>

#include "slender_sim/scene/config.h"
#include "slender_sim/scene/snapshot.h"

namespace slender {

/// Writes instants to tables in the given folder, which is made if it is missing. Each table has one header line
/// with the names of columns and their units. The tables of bodies, threads, cloths and tracking are written if the
/// scene has any.
///
/// - nodes.csv has a row per instant and node: t, object, index, x y z, vx vy vz, d1 of the edge after the node (of
///   the last edge at the end of an open rod), twist.
/// - grasps.csv has a row per instant and grasp: t, object, grasp, active, pose of the held section, force and torque
///   of the rod or cloth on the gripper about the section's origin (zero while released), in world axes. A cell is
///   empty if its value was not recorded.
/// - bodies.csv has a row per instant and body, then per obstacle: t, object, pose of its frame (simulated bodies:
///   with the origin at the centre of mass), velocity of the origin and angular velocity, in world axes.
/// - threads.csv has a row per instant and node of a thread, from the oldest on: t, object, thread, id (which is
///   never used again), x y z, vx vy vz, radius of the edge after the node (of the last edge at the newest end),
///   deposited (1: the node lies on the floor).
/// - cloths.csv has a row per instant and vertex of a cloth: t, object, index, x y z, vx vy vz.
/// - tracking.csv has a row per instant and test function of a tracked cloth or rod: t, object, function, its average
///   over the guide x y z, and the force with which the guide acts.
/// - rod_fields.csv, cloth_fields.csv, solid_fields.csv and energies.csv have what `record.fields` of the scene
///   asks for (see FieldTable). The first two have a row per instant and node or vertex, and the other two a row per
///   instant and object.
///   docs/quantities.md defines every column. A cell is empty if its value is not determined.
///
/// With a choice of nodes, nodes.csv, cloths.csv, rod_fields.csv and cloth_fields.csv have rows of these alone, under
/// the indices that they have in the whole object.
///
/// Numbers are the shortest that read back to the same double. All functions throw std::runtime_error if writing
/// fails.
class CsvTables
{
public:
  explicit CsvTables(const std::string& folder);
  ~CsvTables();
  void write(const SceneSnapshot& instant, const NodeChoice& nodes = {});
  /// Everything is in the files afterwards; nothing may be written any more.
  void finish();

private:
  struct Files;
  std::unique_ptr<Files> files_;
};

}   // namespace slender
