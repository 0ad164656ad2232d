#pragma once

#include <memory>
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

/// Keeps sheets from passing through each other, themselves and solids: corrects the end of a step so that no pair of a
/// vertex and a face, or of two edges, meets while points go along straight lines [Bridson, Fedkiw, Anderson, SIGGRAPH
/// 2002]: pairs nearer than the thickness or about to be get inelastic repulsions with friction; collisions that are
/// left (additive CCD, ccd.h) constrain the end of the step, all at once, with friction [cf. Harmon et al., SIGGRAPH
/// 2008]; pieces that still collide move rigidly (Provot's impact zones), which ends it.
///
/// Impulses conserve momentum. Solids and points without inverse mass move as prescribed. Solids' corners go along
/// straight lines; a cylinder is taken as a prism around it, by less than a twentieth of the thickness. Memory is
/// reused; nothing else is carried over from step to step.
class SurfaceCollider
{
public:
  /// Throws std::invalid_argument naming what is wrong.
  explicit SurfaceCollider(const CollisionSurface& surface);
  ~SurfaceCollider();
  SurfaceCollider(SurfaceCollider&&) noexcept;

  /// Corrects the end of a step x [m] and the velocities v [m/s] there (3 x points). A failure changes nothing:
  /// surfaces meet at the start, motions that are prescribed squeeze a piece, a piece would have to turn by more than a
  /// quarter, the step's budget is spent; a shorter step may help. `again`: after approach() for the same step, from
  /// the same start.
  CollisionReport resolve(const CollisionStep& step, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v, bool again = false);

  /// Where repulsions and the first impulses would move the end of a step, so that the load can be shared with what
  /// does not touch. `again`: after another approach() for the same step, from the same start. False where that cannot
  /// be told, as in failures of resolve().
  bool approach(const CollisionStep& step, Eigen::Matrix3Xd& x, bool again);

  /// What contacts in the last successful step gave to points without inverse mass, which whatever holds them takes up:
  /// 3 x points [N s]. Of zones that follow held points the change of momentum, shared out equally; of those that
  /// follow a solid as well, nothing: it is not determined.
  const Eigen::Matrix3Xd& heldImpulses() const;
  /// Whether any of these points had a repulsion or an impulse in the last call of resolve().
  bool touched(int first, int count) const;
  /// The solid that a point beyond those of the sheets is a corner of.
  int solidOf(int point) const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
