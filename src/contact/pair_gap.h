#pragma once

#include <Eigen/Core>

#include "slender_sim/contact/solids.h"
#include "soft_gap.h"

/// Gaps of the pairs that touch, for barriers, in one form: two edges, a point and a triangle, and a point, segment or
/// triangle and a convex piece of a solid.
///
/// The distance of a point from a triangle has one nearest place, which moves continuously, so that it serves as it is:
/// it is once continuously differentiable, also where the nearest place runs over an edge or a corner
/// [Li et al., Incremental Potential Contact, 2020, section 4].
///
/// A triangle that lies on a flat side of a solid has many nearest places. As for segments (soft_gap.h), the minimum is
/// made unique: with barycentric weights w,
///
///   G = min over w of g(w) / phi(w),   g = distance of the place from the solid - thickness,
///   phi = 1 - c (3 |w|^2 - 1) / 2,
///
/// which is 1 in the middle and 1 - c at the corners. g is convex and phi strictly concave, so that G is once
/// continuously differentiable, vanishes exactly where the pieces meet, and g_min <= G <= g_min / (1 - c).
namespace slender {

/// How the place of contact runs along the pieces of a pair: by up to two free parameters. With the displacements d of
/// the pair's points, a parameter's row is r = n . sum_i along_i d_i + turn . sum_i weight_i d_i, and h is the second
/// derivative of the gap in the parameters. The second derivative of the gap has the part -r^T h^-1 r.
struct PlaceMotion
{
  int count = 0;
  Eigen::Vector4d along[2] = {Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero()};
  Eigen::Vector3d turn[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double h00 = 0.0, h01 = 0.0, h11 = 0.0;   ///< positive definite; of one parameter h00 counts
};

/// The gap of a pair of pieces. Its gradient in the displacement of point i is place_weight[i] weight normal.
struct PairGap
{
  double gap = 0.0;        ///< [m]; not positive: they meet
  double distance = 0.0;   ///< [m] between the nearest places
  double weight = 1.0;     ///< 1 / phi
  Eigen::Vector3d normal{0, 0, 1};
  Eigen::Vector4d place{0, 0, 0, 0};   ///< weights of the points in the way from the second place to the first
  PlaceMotion motion;
};

/// Two segments, softened as in soft_gap.h. The pair's points are a0, a1, b0, b1. `motion` only on request.
PairGap edgesGap(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                 const Eigen::Vector3d& b1, double thickness, bool with_motion);

/// A point (the first of the pair's points) and a triangle a, b, c (the others).
PairGap pointTriangleGap(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                         const Eigen::Vector3d& c, double thickness);

/// A point, segment or triangle of 1 to 3 corners and a convex piece, in the piece's frame. The piece's turning and
/// curvature are left out of `motion`.
PairGap facePieceGap(const Eigen::Vector3d* corner, int corners, double thickness, const ConvexPiece& piece);

/// A lower bound of the distance [m] of such a face from a convex piece, from one plane that separates them; 0 where
/// there is none.
double leastFaceDistance(const ConvexPiece& piece, const Eigen::Vector3d* corner, int corners);

/// The plane that bounds the distance of such a face from a convex piece closely from below: by at most a tenth of
/// what it is beyond the thickness. `foot` is the corner nearest to the plane and `distance` [m] how far it is beyond.
struct FacePlane
{
  double distance;   ///< [m]
  bool meets;        ///< A place of the face is not farther than the thickness.
  Eigen::Vector3d foot, normal;
};
FacePlane separatingPlane(const ConvexPiece& piece, const Eigen::Vector3d* corner, int corners, double thickness);

}   // namespace slender
