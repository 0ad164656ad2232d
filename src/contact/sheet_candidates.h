#pragma once

#include <cstdint>
#include <vector>

#include "kdop_tree.h"
#include "sheet_pieces.h"
#include "surface_motion.h"

namespace slender {

/// What may touch of triangles while points and solids stay near a motion. Memory is reused.
///
/// A tree of k-DOPs over triangles and segments finds pairs of edges, and of points and triangles, that are neighbours:
/// their volumes overlap with a skin around the points, seen from the points' mean. The list of neighbours holds while
/// points stay within their skins [Verlet 1967], and for points that leave them, the tree finds their new neighbours.
/// Of the neighbours, those that are too far apart for a motion are left out, so that the pairs do not depend on
/// motions before.
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
  /// A ball around a face.
  struct Ball
  {
    Eigen::Vector3d middle;
    double half, moved;   ///< radius when the motion begins; largest way of a corner [m]
  };
  void buildTree(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x);
  void setSkins(const SheetPieces& pieces, const Eigen::Matrix3Xd& x);
  void findPairs(const ContactSurface& surface, const SheetPieces& pieces, const SurfaceMotion& motion,
                 const Slack& slack);
  void setVolumes(const SheetPieces& pieces, const SurfaceMotion& motion, const Slack& slack);
  void updateNeighbours(const ContactSurface& surface, const SheetPieces& pieces);
  void addNeighbours(const ContactSurface& surface, const SheetPieces& pieces, int a, int b);
  void addEdges(const SheetPieces& pieces, int a, int b);
  void addPoint(const ContactSurface& surface, const SheetPieces& pieces, int number, int element);
  void testEdges(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x, int a, int b);
  void testPoint(const ContactSurface& surface, const SheetPieces& pieces, const Eigen::Matrix3Xd& x, int number,
                 int triangle);
  static void setBalls(const std::vector<SheetPieces::Face>& faces, const SurfaceMotion& motion, double margin,
                       std::vector<Ball>& balls);
  void findOnSolid(const ContactSurface& surface, const std::vector<SheetPieces::Face>& faces,
                   const std::vector<Ball>& balls, int solid, const SolidPieces& pieces, const SurfaceMotion& motion,
                   const Slack& slack);

  bool tree_built_ = false;
  double gap_ = 0.0;
  KdopTree tree_;
  Eigen::Matrix3Xd centers_;
  std::vector<int> groups_;
  std::vector<char> touching_, active_;
  std::vector<double> skin_;   ///< per object [m]
  std::vector<int> edge_counts_;
  std::vector<double> strays_;   ///< of points: how far they get from where the mean motion takes them, and the margin
  std::vector<Kdop> points_;     ///< volumes of points during the motion, in the frame of their mean
  std::vector<Kdop> known_;      ///< the same with skins, as they were when the neighbours were sought; empty at first
  std::vector<Kdop> volumes_;    ///< of elements, around those in known_
  std::vector<char> left_;       ///< points that are not within their volumes in known_
  std::vector<std::uint64_t> neighbours_;       ///< pairs as numbers, in the order of pairs()
  std::vector<std::uint64_t> fresh_, merged_;   ///< for updateNeighbours()
  std::size_t most_neighbours_ = 0;             ///< The list begins anew if it is longer.
  std::vector<KdopTree::Pair> found_;
  std::vector<Pair> pairs_;
  std::vector<OnSolid> on_solids_;
  std::vector<Ball> balls_[3];   ///< of corners, whole triangles and faces, see SheetPieces
  std::vector<int> triangles_;
};

}   // namespace slender
