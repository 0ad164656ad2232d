#include "soft_gap.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/contact/distance.h"

namespace slender {

namespace {

/// g Q and its derivatives at a place of a segment.
struct AlongSegment
{
  double t, gap, weight, weight_t, slope, curvature;
  PieceDistance piece;
};

AlongSegment along(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& e, double radius, double softness, double t)
{
  AlongSegment at;
  at.t = t;
  at.piece = pieceDistance(piece, a + t * e, e);
  at.gap = at.piece.distance - radius;
  const double tau = 2.0 * t - 1.0, rise = at.piece.normal.dot(e);
  at.weight = 1.0 + softness * tau * tau;
  at.weight_t = 4.0 * softness * tau;
  at.slope = at.weight * rise + at.weight_t * at.gap;
  at.curvature = at.weight * at.piece.curvature + 2.0 * at.weight_t * rise + 8.0 * softness * at.gap;
  return at;
}

/// Newton's method on the slope, which changes its sign once, inside a shrinking bracket.
AlongSegment minimiseAlong(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, double softness)
{
  constexpr double kWidth = 1e-13;
  const Eigen::Vector3d e = b - a;
  double low = 0.0, high = 1.0;
  bool low_known = false, high_known = false;
  AlongSegment at = along(piece, a, e, radius, softness, 0.5);
  for (int k = 0; k < 100; ++k)
  {
    if ((softness > 0.0 && !(at.gap > 0.0)) || at.slope == 0.0)
      return at;
    if (at.slope > 0.0)
    {
      high = at.t;
      high_known = true;
    }
    else
    {
      low = at.t;
      low_known = true;
    }
    if (high <= 0.0 || low >= 1.0 || high - low < kWidth)
      return at;
    const double downhill = at.slope > 0.0 ? -1.0 : 2.0;
    double next = at.curvature > 0.0 ? at.t - at.slope / at.curvature : downhill;
    const bool converged = std::abs(next - at.t) < kWidth;
    if (next <= low)
      next = low_known ? 0.5 * (low + high) : 0.0;
    else if (next >= high)
      next = high_known ? 0.5 * (low + high) : 1.0;
    if (converged)
      return at;
    if (k >= 8 && k % 2 == 0)   // the curvature jumps where the piece's features meet
      next = 0.5 * (low + high);
    at = along(piece, a, e, radius, softness, next);
  }
  return at;
}

/// g Q of two segments and its first two derivatives in (s, t).
struct OnSegments
{
  double s, t, gap, weight, ws, wt, h, hs, ht, hss, hst, htt;
  Eigen::Vector3d normal;
};

}  // namespace

SegmentPieceDistance segmentPieceDistance(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  const AlongSegment at = minimiseAlong(piece, a, b, 0.0, 0.0);
  return {at.t, at.piece.distance, at.piece.normal};
}

SoftGap softGap(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, const ConvexPiece& piece)
{
  const AlongSegment at = minimiseAlong(piece, a, b, radius, kSoftness);
  SoftGap out;
  out.t = at.t;
  out.gap = at.gap * at.weight;
  out.weight = at.weight;
  out.weight_t = at.weight_t;
  out.htt = at.curvature;
  out.free_t = at.t > 0.0 && at.t < 1.0 && at.curvature > 0.0;
  out.normal = at.piece.normal;
  return out;
}

SoftGap softGap(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0, const Eigen::Vector3d& b1, double thickness)
{
  constexpr double kStep = 1e-12;   // of a segment
  const Eigen::Vector3d w0 = a0 - b0, e = a1 - a0, f = b1 - b0;
  const auto at = [&](double s, double t) {
    OnSegments p;
    p.s = s;
    p.t = t;
    const Eigen::Vector3d w = w0 + s * e - t * f;
    const double d = w.norm(), sigma = 2.0 * s - 1.0, tau = 2.0 * t - 1.0;
    p.normal = w / d;
    p.gap = d - thickness;
    p.weight = 1.0 + 0.5 * kSoftness * (sigma * sigma + tau * tau);
    p.ws = 2.0 * kSoftness * sigma;
    p.wt = 2.0 * kSoftness * tau;
    const double ne = p.normal.dot(e), nf = p.normal.dot(f);
    p.h = p.gap * p.weight;
    p.hs = p.weight * ne + p.ws * p.gap;
    p.ht = -p.weight * nf + p.wt * p.gap;
    p.hss = p.weight * (e.squaredNorm() - ne * ne) / d + 2.0 * p.ws * ne + 4.0 * kSoftness * p.gap;
    p.htt = p.weight * (f.squaredNorm() - nf * nf) / d - 2.0 * p.wt * nf + 4.0 * kSoftness * p.gap;
    p.hst = -p.weight * (e.dot(f) - ne * nf) / d - p.ws * nf + p.wt * ne;
    return p;
  };
  const double reaching = e.norm() + f.norm();
  const SegmentPair start = closestOfSegments(a0, a1, b0, b1);
  OnSegments p = at(start.s, start.t);
  bool free_s = false, free_t = false;
  for (int k = 0; k < 60 && p.gap > 0.0; ++k)
  {
    free_s = (p.s > 0.0 || p.hs < 0.0) && (p.s < 1.0 || p.hs > 0.0);
    free_t = (p.t > 0.0 || p.ht < 0.0) && (p.t < 1.0 || p.ht > 0.0);
    // Away from the minimum the Hessian may be indefinite; without its mixed terms it never is.
    double ds = 0.0, dt = 0.0;
    const auto blocked = [](double value, double step) { return (value <= 0.0 && step < 0.0) || (value >= 1.0 && step > 0.0); };
    const auto single = [](double slope, double curvature, double safe) { return -slope / (curvature > 0.1 * safe ? curvature : safe); };
    const double safe_s = p.hss - 2.0 * p.ws * p.normal.dot(e), safe_t = p.htt + 2.0 * p.wt * p.normal.dot(f);
    const double det = p.hss * p.htt - p.hst * p.hst;
    bool both = free_s && free_t;
    if (both && p.hss > 0.0 && det > 1e-14 * p.hss * p.htt)
    {
      ds = (p.hst * p.ht - p.htt * p.hs) / det;
      dt = (p.hst * p.hs - p.hss * p.ht) / det;
      both = !blocked(p.s, ds) && !blocked(p.t, dt);
    }
    else
      both = false;
    if (!both)
    {
      ds = free_s ? single(p.hs, p.hss, safe_s) : 0.0;
      dt = free_t ? single(p.ht, p.htt, safe_t) : 0.0;
      // one at a time: together, without the mixed term, they might climb
      if (std::abs(p.hs * ds) >= std::abs(p.ht * dt))
        dt = 0.0;
      else
        ds = 0.0;
    }
    double reach = 1.0;
    if (ds != 0.0)
      reach = std::min(reach, (ds > 0.0 ? 1.0 - p.s : -p.s) / ds);
    if (dt != 0.0)
      reach = std::min(reach, (dt > 0.0 ? 1.0 - p.t : -p.t) / dt);
    const double slope = p.hs * ds + p.ht * dt;
    if (std::max(std::abs(ds), std::abs(dt)) < kStep || !(slope < 0.0))
      break;
    const auto moved = [](double value, double step, double share) {
      const double v = value + share * step;
      return v < 1e-15 ? 0.0 : v > 1.0 - 1e-15 ? 1.0 : v;
    };
    OnSegments trial = at(moved(p.s, ds, reach), moved(p.t, dt, reach));
    // Where the gap's rounding hides a descent, the slopes still show it.
    const double noise = 4e-16 * (p.gap + thickness + reaching);
    const auto steepness = [&](const OnSegments& q) { return std::max(ds != 0.0 ? std::abs(q.hs) : 0.0, dt != 0.0 ? std::abs(q.ht) : 0.0); };
    const auto better = [&] {
      return trial.h <= p.h + 1e-4 * reach * slope || (trial.h <= p.h + noise && steepness(trial) < 0.5 * steepness(p));
    };
    while (!better() && reach > 1e-6)
    {
      reach *= 0.5;
      trial = at(moved(p.s, ds, reach), moved(p.t, dt, reach));
    }
    if (!better())
      break;
    p = trial;
  }
  SoftGap out;
  out.s = p.s;
  out.t = p.t;
  out.gap = p.h;
  out.weight = p.weight;
  out.weight_s = p.ws;
  out.weight_t = p.wt;
  out.hss = p.hss;
  out.hst = p.hst;
  out.htt = p.htt;
  out.free_s = free_s && p.hss > 0.0;
  out.free_t = free_t && p.htt > 0.0;
  out.normal = p.normal;
  return out;
}

}  // namespace slender
