#pragma once

#include <vector>

#include "sheet_candidates.h"
#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/contact/solids.h"
#include "surface_motion.h"

namespace slender {

/// What may touch while points and solids stay near a motion. Memory is reused.
class Candidates
{
public:
  struct OnSolid
  {
    int solid, segment, piece;
  };
  using Motion = SurfaceMotion;

  /// All pairs that may come within `gap` of each other while no coordinate leaves the boxes that the points' motions
  /// fill by more than `margin` [m], and no solid its own motion by more than `margin` and `turn` [rad].
  void build(const ContactSurface& surface, const SheetPieces& sheets, const std::vector<SolidPieces>& solids,
             const Motion& motion, double gap, double margin, double turn);
  /// Forgets everything: the surface has other pieces from now on.
  void clear()
  {
    built_ = false;
    sheets_.forget();
  }
  bool holdsFor(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids) const;

  const std::vector<GridPairs::Pair>& pairs() const { return pairs_; }
  const std::vector<OnSolid>& onSolids() const { return on_solids_; }
  const SheetCandidates& sheets() const { return sheets_; }   ///< Of triangles, if there are any.

private:
  bool mayMeet(const ContactSurface& surface, const ContactSegment& a, const ContactSegment& b, double gap) const;
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
  SheetCandidates sheets_;
};

}   // namespace slender
