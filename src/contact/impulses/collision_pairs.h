#pragma once

#include <vector>

#include "collision_elements.h"
#include "contact/kdop_tree.h"
#include "slender_sim/contact/ccd.h"
#include "slender_sim/dynamics/work_budget.h"

namespace slender {

/// A vertex and a face (element), or two edges, that may come near each other, and how they lie at the start of the
/// step.
struct CollisionPair
{
  int first, second;
  bool edges;
  int point[4];   ///< vertex and corners, or ends of both edges
  double gap;     ///< distance at the start beyond the cores [m]
  /// separated along the normal by more than this at the end, the pieces never meet (infinite: no telling) [m]
  double room;
  Eigen::Vector3d normal;   ///< at the start
};

/// Where a pair is nearest: the sum of weight[i] x[point[i]] is the way from the second piece to the first.
struct PairPlace
{
  int point[4];   ///< vertex and corners; ends of both edges
  double weight[4];
  double distance;          ///< [m]
  Eigen::Vector3d normal;   ///< from the second piece to the first; unit (zero where they meet)
  bool inside;              ///< of the face, or of both edges
};

/// Pairs whose pieces may come nearer than their cores and shells while points move along lines. Memory is reused.
class CollisionPairs
{
public:
  explicit CollisionPairs(const CollisionElements& elements);

  /// Finds all pairs of a step. Once the budget is spent some are missing.
  const std::vector<CollisionPair>& find(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, WorkBudget& budget);
  /// The same step with other ends: adds pairs where points have left the volumes searched, which are larger than the
  /// motion by a margin.
  const std::vector<CollisionPair>& update(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                           WorkBudget& budget);

  /// Whether a plane is seen to keep the pieces apart.
  static bool separated(const CollisionPair& pair, const Eigen::Matrix3Xd& to);
  int object(const CollisionPair& pair, bool second) const;
  double core(const CollisionPair& pair) const;
  double shell(const CollisionPair& pair) const;
  /// After a share of the motion.
  PairPlace place(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                  double share) const;
  PairPlace place(const CollisionPair& pair, const Eigen::Matrix3Xd& x) const;
  double limit(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
               const ApproachLimit& limit) const;

private:
  template <class Position>
  PairPlace placeAt(const CollisionPair& pair, Position x) const;
  void search(const Eigen::Matrix3Xd& from, WorkBudget& budget);
  void testElements(int a, int b, const Eigen::Matrix3Xd& from);
  void add(int first, int second, bool edges, const int (&point)[4], const Eigen::Matrix3Xd& from);

  const CollisionElements& elements_;
  std::vector<double> radius_, margin_;   ///< of points [m]
  Eigen::Matrix3Xd searched_;             ///< ends of the motions around which the volumes lie
  std::vector<char> strayed_;             ///< points whose pairs are looked for
  std::vector<Kdop> points_, edges_, volumes_;
  std::vector<char> active_;
  KdopTree tree_;
  std::vector<KdopTree::Pair> found_;
  std::vector<CollisionPair> pairs_;
};

}   // namespace slender
