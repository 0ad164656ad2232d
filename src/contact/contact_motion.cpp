// The parts of ContactPotential that look at distances only: limits of motions and the check of clearance.
#include <algorithm>
#include <limits>
#include <numeric>

#include "contact_potential.h"
#include "convex_minimum.h"
#include "slender_sim/contact/distance.h"

namespace slender {

/// Returns candidates that hold for the whole motion, and finds them anew if none that are known do.
const Candidates& ContactPotential::candidatesOf(const SurfaceMotion& motion)
{
  for (const Candidates* known : {&near_, &swept_})
    if (known->holdsFor(motion.x, motion.solids) && known->holdsFor(motion.x_end, motion.solids_end))
      return *known;
  constexpr double kOfSheets = 0.4;   // gaps: in a wider margin, triangles find too many of their neighbours
  const auto marginOf = [&](double way) {
    return (sheets_.empty() ? std::clamp(2.0 * way / options_.gap, 1.0, 20.0) : kOfSheets) * options_.gap;
  };
  double longest = 0.0, of_solids = 0.0;
  for (std::size_t i = 0; i < margins_.size(); ++i)
  {
    const double way = (motion.x_end.col(i) - motion.x.col(i)).norm();
    longest = std::max(longest, way);
    margins_[i] = marginOf(way);
  }
  for (std::size_t k = 0; k < motion.solids.size(); ++k)
    of_solids = std::max(of_solids, (motion.solids_end[k].position - motion.solids[k].position).norm());
  margin_ = marginOf(of_solids);
  const Candidates::Range range = rangeOfCandidates();
  if (near_.follow(surface_, solids_, motion, range))
    return near_;
  if (longest <= range.longest)
  {
    near_.build(surface_, sheets_, solids_, motion, range);
    return near_;
  }
  swept_.build(surface_, sheets_, solids_, motion, rangeOfSweeps());
  return swept_;
}

ContactPotential::Meeting ContactPotential::meetingOf(const GridPairs::Pair& pair) const
{
  const ContactSegment &a = surface_.segments[pair.first], &b = surface_.segments[pair.second];
  return {a.a, b.a, -1, (a.driven | b.driven) != 0};
}

ContactPotential::Meeting ContactPotential::meetingOf(const Candidates::OnSolid& on) const
{
  const ContactSegment& s = surface_.segments[on.segment];
  return {s.a, -1, on.solid, s.driven != 0};
}

// Where there are triangles, all movers go the same share, so that it does not matter what is driven.
ContactPotential::Meeting ContactPotential::meetingOf(const SheetCandidates::Pair& pair) const
{
  return pair.edges ? Meeting{sheets_.edges[pair.first].a, sheets_.edges[pair.second].a, -1, false}
                    : Meeting{sheets_.points[pair.first].point, surface_.triangles[pair.second].corner[0], -1, false};
}

ContactPotential::Meeting ContactPotential::meetingOf(const SheetCandidates::OnSolid& on) const
{
  return {on.face.corner[0], -1, on.solid, false};
}

// ---- the share of a motion that a pair may go

double ContactPotential::limitOf(const SurfaceMotion& m, const GridPairs::Pair& pair) const
{
  const ContactSegment &a = surface_.segments[pair.first], &b = surface_.segments[pair.second];
  const double scale = scaleOf(a, b);
  ApproachLimit limit;
  limit.thickness = thicknessOf(pair, scale);
  limit.reach = scale * options_.gap;
  return segmentsLimit(m.of(a.a), m.of(a.b), m.of(b.a), m.of(b.b), limit);
}

double ContactPotential::limitOf(const SurfaceMotion& m, const Candidates::OnSolid& on) const
{
  if (passes(on))
    return 1.0;
  const ContactSegment& s = surface_.segments[on.segment];
  ApproachLimit limit;
  limit.thickness = thicknessOf(on);
  limit.reach = rangeOf(s.object, on.solid) * options_.gap;
  return segmentSolidLimit(m.of(s.a), m.of(s.b), solids_[on.solid].pieces[on.piece], rigid_[on.solid], limit);
}

double ContactPotential::limitOf(const SurfaceMotion& m, const SheetCandidates::Pair& pair) const
{
  ApproachLimit limit;
  limit.thickness = thicknessOf(pair);
  limit.reach = pair.scale * options_.gap;
  if (pair.edges)
  {
    const SheetPieces::Edge &a = sheets_.edges[pair.first], &b = sheets_.edges[pair.second];
    return segmentsLimit(m.of(a.a), m.of(a.b), m.of(b.a), m.of(b.b), limit);
  }
  const auto& c = surface_.triangles[pair.second].corner;
  return pointTriangleLimit(m.of(sheets_.points[pair.first].point), m.of(c[0]), m.of(c[1]), m.of(c[2]), limit);
}

double ContactPotential::limitOf(const SurfaceMotion& m, const SheetCandidates::OnSolid& on) const
{
  if (passes(on))
    return 1.0;
  ApproachLimit limit;
  limit.thickness = on.face.radius;
  limit.reach = rangeOf(on.face.object, on.solid) * options_.gap;
  MovingPoint corner[3];
  for (int k = 0; k < on.face.corners; ++k)
    corner[k] = m.of(on.face.corner[k]);
  return faceSolidLimit(corner, on.face.corners, solids_[on.solid].pieces[on.piece], rigid_[on.solid], limit);
}

void ContactPotential::setRigid(const SurfaceMotion& motion)
{
  rigid_.clear();
  for (std::size_t k = 0; k < motion.solids.size(); ++k)
    rigid_.emplace_back(motion.solids[k], motion.solids_end[k]);
}

/// Calls take(meeting, limit) for each pair that may not go the whole motion, if wanted(meeting) is true.
template <class Wanted, class Take>
void ContactPotential::forLimits(const SurfaceMotion& motion, Wanted&& wanted, Take&& take)
{
  constexpr int kChunk = 256;
  const Candidates& candidates = candidatesOf(motion);
  setRigid(motion);
  limits_.resize(static_cast<std::size_t>(count(candidates)));
  parallelFor(count(candidates) <= kChunk ? 1 : threads_, count(candidates), kChunk, [&](int k) {
    visit(candidates, k,
          [&](const auto& candidate) { limits_[k] = wanted(meetingOf(candidate)) ? limitOf(motion, candidate) : 1.0; });
  });
  for (int k = 0; k < count(candidates); ++k)
    if (limits_[k] < 1.0)
      visit(candidates, k, [&](const auto& candidate) { take(meetingOf(candidate), limits_[k]); });
}

double ContactPotential::stepLimit(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& x_end,
                                   const std::vector<Pose>& poses, const std::vector<Pose>& poses_end)
{
  check(x, poses);
  check(x_end, poses_end);
  if (!x.allFinite() || !x_end.allFinite())
    return 0.0;
  double share = 1.0;
  forLimits(
      {x, x_end, poses, poses_end}, [](const Meeting&) { return true; },
      [&](const Meeting&, double limit) { share = std::min(share, limit); });
  return share;
}

/// Movers that would meet become a group, which goes the least of their limits. A pair whose movers go the same share
/// stays apart, because this share is at most the limit of the pair for the whole motion. All other pairs are examined
/// again with the motions that their movers then make. If they would meet, their groups become one. After several
/// rounds all movers become one group, and also where there are triangles, because candidates of triangles hold for one
/// common motion only.
void ContactPotential::limitShares(const SurfaceMotion& motion, MotionShares& shares)
{
  constexpr int kMostRounds = 4;
  check(motion.x, motion.solids);
  check(motion.x_end, motion.solids_end);
  if (!motion.x.allFinite() || !motion.x_end.allFinite())
    return shares.stopAll();
  const auto unite = [&](const Meeting& m, double limit) {
    const Movers movers = moversOf(m, shares);
    for (const int mover : movers)
    {
      shares.unite(movers[0], mover);
      shares.limit(mover, limit);
    }
  };
  forLimits(
      motion, [](const Meeting&) { return true; }, unite);
  for (int round = 0; shares.differ(); ++round)
  {
    if (round == kMostRounds || !sheets_.empty())
      return shares.uniteAll();
    setShared(motion, shares);
    bool met = false;
    const auto differ = [&](const Meeting& m) {
      const Movers movers = moversOf(m, shares);
      const auto differs = [&](int mover) { return shares.moves(mover) && shares.of(mover) != shares.of(movers[0]); };
      return std::any_of(movers.begin(), movers.end(), differs);
    };
    forLimits({motion.x, shared_x_, motion.solids, shared_solids_}, differ, [&](const Meeting& m, double) {
      unite(m, 1.0);
      met = true;
    });
    if (!met)
      return;
  }
}

ContactPotential::Movers ContactPotential::moversOf(const Meeting& m, const MotionShares& shares)
{
  const int first = shares.of_point[m.point];
  return {first, m.solid >= 0 ? shares.of_solid[m.solid] : shares.of_point[m.other],
          m.driven ? MotionShares::kPrescribed : first};
}

/// Sets where points and solids get if each mover goes its share.
void ContactPotential::setShared(const SurfaceMotion& motion, const MotionShares& shares)
{
  shared_x_.resizeLike(motion.x);
  const auto move = [&](int i, int mover) {
    const double share = shares.of(mover);
    shared_x_.col(i) = motion.x_end.col(i);
    if (share < 1.0)
      shared_x_.col(i) = motion.x.col(i) + share * (motion.x_end.col(i) - motion.x.col(i));
  };
  for (int i = 0; i < surface_.points; ++i)
    move(i, shares.of_point[i]);
  for (const ContactSegment& s : surface_.segments)
  {
    if (s.driven & 1)
      move(s.a, MotionShares::kPrescribed);
    if (s.driven & 2)
      move(s.b, MotionShares::kPrescribed);
  }
  shared_solids_ = motion.solids_end;
  for (std::size_t k = 0; k < shared_solids_.size(); ++k)
    if (const double share = shares.of(shares.of_solid[k]); share < 1.0)
    {
      const Pose &from = motion.solids[k], &to = motion.solids_end[k];
      shared_solids_[k].position = from.position + share * (to.position - from.position);
      shared_solids_[k].orientation = from.orientation.slerp(share, to.orientation);
    }
}

double ContactPotential::thinned(const std::vector<Thinned>& list, const std::array<int, 3>& key, double thickness)
{
  const auto at = std::lower_bound(list.begin(), list.end(), Thinned{key, 0.0});
  return at != list.end() && at->key == key ? at->thickness : thickness;
}

bool ContactPotential::fit(std::vector<Thinned>& list, const std::array<int, 3>& key, double distance, double thickness,
                           double scale) const
{
  // Less than the twelfth at which the barrier is made stiffer: a step under load then ends with more room than it
  // began with, and parts that something else than motion brought together come apart again.
  const double least = scale * options_.gap / 20, opened = scale * options_.gap / 16;
  // Never to less than half of the distance between centrelines.
  if (distance - thickness < least)
    list.push_back({key, distance - std::min(opened, 0.5 * distance)});
  return distance - thickness >= least || distance > 1e-3 * thickness;
}

bool ContactPotential::thinToFit(const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses)
{
  letPass(x, poses, x, poses);   // what presses on held points passes, also when the pieces are new
  near_.build(surface_, sheets_, solids_, {x, x, poses, poses},
              {options_.gap, margin_, margins_, kInfinity, 0.0, threads_});
  for (auto* list : {&thin_pairs_, &thin_on_solids_, &thin_sheets_})
    list->clear();
  for (const GridPairs::Pair& pair : near_.pairs())
  {
    const ContactSegment &a = surface_.segments[pair.first], &b = surface_.segments[pair.second];
    if (!isStrand(a.object) && !isStrand(b.object))
      continue;
    const double distance = segmentDistance(x.col(a.a), x.col(a.b), x.col(b.a), x.col(b.b));
    const double scale = scaleOf(a, b);
    if (!fit(thin_pairs_, {pair.first, pair.second, 0}, distance, fullThickness(a, b, scale), scale))
      return false;
  }
  for (const Candidates::OnSolid& on : near_.onSolids())
  {
    const ContactSegment& s = surface_.segments[on.segment];
    if (passes(on) || !isStrand(s.object))
      continue;
    const Pose to_solid = poses[on.solid].inverse();
    const double distance =
        segmentPieceDistance(solids_[on.solid].pieces[on.piece], to_solid * Eigen::Vector3d(x.col(s.a)),
                             to_solid * Eigen::Vector3d(x.col(s.b)))
            .distance;
    if (!fit(thin_on_solids_, {on.solid, on.segment, on.piece}, distance, s.radius))
      return false;
  }
  std::sort(thin_pairs_.begin(), thin_pairs_.end());
  std::sort(thin_on_solids_.begin(), thin_on_solids_.end());
  return sheets_.empty() || thinSheetsToFit(x);
}

double ContactPotential::clearance(const Eigen::Matrix3Xd& x, const std::vector<Pose>& poses, bool strands)
{
  check(x, poses);
  double least = options_.gap;
  const int n = static_cast<int>(surface_.segments.size());
  boxes_.resize(n);
  order_.resize(n);
  for (int i = 0; i < n; ++i)
  {
    const ContactSegment& s = surface_.segments[i];
    const double around = s.radius + 0.5 * options_.gap;
    boxes_[i] = {x.col(s.a).cwiseMin(x.col(s.b)).array() - around, x.col(s.a).cwiseMax(x.col(s.b)).array() + around};
  }
  std::iota(order_.begin(), order_.end(), 0);
  std::sort(order_.begin(), order_.end(), [&](int i, int j) { return boxes_[i].low.x() < boxes_[j].low.x(); });
  for (int p = 0; p < n; ++p)
    for (int q = p + 1; q < n && boxes_[order_[q]].low.x() <= boxes_[order_[p]].high.x(); ++q)
    {
      const ContactSegment &a = surface_.segments[order_[p]], &b = surface_.segments[order_[q]];
      const ContactObject &c = surface_.objects[a.object], &d = surface_.objects[b.object];
      const double scale = scaleOf(a, b);
      const bool counts =
          !(a.prescribed() && b.prescribed()) && scale > 0.0 && (a.object == b.object ? c.self : c.others && d.others);
      if (!strands && isStrand(a.object) && isStrand(b.object))
        continue;
      if (counts && boxes_[order_[p]].overlaps(boxes_[order_[q]]))
        least = std::min(least,
                         segmentDistance(x.col(a.a), x.col(a.b), x.col(b.a), x.col(b.b)) - fullThickness(a, b, scale));
    }
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    const Pose to_solid = poses[k].inverse();
    const ContactSolid& solid = surface_.solids[k];
    const double reach = boundingRadius(solid.shape) + options_.gap;
    for (const ContactSegment& s : surface_.segments)
    {
      if (!mayTouch(surface_, s, solid))
        continue;
      const Eigen::Vector3d from = to_solid * Eigen::Vector3d(x.col(s.a)), to = to_solid * Eigen::Vector3d(x.col(s.b));
      // What is driven does not touch what is driven: a free end remains.
      const Eigen::Vector3d a = !solid.body && s.driven == 1 ? to : from,
                            e = !solid.body && s.driven != 0 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(to - from);
      if ((a + 0.5 * e).norm() > 0.5 * e.norm() + s.radius + reach)
        continue;
      for (const ConvexPiece& piece : solids_[k].pieces)
      {
        const auto distance = [&](double t) { return pieceDistance(piece, a + t * e).distance - s.radius; };
        if (distance(0.5) < 0.5 * e.norm() + least)
          least = std::min(least, convexMinimum(distance));
      }
    }
  }
  return surface_.triangles.empty() ? least : sheetClearance(x, poses, least);
}

}   // namespace slender
