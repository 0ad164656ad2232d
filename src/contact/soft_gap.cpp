#include "soft_gap.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/contact/distance.h"

namespace slender {

namespace {

/// 1 / (1 - c (2t-1)^2) and its derivatives in t.
struct EndWeight
{
  EndWeight(double softness, double t)
  {
    const double tau = 2.0 * t - 1.0, slope = 4.0 * softness * tau;
    value = 1.0 / (1.0 - softness * tau * tau);
    first = slope * value * value;
    second = (8.0 * softness + 2.0 * slope * slope * value) * value * value;
  }
  double value, first, second;
};

/// g Q and its derivatives at a place of a segment.
struct AlongSegment
{
  double t, gap, weight, weight_t, slope, curvature;
  PieceDistance piece;
};

AlongSegment along(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& e, double radius,
                   double softness, double t)
{
  AlongSegment at;
  at.t = t;
  at.piece = pieceDistance(piece, a + t * e);
  at.gap = at.piece.distance - radius;
  const EndWeight q(softness, t);
  const double rise = at.piece.normal.dot(e);
  at.weight = q.value;
  at.weight_t = q.first;
  at.slope = q.value * rise + q.first * at.gap;
  at.curvature = q.value * std::max(0.0, e.dot(at.piece.curvature * e)) + 2.0 * q.first * rise + q.second * at.gap;
  return at;
}

/// Newton's method on the slope, which changes its sign once, inside a shrinking bracket.
AlongSegment minimiseAlong(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius,
                           double softness)
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

constexpr double kStep = 1e-12;   // of a segment

/// An end that is nearly reached is reached: steps too small to tell from rounding would end the search.
double inside(double v) { return v < kStep ? 0.0 : v > 1.0 - kStep ? 1.0 : v; }

/// g Q of two segments and its first two derivatives in (s, t).
struct OnSegments
{
  double s, t, gap, weight, ws, wt, wss, wtt, h, hs, ht, hss, hst, htt;
  Eigen::Vector3d normal;
};

/// A segment w0 + s e and another, t f, and the thickness between them.
struct TwoSegments
{
  Eigen::Vector3d w0, e, f;
  double thickness;
  double ee = e.squaredNorm(), ff = f.squaredNorm(), ef = e.dot(f);
  double lengths = std::sqrt(ee) + std::sqrt(ff);

  OnSegments at(double s, double t) const
  {
    OnSegments p;
    p.s = s;
    p.t = t;
    const Eigen::Vector3d w = w0 + s * e - t * f;
    const double d = w.norm();
    const EndWeight qs(kSoftness, s), qt(kSoftness, t);
    p.normal = w / d;
    p.gap = d - thickness;
    p.weight = qs.value * qt.value;
    p.ws = qs.first * qt.value;
    p.wt = qs.value * qt.first;
    p.wss = qs.second * qt.value;
    p.wtt = qs.value * qt.second;
    const double ne = p.normal.dot(e), nf = p.normal.dot(f), turn = p.weight / d;
    p.h = p.gap * p.weight;
    p.hs = p.weight * ne + p.ws * p.gap;
    p.ht = -p.weight * nf + p.wt * p.gap;
    p.hss = turn * (ee - ne * ne) + 2.0 * p.ws * ne + p.wss * p.gap;
    p.htt = turn * (ff - nf * nf) - 2.0 * p.wt * nf + p.wtt * p.gap;
    p.hst = -turn * (ef - ne * nf) - p.ws * nf + p.wt * ne + qs.first * qt.first * p.gap;
    return p;
  }
};

/// A Newton step in (s, t), and how much of it stays on the segments.
struct PairStep
{
  double ds = 0.0, dt = 0.0, reach = 1.0;
};

/// free_s, free_t: what may change, the other stays at the end of its segment.
PairStep newtonStep(const TwoSegments& segments, const OnSegments& p, bool free_s, bool free_t)
{
  PairStep step;
  const auto blocked = [](double value, double change) {
    return (value <= 0.0 && change < 0.0) || (value >= 1.0 && change > 0.0);
  };
  const auto single = [](double slope, double curvature, double safe) {
    return -slope / (curvature > 0.1 * safe ? curvature : safe);
  };
  // Away from the minimum the Hessian may be indefinite; without its mixed terms it never is.
  const double safe_s = p.hss - 2.0 * p.ws * p.normal.dot(segments.e),
               safe_t = p.htt + 2.0 * p.wt * p.normal.dot(segments.f);
  const double det = p.hss * p.htt - p.hst * p.hst;
  bool both = free_s && free_t;
  if (both && p.hss > 0.0 && det > 1e-14 * p.hss * p.htt)
  {
    step.ds = (p.hst * p.ht - p.htt * p.hs) / det;
    step.dt = (p.hst * p.hs - p.hss * p.ht) / det;
    both = !blocked(p.s, step.ds) && !blocked(p.t, step.dt);
  }
  else
    both = false;
  if (!both)
  {
    step.ds = free_s ? single(p.hs, p.hss, safe_s) : 0.0;
    step.dt = free_t ? single(p.ht, p.htt, safe_t) : 0.0;
    // one at a time: together, without the mixed term, they might climb
    if (std::abs(p.hs * step.ds) >= std::abs(p.ht * step.dt))
      step.dt = 0.0;
    else
      step.ds = 0.0;
  }
  if (step.ds != 0.0)
    step.reach = std::min(step.reach, (step.ds > 0.0 ? 1.0 - p.s : -p.s) / step.ds);
  if (step.dt != 0.0)
    step.reach = std::min(step.reach, (step.dt > 0.0 ? 1.0 - p.t : -p.t) / step.dt);
  return step;
}

/// Moves p along the step, as far as g Q falls. False, and p stays, where it does not.
bool descend(const TwoSegments& segments, const PairStep& step, double slope, OnSegments& p)
{
  double reach = step.reach;
  OnSegments trial = segments.at(inside(p.s + reach * step.ds), inside(p.t + reach * step.dt));
  // Where the gap's rounding hides a descent, the slopes still show it.
  const double noise = 4e-16 * (p.gap + segments.thickness + segments.lengths);
  const auto steepness = [&](const OnSegments& q) {
    return std::max(step.ds != 0.0 ? std::abs(q.hs) : 0.0, step.dt != 0.0 ? std::abs(q.ht) : 0.0);
  };
  const auto better = [&] {
    return trial.h <= p.h + 1e-4 * reach * slope || (trial.h <= p.h + noise && steepness(trial) < 0.5 * steepness(p));
  };
  while (!better() && reach > 1e-6)
  {
    reach *= 0.5;
    trial = segments.at(inside(p.s + reach * step.ds), inside(p.t + reach * step.dt));
  }
  if (!better())
    return false;
  p = trial;
  return true;
}

SoftGap gapAt(const TwoSegments& segments, const OnSegments& p, bool free_s, bool free_t)
{
  const Eigen::Vector3d &e = segments.e, &f = segments.f;
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
  out.distance = p.gap + segments.thickness;
  const double turn = p.weight / out.distance;
  out.turn_s = turn * (e - p.normal.dot(e) * p.normal);
  out.turn_t = turn * (p.normal.dot(f) * p.normal - f);
  return out;
}

}   // namespace

double leastDistance(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  const PieceDistance middle = pieceDistance(piece, 0.5 * (a + b));
  return middle.distance > 0.0 ? std::max(0.0, middle.distance - 0.5 * std::abs(middle.normal.dot(b - a))) : 0.0;
}

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

SoftGap softGap(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                const Eigen::Vector3d& b1, double thickness)
{
  const TwoSegments segments{a0 - b0, a1 - a0, b1 - b0, thickness};
  const SegmentPair start = closestOfSegments(a0, a1, b0, b1);
  OnSegments p = segments.at(inside(start.s), inside(start.t));
  bool free_s = false, free_t = false;
  for (int k = 0; k < 60 && p.gap > 0.0; ++k)
  {
    free_s = (p.s > 0.0 || p.hs < 0.0) && (p.s < 1.0 || p.hs > 0.0);
    free_t = (p.t > 0.0 || p.ht < 0.0) && (p.t < 1.0 || p.ht > 0.0);
    const PairStep step = newtonStep(segments, p, free_s, free_t);
    const double slope = p.hs * step.ds + p.ht * step.dt;
    if (std::max(std::abs(step.ds), std::abs(step.dt)) < kStep || !(slope < 0.0))
      break;
    if (!descend(segments, step, slope, p))
      break;
  }
  return gapAt(segments, p, free_s, free_t);
}

}   // namespace slender
