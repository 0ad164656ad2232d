#pragma once

#include <vector>

#include "mesh_tree.h"
#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/contact/solids.h"

namespace slender {

/// A solid taken apart into convex pieces.
struct SolidPieces
{
  std::vector<ConvexPiece> pieces;
  std::vector<MeshTree> tree;   ///< of a mesh: one; of other shapes: none
};

/// What may touch while points and solids stay near a motion. Memory is reused.
class Candidates
{
public:
  struct OnSolid
  {
    int solid, segment, piece;
  };
  struct Motion
  {
    const Eigen::Matrix3Xd &x, &x_end;
    const std::vector<Pose>&solids, &solids_end;
  };

  /// All pairs that may come within `gap` of each other while no coordinate leaves the boxes that the points' motions
  /// fill by more than `margin` [m], and no solid its own motion by more than `margin` and `turn` [rad].
  void build(const ContactSurface& surface, const std::vector<SolidPieces>& solids, const Motion& motion, double gap,
             double margin, double turn);
  void clear() { built_ = false; }
  bool holdsFor(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids) const;

  const std::vector<GridPairs::Pair>& pairs() const { return pairs_; }
  const std::vector<OnSolid>& onSolids() const { return on_solids_; }

private:
  void findOnSolid(const ContactSurface& surface, int solid, const SolidPieces& pieces, const Motion& motion,
                   double gap, double margin);

  bool built_ = false;
  Eigen::Matrix3Xd low_, high_;
  std::vector<Pose> solids_;
  std::vector<double> shift_, turn_;   ///< from solids_ up to which the candidates hold
  std::vector<BoundingBox> boxes_;
  GridPairs grid_;
  std::vector<GridPairs::Pair> pairs_;
  std::vector<OnSolid> on_solids_;
  std::vector<int> triangles_;
};

}   // namespace slender
