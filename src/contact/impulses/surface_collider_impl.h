#pragma once

#include <string>
#include <vector>

#include "collision_pairs.h"
#include "collision_rows.h"
#include "impact_zones.h"
#include "slender_sim/contact/impulses/surface_collider.h"

namespace slender {

class SurfaceCollider::Impl
{
public:
  explicit Impl(const CollisionSurface& surface) : elements_(surface), pairs_(elements_)
  {
    const Eigen::Index n = elements_.reference.cols();
    for (Eigen::Matrix3Xd* m : {&from_, &to_, &tested_, &velocity_})
      m->resize(3, n);
    inverse_mass_.setZero(n);
    changed_.resize(n);
  }

  CollisionReport resolve(const CollisionStep& step, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v, bool again);
  bool approach(const CollisionStep& step, Eigen::Matrix3Xd& x, bool again);
  const Eigen::Matrix3Xd& heldImpulses() const { return held_impulses_; }
  bool touched(int first, int count) const { return rows_.touch(first, count); }
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
