#pragma once

#include <vector>

#include "kdop_tree.h"
#include "sheet_pieces.h"
#include "surface_motion.h"

namespace slender {

/// What may touch of triangles while points and solids stay near a motion. Memory is reused.
///
/// Pairs of triangles, and of triangles and segments, are found by a tree of k-DOPs over them. Of what the tree finds,
/// the pairs of edges, and of points and triangles, that are too far apart for their motion against the mean are
/// dropped. So a cloth that is flat has hardly any, however fast it moves as a whole.
class SheetCandidates
{
public:
  /// Two edges, of which one at least is that of a triangle, or a point and a triangle, by their numbers in
  /// SheetPieces.
  struct Pair
  {
    bool edges;
    int first, second;
    double thickness;   ///< [m]
    double scale;       ///< of the gap at which they repel: less than 1 if they are near each other at rest
  };
  struct OnSolid
  {
    int solid, piece;
    SheetPieces::Face face;
  };
  /// How near a point may come to a solid, seen from it, because both leave their motions.
  struct Slack
  {
    double gap, margin;                       ///< [m]
    const std::vector<double>&shift, &turn;   ///< of solids [m], [rad]
  };

  /// The tree has other pieces from now on.
  void forget() { tree_built_ = false; }
  /// See Candidates::build().
  void build(const ContactSurface& surface, const SheetPieces& pieces, const std::vector<SolidPieces>& solids,
             const SurfaceMotion& motion, const Slack& slack);
  /// In order of kind (edges first), first and second.
  const std::vector<Pair>& pairs() const { return pairs_; }
  /// In order of solid, corners, index and piece.
  const std::vector<OnSolid>& onSolids() const { return on_solids_; }

private:
  void buildTree(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x);
  void findPairs(const ContactSurface& surface, const SheetPieces& pieces, const SurfaceMotion& motion,
                 const Slack& slack);
  void testElements(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x, int a, int b);
  void testEdges(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x, int a, int b);
  void testPoint(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x, int number,
                 int element);
  void findOnSolid(const ContactSurface& surface, const std::vector<SheetPieces::Face>& faces, int solid,
                   const SolidPieces& pieces, const SurfaceMotion& motion, const Slack& slack);

  bool tree_built_ = false;
  double gap_ = 0.0;
  KdopTree tree_;
  Eigen::Matrix3Xd centers_;
  std::vector<int> groups_;
  std::vector<char> touching_, active_;
  std::vector<Kdop> volumes_, points_, edges_;   ///< of elements, points and edges
  std::vector<double> strays_;   ///< of points: how far they get from where the mean motion takes them, and the margin
  std::vector<KdopTree::Pair> found_;
  std::vector<Pair> pairs_;
  std::vector<OnSolid> on_solids_;
  std::vector<int> triangles_;
};

}   // namespace slender
