#pragma once

#include <string>
#include <vector>

#include "collision_pairs.h"
#include "collision_rows.h"
#include "impact_zones.h"
#include "slender_sim/contact/impulses/collision_surface.h"

namespace slender {

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
  explicit SurfaceCollider(const CollisionSurface& surface) : elements_(surface), pairs_(elements_)
  {
    const Eigen::Index n = elements_.reference.cols();
    for (Eigen::Matrix3Xd* m : {&from_, &to_, &tested_, &velocity_})
      m->resize(3, n);
    inverse_mass_.setZero(n);
    changed_.resize(n);
  }
  SurfaceCollider(const SurfaceCollider&) = delete;   // pairs_ refers to elements_

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
  const Eigen::Matrix3Xd& heldImpulses() const { return held_impulses_; }
  /// Whether any of these points had a repulsion or an impulse in the last call of resolve().
  bool touched(int first, int count) const { return rows_.touch(first, count); }
  /// The solid that a point beyond those of the sheets is a corner of.
  int solidOf(int point) const { return elements_.point_object.at(point) - elements_.sheet_count; }

private:
  struct PlaneHit
  {
    int point, plane;
  };

  bool load(const CollisionStep& step, const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& v, bool again);
  bool examineStart();
  void addHits();
  bool examinePlanes();
  void detect();
  ApproachLimit limitOf(const CollisionPair& pair) const;
  bool planeHit(int point, int plane) const;
  double planeGap(int plane, const std::vector<Pose>& poses, const Eigen::Vector3d& x) const;
  double reach(const CollisionPair& pair) const;
  CollisionRow& addRow(const CollisionPair& pair, const PairPlace& place);
  void repel(const CollisionPair& pair, const PairPlace& place, double range);
  void stop(const CollisionPair& pair);
  void addPlaneRow(int point, int plane, double gap, bool hit);
  bool joinHits();
  bool moveZones();
  bool followPrescribed(const ImpactZones::Zone& zone);
  void solveVelocities();
  void takeHeldImpulses();
  bool fail(const std::string& reason, int first = -1, int second = -1);
  bool failAtStart(const std::string& reason, int first, int second = -1)
  {
    return !(report_.at_start = true) || fail(reason, first, second);
  }
  bool failSpent();
  int node(int point) const;

  CollisionElements elements_;
  CollisionPairs pairs_;
  CollisionRows rows_;
  ImpactZones zones_;
  CollisionReport report_;

  const CollisionStep* step_ = nullptr;
  WorkBudget unbounded_;
  WorkBudget* budget_ = &unbounded_;
  Eigen::Matrix3Xd from_, to_;   ///< all points, at both ends of the step
  Eigen::Matrix3Xd tested_;      ///< ends at the last detection
  Eigen::Matrix3Xd displacement_, velocity_;
  Eigen::VectorXd inverse_mass_;
  Eigen::Matrix3Xd held_impulses_;
  std::vector<char> changed_;
  static constexpr double kPush = 0.1;   ///< share of the overlap of shells that a step removes [Bridson et al. 2002]
  double push_ = kPush;
  bool known_ = false;   ///< pairs_ are those of the step's start
  std::vector<CollisionPair> hits_;
  std::vector<PlaneHit> plane_hits_;
};

}   // namespace slender
