#include "slender_sim/contact/distance.h"

#include <algorithm>

#include <Eigen/Geometry>

namespace slender {

double closestOnSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  const Eigen::Vector3d e = b - a;
  const double e2 = e.squaredNorm(), along = e.dot(p - a);
  if (!(along > 0.0))
    return 0.0;
  return along < e2 ? along / e2 : 1.0;
}

namespace {

/// Does what closestOfSegments() does, also for segments that are nearly parallel or have no length.
SegmentPair closestOfAnySegments(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                                 const Eigen::Vector3d& b1)
{
  const Eigen::Vector3d e = a1 - a0, f = b1 - b0, w = b0 - a0, c = e.cross(f);
  const double c2 = c.squaredNorm(), parallel = 1e-6 * e.squaredNorm() * f.squaredNorm();
  SegmentPair best;
  double nearest = -1.0;
  // The cross product keeps its digits at small angles, where e^2 f^2 - (e f)^2 loses them all.
  const double s2 = w.cross(f).dot(c), t2 = w.cross(e).dot(c);
  if (c2 > 0.0 && s2 >= 0.0 && s2 <= c2 && t2 >= 0.0 && t2 <= c2)
  {
    best = {s2 / c2, t2 / c2};
    if (c2 > parallel)
      return best;   // the distance is convex in (s, t): an inner minimum is the minimum
    nearest = (w + best.t * f - best.s * e).squaredNorm();
  }
  const auto consider = [&](double s, double t) {
    const double d2 = (w + t * f - s * e).squaredNorm();
    if (nearest < 0.0 || d2 < nearest)
    {
      nearest = d2;
      best = {s, t};
    }
  };
  consider(0.0, closestOnSegment(a0, b0, b1));
  consider(1.0, closestOnSegment(a1, b0, b1));
  consider(closestOnSegment(b0, a0, a1), 0.0);
  consider(closestOnSegment(b1, a0, a1), 1.0);
  return best;
}

}   // namespace

SegmentPair closestOfSegments(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                              const Eigen::Vector3d& b1)
{
  constexpr double kParallel = 1e-2;   // square of the sine of the angle; at this angle two digits are lost
  const Eigen::Vector3d e = a1 - a0, f = b1 - b0, w = b0 - a0;
  const double ee = e.squaredNorm(), ff = f.squaredNorm(), ef = e.dot(f), ew = e.dot(w), fw = f.dot(w);
  const double both = ee * ff - ef * ef;
  if (!(both > kParallel * ee * ff))
    return closestOfAnySegments(a0, a1, b0, b1);
  // s is where the lines are nearest, clamped to the segment, and t is nearest to it. If t is beyond an end, s is the
  // place nearest to that end [Ericson, Real-Time Collision Detection, 5.1.9].
  const double s = std::clamp((ew * ff - fw * ef) / both, 0.0, 1.0), t = (ef * s - fw) / ff;
  if (t < 0.0)
    return {std::clamp(ew / ee, 0.0, 1.0), 0.0};
  if (t > 1.0)
    return {std::clamp((ew + ef) / ee, 0.0, 1.0), 1.0};
  return {s, t};
}

Eigen::Vector3d closestOnTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c)
{
  const Eigen::Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double n2 = normal.squaredNorm(), square = ab.squaredNorm() * ac.squaredNorm();
  Eigen::Vector3d inner;
  double inner2 = -1.0;
  if (n2 > 1e-24 * square)
  {
    // signed areas of the triangles that the projection of p makes with the edges
    const double u = (c - b).cross(p - b).dot(normal), v = (a - c).cross(p - c).dot(normal), w = n2 - u - v;
    if (u > 0.0 && v > 0.0 && w > 0.0)
    {
      inner = {u / n2, v / n2, w / n2};
      if (n2 > 1e-6 * square)
        return inner;
      // of a needle: rounded so much that an edge may be nearer
      inner2 = (inner[0] * a + inner[1] * b + inner[2] * c - p).squaredNorm();
    }
  }
  const double ts[3] = {closestOnSegment(p, a, b), closestOnSegment(p, b, c), closestOnSegment(p, c, a)};
  const double d2[3] = {(a + ts[0] * ab - p).squaredNorm(), (b + ts[1] * (c - b) - p).squaredNorm(),
                        (c - ts[2] * ac - p).squaredNorm()};
  const int k = d2[0] <= d2[1] && d2[0] <= d2[2] ? 0 : d2[1] <= d2[2] ? 1 : 2;
  if (inner2 >= 0.0 && inner2 < d2[k])
    return inner;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
  weights[k] = 1.0 - ts[k];
  weights[(k + 1) % 3] = ts[k];
  return weights;
}

double pointSegmentDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  return (a + closestOnSegment(p, a, b) * (b - a) - p).norm();
}

double segmentDistance(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                       const Eigen::Vector3d& b1)
{
  const SegmentPair c = closestOfSegments(a0, a1, b0, b1);
  return (b0 + c.t * (b1 - b0) - a0 - c.s * (a1 - a0)).norm();
}

double pointTriangleDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                             const Eigen::Vector3d& c)
{
  const Eigen::Vector3d w = closestOnTriangle(p, a, b, c);
  return (w[0] * a + w[1] * b + w[2] * c - p).norm();
}

}   // namespace slender
