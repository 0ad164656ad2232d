// Pieces that still collide move rigidly.
#include <algorithm>

#include <Eigen/Geometry>

#include "slender_sim/geometry/rotation.h"
#include "surface_collider.h"

namespace slender {

/// Of a point in the zones: those of a solid are one.
int SurfaceCollider::node(int point) const
{
  return point < elements_.sheet_points
             ? point
             : static_cast<int>(from_.cols()) + elements_.point_object[point] - elements_.sheet_count;
}

/// Returns whether zones grew. Collisions within a zone are none: see ImpactZones.
bool SurfaceCollider::joinHits()
{
  bool grown = false;
  const auto join = [&](int a, int b) {
    grown = grown || !zones_.together(a, b);
    zones_.join(a, b);
  };
  for (const CollisionPair& pair : hits_)
    for (int i = 1; i < 4; ++i)
      join(node(pair.point[0]), node(pair.point[i]));
  for (const PlaneHit& hit : plane_hits_)
    join(hit.point, static_cast<int>(from_.cols()) + elements_.planes[hit.plane] - elements_.sheet_count);
  return grown;
}

/// Moves a zone with what is prescribed in it, if that moves as one.
bool SurfaceCollider::followPrescribed(const ImpactZones::Zone& zone)
{
  const int points = static_cast<int>(from_.cols());
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  const int last = zone.prescribed[zone.prescribed_count - 1];
  if (last >= points)
  {
    const Pose moved = step_->solids_end[last - points] * step_->solids[last - points].inverse();
    motion = Eigen::Translation3d(moved.position) * moved.orientation;
  }
  else
    motion.translation() = to_.col(last) - from_.col(last);
  const auto agrees = [&](const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
    return (motion * start - end).norm() <= 1e-9 * elements_.objects[0].shell;
  };
  const auto pointsAgree = [&] {
    return std::all_of(zone.prescribed, zone.prescribed + zone.prescribed_count,
                       [&](int i) { return i >= points || agrees(from_.col(i), to_.col(i)); });
  };
  if (last < points && !pointsAgree() && zone.prescribed_count > 2)   // a grasp that turns
  {
    Eigen::Matrix3Xd start(3, zone.prescribed_count), end(3, zone.prescribed_count);
    for (int k = 0; k < zone.prescribed_count; ++k)
    {
      start.col(k) = from_.col(zone.prescribed[k]);
      end.col(k) = to_.col(zone.prescribed[k]);
    }
    motion.matrix() = Eigen::umeyama(start, end, false);
  }
  bool one = pointsAgree();
  for (int k = 0; k < zone.prescribed_count; ++k)
    if (const int solid = zone.prescribed[k] - points; solid >= 0)
      for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)})
        one = one && agrees(step_->solids[solid] * p, step_->solids_end[solid] * p);
  if (!one)
    return fail("prescribed motions squeeze or tear a piece", zone.count > 0                ? zone.members[0]
                                                              : zone.prescribed[0] < points ? zone.prescribed[0]
                                                                                            : -1);
  if (motion.linear().trace() <= 1.0)   // 1 + 2 cos(angle)
    return fail("a solid or grasp turns by more than a quarter in a step");
  for (int k = 0; k < zone.count; ++k)
    to_.col(zone.members[k]) = motion * from_.col(zone.members[k]);
  return true;
}

bool SurfaceCollider::moveZones()
{
  for (const ImpactZones::Zone& zone : zones_.zones(inverse_mass_))
  {
    if (zone.prescribed_count > 0)
    {
      if (!followPrescribed(zone))
        return false;
      continue;
    }
    const RigidFit fit = rigidFit(zone.members, zone.count, inverse_mass_, from_, displacement_);
    if (fit.angular.norm() > 0.5 * M_PI)
      return fail("a piece would turn by more than a quarter in a step", zone.members[0]);
    const Eigen::Matrix3d turn = fromRotationVector(fit.angular).toRotationMatrix();
    for (int k = 0; k < zone.count; ++k)
      to_.col(zone.members[k]) = fit.center + fit.linear + turn * (from_.col(zone.members[k]) - fit.center);
  }
  return true;
}

}   // namespace slender
