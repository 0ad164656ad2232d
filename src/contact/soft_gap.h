#pragma once

#include <Eigen/Core>

#include "slender_sim/contact/solids.h"

/// Smooth gaps of straight pieces, for barriers.
///
/// The distance between two segments has a kink where they are parallel: the place of contact jumps from one end of the
/// overlap to the other, and so does the force. Mollifiers that fade the pair out there [Li et al. 2020, section 5]
/// leave the contact to other pairs and add torques of their own. Here the minimum itself is made unique instead:
///
///   G = min over (s, t) of g(s, t) / phi(s, t),   g = |A(s) - B(t)| - thickness,   phi = (1 - c (2s-1)^2) (1 - c
///   (2t-1)^2).
///
/// g is convex and phi strictly concave for c < 1/3, so that g - G phi is strictly convex: it vanishes at one point
/// only. This place of contact moves continuously, and G is continuously differentiable with the gradient n / phi (that
/// at fixed s, t). G vanishes exactly where the pieces meet, and g_min <= G <= g_min / (1 - c)^2. With one parameter (a
/// segment against a convex solid) phi = 1 - c (2t-1)^2.
///
/// Where a contact slides across a node, both segments there carry it, each with the softened gap 1.47 g, so that the
/// height of a rod that slides over another's nodes under a constant load changes by less than 8 % of the barrier's
/// reach (13 % as c goes to 0).
namespace slender {

constexpr double kSoftness = 0.32;   ///< c

/// A lower bound of the distance [m] of a segment from a convex piece, from the plane that separates the piece from the
/// middle of the segment. 0 where the middle is inside.
double leastDistance(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Where a segment's point a + t (b - a) is nearest to a convex piece.
struct SegmentPieceDistance
{
  double t = 0.0, distance = 0.0;   ///< [m] along `normal`; negative inside
  Eigen::Vector3d normal;
};
SegmentPieceDistance segmentPieceDistance(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// G, its parameters and what its derivatives need. With u = A(s) - B(t) and the rows r_s = n . (Q d(a1 - a0) + Q_s du)
/// + turn_s . du and r_t = n . (-Q d(b1 - b0) + Q_t du) + turn_t . du, the second derivative of G is that at fixed
/// parameters, Q/distance (1 - n n^T), less r^T H^-1 r over the free parameters.
struct SoftGap
{
  double s = 0.0, t = 0.0;
  double gap = 0.0;        ///< G [m]; not positive: they meet
  double distance = 0.0;   ///< |u| [m] (segments only)
  double weight = 1.0;     ///< Q = 1 / phi
  double weight_s = 0.0, weight_t = 0.0;
  double hss = 0.0, hst = 0.0, htt = 0.0;
  bool free_s = false, free_t = false;                ///< not held at an end of the segment
  Eigen::Vector3d normal{0, 0, 1};                    ///< from B to A (from the solid to the segment)
  Eigen::Vector3d turn_s{0, 0, 0}, turn_t{0, 0, 0};   ///< Q dn/ds, Q dn/dt (segments only)
};
SoftGap softGap(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                const Eigen::Vector3d& b1, double thickness);

/// Of a segment with a radius against a convex piece, in the piece's frame; only t is used.
SoftGap softGap(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, const ConvexPiece& piece);

}   // namespace slender
