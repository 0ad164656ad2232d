#pragma once

#include <vector>

#include "sheet_candidates.h"
#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/contact_surface.h"
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
  /// Lengths are in m.
  struct Range
  {
    double gap;
    double margin;                        ///< of triangles and solids
    const std::vector<double>& margins;   ///< of points of curves; all are `margin` where there are triangles
    double turn;                          ///< [rad]
    int threads;                          ///< that search for pairs; see parallelFor()
  };

  /// Finds all pairs that may come within the gap of each other while all points are at one instant of the motion, but
  /// for at most the margin in each coordinate, and solids leave the motion by at most the margin and the turn.
  /// Without triangles each point may be anywhere in the box of its own motion, enlarged by its margin.
  void build(const ContactSurface& surface, const SheetPieces& sheets, const std::vector<SolidPieces>& solids,
             const Motion& motion, const Range& range);
  /// Forgets everything: the surface has other pieces from now on.
  void clear()
  {
    built_ = false;
    sheets_.forget();
  }
  /// Returns true if the pairs are all that may come within the gap of each other at x. If that is true of two places,
  /// it is true of all places between.
  bool holdsFor(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids) const;

  const std::vector<GridPairs::Pair>& pairs() const { return pairs_; }
  const std::vector<OnSolid>& onSolids() const { return on_solids_; }
  const SheetCandidates& sheets() const { return sheets_; }   ///< Of triangles, if there are any.

private:
  bool mayMeet(const ContactSurface& surface, const ContactSegment& a, const ContactSegment& b, double gap) const;
  void findOnSolid(const ContactSurface& surface, int solid, const SolidPieces& pieces, const Motion& motion,
                   const Range& range);

  bool built_ = false, has_triangles_ = false;
  double margin_ = 0.0;
  Eigen::Matrix3Xd start_, way_;   ///< of points: where the motion starts, and how far it leads
  Eigen::Matrix3Xd low_, high_;    ///< boxes of points
  std::vector<Pose> solids_;
  std::vector<double> shift_, turn_;   ///< from solids_ up to which the candidates hold
  std::vector<BoundingBox> boxes_;
  std::vector<int> sets_;   ///< of the boxes, see GridPairs
  GridPairs grid_;
  std::vector<GridPairs::Pair> pairs_;
  std::vector<OnSolid> on_solids_;
  std::vector<int> triangles_;
  SheetCandidates sheets_;
};

}   // namespace slender
