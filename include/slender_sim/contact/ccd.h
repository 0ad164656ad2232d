#pragma once

#include <Eigen/Core>

#include "slender_sim/contact/solids.h"
#include "slender_sim/geometry/pose.h"

/// Continuous collision by additive advancement [Li et al., Codimensional IPC, 2021, section 5.3], with bounds along
/// the separating direction, so that pieces which slide past each other cost few steps. Each returns a share alpha in
/// [0, 1] of the motion such that the gap (distance minus `thickness`) never falls below kept * min(present gap, reach)
/// until alpha; alpha = 1 unless the gap comes near that. Zero if the gap is not positive to begin with.
namespace slender {

struct ApproachLimit
{
  double thickness = 0.0;   ///< [m] sum of the radii
  double reach = 0.0;       ///< [m] > 0: farther away, pieces may come as near as kept * reach at once
  double kept = 0.4;        ///< [-]
};

struct MovingPoint
{
  Eigen::Vector3d from, to;   ///< [m]
};

double segmentsLimit(const MovingPoint& a0, const MovingPoint& a1, const MovingPoint& b0, const MovingPoint& b1,
                     const ApproachLimit& limit);
double pointTriangleLimit(const MovingPoint& p, const MovingPoint& a, const MovingPoint& b, const MovingPoint& c,
                          const ApproachLimit& limit);

/// A rigid motion: the frame's origin goes along a straight line while the frame turns uniformly about it, by the
/// smaller angle.
struct RigidMotion
{
  RigidMotion(const Pose& from, const Pose& to);
  Pose at(double share) const;

  Pose from;
  Eigen::Vector3d shift, turn;   ///< [m], rotation vector in world axes [rad]
};

/// A point, segment or triangle of 1 to 3 corners against a convex piece of a solid that moves rigidly.
double faceSolidLimit(const MovingPoint* corner, int corners, const ConvexPiece& piece, const RigidMotion& motion,
                      const ApproachLimit& limit);
/// The same for a segment.
double segmentSolidLimit(const MovingPoint& a, const MovingPoint& b, const ConvexPiece& piece,
                         const RigidMotion& motion, const ApproachLimit& limit);

}   // namespace slender
