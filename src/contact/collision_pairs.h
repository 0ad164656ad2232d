#pragma once

#include <vector>

#include "collision_elements.h"
#include "kdop_tree.h"
#include "slender_sim/contact/ccd.h"

namespace slender {

/// A vertex and a face (element), or two edges.
struct CollisionPair
{
  int first, second;
  bool edges;
};

/// Where a pair is nearest: the sum of weight[i] x[point[i]] is the way from the second piece to the first.
struct PairPlace
{
  int point[4];   ///< vertex and corners; ends of both edges
  double weight[4];
  double distance;          ///< [m]
  Eigen::Vector3d normal;   ///< from the second piece to the first; unit (zero where they meet)
  bool inside;              ///< of both edges
};

/// Pairs whose pieces may come nearer than their cores and shells while points move along lines. Memory is reused.
class CollisionPairs
{
public:
  explicit CollisionPairs(const CollisionElements& elements);

  /// All pairs.
  const std::vector<CollisionPair>& all(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);
  /// Those of which a point has changed its motion since the last call, where `changed` tells; other motions must be as they were then.
  const std::vector<CollisionPair>& ofChanged(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, const std::vector<char>& changed);

  int object(const CollisionPair& pair, bool second) const;
  double core(const CollisionPair& pair) const;
  double shell(const CollisionPair& pair) const;
  /// After a share of the motion.
  PairPlace place(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, double share) const;
  PairPlace place(const CollisionPair& pair, const Eigen::Matrix3Xd& x) const;
  double limit(const CollisionPair& pair, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to, const ApproachLimit& limit) const;

private:
  const std::vector<CollisionPair>& find(const std::vector<char>& changed);
  template <class Position>
  PairPlace placeAt(const CollisionPair& pair, Position x) const;
  void testElements(int a, int b, const std::vector<char>& changed);

  const CollisionElements& elements_;
  std::vector<double> radius_;   ///< of points [m]
  std::vector<Kdop> points_, edges_, volumes_;
  std::vector<char> active_, all_;
  KdopTree tree_;
  std::vector<KdopTree::Pair> found_;
  std::vector<CollisionPair> pairs_;
};

}  // namespace slender
