#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/contact/contact_surface.h"
#include "slender_sim/dynamics/work_budget.h"

namespace slender {

/// A sheet of cloth among the points of a CollisionSurface.
struct CollisionSheet : ContactProperties
{
  Eigen::Matrix3Xi triangles;   ///< corners: points
};

/// What collides. Solids' `ignores` name sheets.
struct CollisionSurface
{
  /// points of all sheets at rest [m]: pieces that are close there repel each other from half that distance only
  Eigen::Matrix3Xd rest;
  std::vector<CollisionSheet> sheets;
  std::vector<ContactSolid> solids;
};

/// The surface with the prisms that SurfaceCollider takes for cylinders.
CollisionSurface asTaken(CollisionSurface surface);

/// What happens in a step, as far as it is not in the surface.
struct CollisionStep
{
  const Eigen::Matrix3Xd& x_start;       ///< 3 x points [m], free of intersections
  const Eigen::VectorXd& inverse_mass;   ///< [1/kg]; zero: the point's motion is prescribed
  const std::vector<Pose>&solids, &solids_end;
  double h;                       ///< [s]
  WorkBudget* budget = nullptr;   ///< null: without bound
};

struct CollisionReport
{
  bool ok = true;
  std::string reason;         ///< of a failure
  bool spent = false;         ///< the failure: the budget is spent
  bool at_start = false;      ///< the failure is there before anything moves: no shorter step helps
  int points[2] = {-1, -1};   ///< that a failure concerns, if any: those of the sheets, then corners of the solids
  int repulsions = 0;         ///< pairs nearer than the thickness, or about to be
  int impulses = 0;           ///< collisions found and stopped
  int rounds = 0;             ///< of detection, all stages
  int zones = 0;              ///< rigid impact zones that were left in the end
  int zone_points = 0;        ///< in the largest of them
};

}   // namespace slender
