#include "slender_sim/contact/ccd.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "slender_sim/contact/distance.h"
#include "slender_sim/geometry/rotation.h"
#include "pair_gap.h"
#include "soft_gap.h"

namespace slender {

namespace {

constexpr int kMaxAdvances = 500;     // stopping early is safe: the share so far is free
constexpr double kTolerance = 0.1;    // share of the kept gap at which the advance ends
constexpr double kRounding = 1e-14;   // of distances, over the pieces' extent

/// Times until linearly moving corners can reach the plane that separates the pieces now.
class PlaneBound
{
public:
  explicit PlaneBound(double room) : room_(room) {}
  /// A pair of corners: its distance beyond the nearest pair's, along the normal, and its rate. Where pieces nearly
  /// touch, the normal is rounded so much that it may not separate them: then this bound says nothing.
  void corner(double beyond, double rate)
  {
    const double room = room_ + beyond;
    if (!(room > 0.0))
      time_ = 0.0;
    else if (rate < 0.0)
      time_ = std::min(time_, room / -rate);
  }
  double time() const { return time_; }

private:
  double room_, time_ = std::numeric_limits<double>::infinity();
};

/// Pieces of N and M corners that move along straight lines; closest(a, b) gives the difference of the nearest points,
/// a - b.
template <int N, int M, class Closest>
double advance(const MovingPoint* const (&a)[N], const MovingPoint* const (&b)[M], const ApproachLimit& limit,
               Closest closest)
{
  // Seen from the first corner of b everything is rounded in proportion to the pieces' extent and relative motion,
  // wherever they are.
  Eigen::Vector3d ra[N], rb[M], va[N], vb[M], pa[N], pb[M];
  double extent = 0.0, speed2 = 0.0;
  const auto relative = [&](const MovingPoint& p, Eigen::Vector3d& r, Eigen::Vector3d& v) {
    const Eigen::Vector3d end = p.to - b[0]->to;
    r = p.from - b[0]->from;
    v = end - r;
    extent = std::max({extent, r.cwiseAbs().maxCoeff(), end.cwiseAbs().maxCoeff()});
  };
  for (int i = 0; i < N; ++i)
    relative(*a[i], ra[i], va[i]);
  for (int j = 0; j < M; ++j)
    relative(*b[j], rb[j], vb[j]);
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < M; ++j)
      speed2 = std::max(speed2, (va[i] - vb[j]).squaredNorm());
  const double speed = std::sqrt(speed2), apart = limit.thickness + kRounding * extent;
  double t = 0.0, goal = 0.0;
  for (int k = 0; k < kMaxAdvances; ++k)
  {
    for (int i = 0; i < N; ++i)
      pa[i] = ra[i] + t * va[i];
    for (int j = 0; j < M; ++j)
      pb[j] = rb[j] + t * vb[j];
    const Eigen::Vector3d difference = closest(pa, pb);
    const double d = difference.norm(), gap = d - apart;
    if (k == 0)
    {
      if (!(gap > 0.0))
        return 0.0;
      goal = limit.kept * std::min(gap, limit.reach);
    }
    const double room = gap - goal;
    if (room >= speed * (1.0 - t))
      return 1.0;
    if (room <= kTolerance * goal)
      return t;
    const Eigen::Vector3d n = difference / d;
    PlaneBound plane(room);
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < M; ++j)
        plane.corner(n.dot(pa[i] - pb[j]) - d, n.dot(va[i] - vb[j]));
    t += std::max(room / speed, plane.time());
    if (t >= 1.0)
      return 1.0;
  }
  return t;
}

}   // namespace

double segmentsLimit(const MovingPoint& a0, const MovingPoint& a1, const MovingPoint& b0, const MovingPoint& b1,
                     const ApproachLimit& limit)
{
  const MovingPoint* const a[2] = {&a0, &a1};
  const MovingPoint* const b[2] = {&b0, &b1};
  return advance(a, b, limit, [](const Eigen::Vector3d* p, const Eigen::Vector3d* q) -> Eigen::Vector3d {
    const SegmentPair c = closestOfSegments(p[0], p[1], q[0], q[1]);
    return p[0] + c.s * (p[1] - p[0]) - q[0] - c.t * (q[1] - q[0]);
  });
}

double pointTriangleLimit(const MovingPoint& p, const MovingPoint& a, const MovingPoint& b, const MovingPoint& c,
                          const ApproachLimit& limit)
{
  const MovingPoint* const point[1] = {&p};
  const MovingPoint* const triangle[3] = {&a, &b, &c};
  return advance(point, triangle, limit, [](const Eigen::Vector3d* p, const Eigen::Vector3d* q) -> Eigen::Vector3d {
    const Eigen::Vector3d w = closestOnTriangle(p[0], q[0], q[1], q[2]);
    return p[0] - w[0] * q[0] - w[1] * q[1] - w[2] * q[2];
  });
}

RigidMotion::RigidMotion(const Pose& from, const Pose& to)
  : from(from),
    shift(to.position - from.position),
    turn(rotationVector(to.orientation * from.orientation.conjugate()))
{
}

Pose RigidMotion::at(double share) const
{
  return {from.position + share * shift, fromRotationVector(share * turn) * from.orientation};
}

namespace {

/// Lower bounds of distances that cost little.
double leastOf(const ConvexPiece& piece, const Eigen::Vector3d (&z)[2]) { return leastDistance(piece, z[0], z[1]); }
template <int N>
double leastOf(const ConvexPiece& piece, const Eigen::Vector3d (&z)[N])
{
  return leastFaceDistance(piece, z, N);
}

/// A face of N corners that moves along straight lines, and a convex piece of a solid; plane(z) gives a FacePlane for
/// the corners z in the frame of the solid.
template <int N, class Plane>
double advanceToSolid(const MovingPoint* const (&corner)[N], const ConvexPiece& piece, const RigidMotion& motion,
                      const ApproachLimit& limit, Plane nearestPlane)
{
  // Seen from the solid, whose axes turn with w, a corner at r from the origin has the velocity v - w x r and an
  // acceleration of at most 2 |w| |v| + w^2 |r|; v is constant and r runs along a line, so that both are largest at an
  // end of the remaining time.
  const double spin = motion.turn.norm();
  Eigen::Vector3d v[N];
  for (int i = 0; i < N; ++i)
    v[i] = corner[i]->to - corner[i]->from - motion.shift;
  double t = 0.0, goal = 0.0;
  for (int k = 0; k < kMaxAdvances; ++k)
  {
    const Pose pose = k == 0 ? motion.from : motion.at(t);
    const Eigen::Quaterniond to_solid = pose.orientation.conjugate();
    Eigen::Vector3d r[N], rate[N], z[N];
    double speed = 0.0, acceleration = 0.0;
    for (int i = 0; i < N; ++i)
    {
      r[i] = corner[i]->from + t * (corner[i]->to - corner[i]->from) - pose.position;
      const Eigen::Vector3d r_end = r[i] + (1.0 - t) * v[i];
      rate[i] = to_solid * Eigen::Vector3d(v[i] - motion.turn.cross(r[i]));
      z[i] = to_solid * r[i];
      speed = std::max({speed, rate[i].norm(), (v[i] - motion.turn.cross(r_end)).norm()});
      acceleration = std::max(acceleration, spin * (2.0 * v[i].norm() + spin * std::max(r[i].norm(), r_end.norm())));
    }
    if (k == 0)
    {
      const double least = leastOf(piece, z) - limit.thickness;
      if (least > 0.0 && least - limit.kept * std::min(least, limit.reach) >= speed)
        return 1.0;
    }
    const FacePlane nearest = nearestPlane(z);
    const double gap = nearest.distance - limit.thickness;
    if (k == 0)
    {
      if (nearest.meets || !(gap > 0.0))
        return 0.0;
      goal = limit.kept * std::min(gap, limit.reach);
    }
    const double room = gap - goal;
    if (room >= speed * (1.0 - t))
      return 1.0;
    if (room <= kTolerance * goal)
      return t;
    double plane = std::numeric_limits<double>::infinity();
    for (int i = 0; i < N; ++i)
    {
      // the first time at which room + beyond + rate t - acceleration t^2 / 2 = 0
      const double c = std::max(0.0, room + nearest.normal.dot(z[i] - nearest.foot)), s = nearest.normal.dot(rate[i]);
      const double root = std::sqrt(s * s + 2.0 * acceleration * c);
      const double time = !(c > 0.0)           ? 0.0
                          : s <= 0.0           ? (root > s ? 2.0 * c / (root - s) : plane)
                          : acceleration > 0.0 ? (s + root) / acceleration
                                               : plane;
      plane = std::min(plane, time);
    }
    t += std::max(room / speed, plane);
    if (t >= 1.0)
      return 1.0;
  }
  return t;
}

}   // namespace

double segmentSolidLimit(const MovingPoint& a, const MovingPoint& b, const ConvexPiece& piece,
                         const RigidMotion& motion, const ApproachLimit& limit)
{
  const MovingPoint* const corner[2] = {&a, &b};
  return advanceToSolid(corner, piece, motion, limit, [&](const Eigen::Vector3d* z) {
    const SegmentPieceDistance at = segmentPieceDistance(piece, z[0], z[1]);
    return FacePlane{at.distance, !(at.distance - limit.thickness > 0.0), z[0] + at.t * (z[1] - z[0]), at.normal};
  });
}

double faceSolidLimit(const MovingPoint* corner, int corners, const ConvexPiece& piece, const RigidMotion& motion,
                      const ApproachLimit& limit)
{
  const auto plane = [&](const Eigen::Vector3d* z) { return separatingPlane(piece, z, corners, limit.thickness); };
  if (corners == 1)
  {
    const MovingPoint* const one[1] = {corner};
    return advanceToSolid(one, piece, motion, limit, plane);
  }
  if (corners == 2)
    return segmentSolidLimit(corner[0], corner[1], piece, motion, limit);
  const MovingPoint* const three[3] = {corner, corner + 1, corner + 2};
  return advanceToSolid(three, piece, motion, limit, plane);
}

}   // namespace slender
