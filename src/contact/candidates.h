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
    double longest;                       ///< Points that go a longer way have no margin. Below 0: no point has one.
    double turn;                          ///< [rad]
    int threads;                          ///< that search for pairs; see parallelFor()
  };

  /// Finds all pairs that may come within the gap of each other while all points are at one instant of the motion, but
  /// for at most the margin in each coordinate, and solids leave the motion by at most the margin and the turn.
  /// Without triangles each point may be anywhere in the box of its own motion, enlarged by its margin.
  void build(const ContactSurface& surface, const SheetPieces& sheets, const std::vector<SolidPieces>& solids,
             const Motion& motion, const Range& range);
  /// Makes the candidates hold for this motion, by what build() does, but only for the points that leave their boxes
  /// and for some whose boxes are much too large. Returns false if this would not save much time, if nothing has been
  /// built, if solids leave their places, or if there are triangles. Then build() must be called.
  bool follow(const ContactSurface& surface, const std::vector<SolidPieces>& solids, const Motion& motion,
              const Range& range);
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
  bool holdsAt(const Eigen::Matrix3Xd& x, Eigen::Index point) const
  {
    return (x.col(point).array() >= low_.col(point).array()).all() &&
           (x.col(point).array() <= high_.col(point).array()).all();
  }
  bool holdsFor(const std::vector<Pose>& solids) const;
  bool isLoose(int point, const Motion& motion, const Range& range) const;
  void setBox(int point, const Motion& motion, const Range& range);
  void setBox(const ContactSurface& surface, int segment, double gap);
  void findPairs(const ContactSurface& surface, const std::vector<GridPairs::Pair>& near, double gap,
                 std::vector<GridPairs::Pair>& found) const;
  void findOnSolids(const ContactSurface& surface, const std::vector<SolidPieces>& solids,
                    const std::vector<int>& segments, const Eigen::Matrix3Xd& x, double gap,
                    std::vector<OnSolid>& found);
  void findOnSolid(const ContactSurface& surface, const SolidPieces& pieces, OnSolid on, const Eigen::Matrix3Xd& x,
                   double gap, std::vector<OnSolid>& found);

  std::size_t count() const { return pairs_.size() + on_solids_.size(); }

  bool built_ = false, has_triangles_ = false, has_pairs_ = false;
  double margin_ = 0.0;
  Eigen::Matrix3Xd start_, way_;   ///< of points: where the motion starts, and how far it leads
  Eigen::Matrix3Xd low_, high_;    ///< boxes of points
  std::vector<Pose> solids_;
  std::vector<double> shift_, turn_;   ///< from solids_ up to which the candidates hold
  std::vector<BoundingBox> boxes_;
  std::vector<int> sets_;   ///< of the boxes, see GridPairs
  GridPairs grid_;
  std::vector<GridPairs::Pair> pairs_, new_pairs_, spare_pairs_;
  std::vector<OnSolid> on_solids_, new_on_solids_, spare_on_solids_;
  std::size_t built_count_ = 0;        ///< of pairs and of pairs with solids, after build()
  std::vector<char> left_, changed_;   ///< points that get other boxes; segments of such points
  std::vector<int> segments_;          ///< whose pairs are sought
  std::vector<int> triangles_;
  SheetCandidates sheets_;
};

}   // namespace slender
