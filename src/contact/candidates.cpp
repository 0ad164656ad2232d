#include "candidates.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "linalg/parallel_for.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

double angleBetween(const Pose& a, const Pose& b)
{
  return rotationVector(a.orientation * b.orientation.conjugate()).norm();
}

/// Takes what is old out of a sorted list, and merges other entries into it, which are sorted, too.
template <class Entry, class Old, class Less>
void mergeInto(std::vector<Entry>& list, const std::vector<Entry>& added, std::vector<Entry>& spare, const Old& isOld,
               const Less& less)
{
  list.erase(std::remove_if(list.begin(), list.end(), isOld), list.end());
  spare.resize(list.size() + added.size());
  std::merge(list.begin(), list.end(), added.begin(), added.end(), spare.begin(), less);
  list.swap(spare);
}

}   // namespace

double contactShare(double along, double radii, double gap)
{
  constexpr double kMet = 1e-6;
  const double share = along / (0.5 * M_PI * (radii + gap));
  return share > kMet ? std::min(1.0, share) : 0.0;
}

double contactShare(const ContactSegment& a, const ContactSegment& b, const ContactObject& curve, double gap)
{
  const ContactSegment &first = a.start <= b.start ? a : b, &second = a.start <= b.start ? b : a;
  double along = second.start - (first.start + first.length);
  if (curve.closed)
    along = std::min(along, curve.curve_length + first.start - (second.start + second.length));
  return contactShare(along, a.radius + b.radius, gap);
}

void Candidates::build(const ContactSurface& surface, const SheetPieces& sheets, const std::vector<SolidPieces>& solids,
                       const Motion& motion, const Range& range)
{
  margin_ = range.margin;
  start_ = motion.x;
  way_ = motion.x_end - motion.x;
  low_.resizeLike(motion.x);
  high_.resizeLike(motion.x);
  parallelFor(range.threads, surface.points, 1024, [&](int i) { setBox(i, motion, range); });
  const int n = static_cast<int>(surface.segments.size());
  boxes_.resize(n);
  sets_.resize(n);
  parallelFor(range.threads, n, 1024, [&](int i) {
    setBox(surface, i, range.gap);
    const int object = surface.segments[i].object;
    sets_[i] = surface.objects[object].self ? GridPairs::kNone : object;
  });
  pairs_.clear();
  has_pairs_ = std::any_of(surface.objects.begin(), surface.objects.end(),
                           [](const ContactObject& o) { return o.self || o.others; });
  if (has_pairs_)
    findPairs(surface, grid_.find(boxes_, sets_, range.threads), range.gap, pairs_);
  solids_ = motion.solids;
  shift_.resize(solids_.size());
  turn_.resize(solids_.size());
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    shift_[k] = (motion.solids_end[k].position - solids_[k].position).norm() + margin_;
    turn_[k] = angleBetween(motion.solids_end[k], solids_[k]) + range.turn;
  }
  segments_.resize(n);
  std::iota(segments_.begin(), segments_.end(), 0);
  on_solids_.clear();
  findOnSolids(surface, solids, segments_, motion.x, range.gap, on_solids_);
  built_count_ = count();
  if (!sheets.empty())
    sheets_.build(surface, sheets, solids, motion, {range.gap, margin_, shift_, turn_});
  has_triangles_ = !sheets.empty();
  built_ = true;
}

bool Candidates::follow(const ContactSurface& surface, const std::vector<SolidPieces>& solids, const Motion& motion,
                        const Range& range)
{
  constexpr int kShare = 8;   // If more than this part of the points leave, build() takes hardly longer.
  const int points = surface.points, n = static_cast<int>(surface.segments.size()), most = points / kShare;
  if (!built_ || has_triangles_ || !holdsFor(motion.solids) || !holdsFor(motion.solids_end))
    return false;
  left_.assign(points, false);
  int leaving = 0;
  const auto leave = [&](int i) {
    left_[i] = true;
    ++leaving;
  };
  for (int i = 0; i < points; ++i)
    if (!holdsAt(motion.x, i) || !holdsAt(motion.x_end, i))
      leave(i);
  if (leaving > most)
    return false;
  for (int i = 0; i < points && leaving < most; ++i)
    if (!left_[i] && isLoose(i, motion, range))
      leave(i);
  built_ = false;
  for (int i = 0; i < points; ++i)
    if (left_[i])
      setBox(i, motion, range);
  segments_.clear();
  changed_.assign(n, false);
  for (int i = 0; i < n; ++i)
    if (const ContactSegment& s = surface.segments[i]; left_[s.a] || left_[s.b])
    {
      setBox(surface, i, range.gap);
      segments_.push_back(i);
      changed_[i] = true;
    }
  new_pairs_.clear();
  if (has_pairs_)
    findPairs(surface, grid_.findWith(segments_, boxes_, sets_, range.threads), range.gap, new_pairs_);
  new_on_solids_.clear();
  findOnSolids(surface, solids, segments_, motion.x, range.gap, new_on_solids_);
  // On a long way a few points may come near more than all others do. Such pairs are for one motion alone.
  if (count() + new_pairs_.size() + new_on_solids_.size() > 2 * built_count_ + most)
    return false;
  mergeInto(
      pairs_, new_pairs_, spare_pairs_,
      [&](const GridPairs::Pair& p) { return changed_[p.first] || changed_[p.second]; },
      [](const GridPairs::Pair& p, const GridPairs::Pair& q) {
        return std::tie(p.first, p.second) < std::tie(q.first, q.second);
      });
  mergeInto(
      on_solids_, new_on_solids_, spare_on_solids_, [&](const OnSolid& on) { return changed_[on.segment] != 0; },
      [](const OnSolid& p, const OnSolid& q) { return std::tie(p.solid, p.segment) < std::tie(q.solid, q.segment); });
  built_ = true;
  return true;
}

/// Returns whether the box of a point is much larger than the motion needs, as that of a point that has become slow.
/// Such a box finds too many pairs.
bool Candidates::isLoose(int point, const Motion& motion, const Range& range) const
{
  constexpr double kLoose = 4.0;
  const double way = (motion.x_end.col(point) - motion.x.col(point)).cwiseAbs().maxCoeff();
  return (high_.col(point) - low_.col(point)).maxCoeff() > kLoose * (way + 2.0 * range.margins[point]);
}

void Candidates::setBox(int point, const Motion& motion, const Range& range)
{
  const Eigen::Vector3d from = motion.x.col(point), to = motion.x_end.col(point);
  const double margin = (to - from).norm() > range.longest ? 0.0 : range.margins[point];
  low_.col(point) = from.cwiseMin(to).array() - margin;
  high_.col(point) = from.cwiseMax(to).array() + margin;
}

void Candidates::setBox(const ContactSurface& surface, int segment, double gap)
{
  const ContactSegment& s = surface.segments[segment];
  const double around = s.radius + 0.5 * gap;
  boxes_[segment].low = low_.col(s.a).cwiseMin(low_.col(s.b)).array() - around;
  boxes_[segment].high = high_.col(s.a).cwiseMax(high_.col(s.b)).array() + around;
}

void Candidates::findPairs(const ContactSurface& surface, const std::vector<GridPairs::Pair>& near, double gap,
                           std::vector<GridPairs::Pair>& found) const
{
  for (const GridPairs::Pair& p : near)
    if (mayMeet(surface, surface.segments[p.first], surface.segments[p.second], gap))
      found.push_back(p);
}

bool Candidates::mayMeet(const ContactSurface& surface, const ContactSegment& a, const ContactSegment& b,
                         double gap) const
{
  if (a.prescribed() && b.prescribed())
    return false;
  const ContactObject &c = surface.objects[a.object], &d = surface.objects[b.object];
  if (a.object != b.object)
    return c.others && d.others;
  const double share = c.self ? contactShare(a, b, c, gap) : 0.0;
  if (share == 0.0 || share == 1.0)
    return share == 1.0;
  // Boxes of near segments overlap even if the curve is straight. Balls around the segments tell more.
  double reach = share * (a.coreRadius() + b.coreRadius() + gap);
  const auto middle = [&](const ContactSegment& s) -> Eigen::Vector3d {
    const Eigen::Vector3d from = 0.5 * (low_.col(s.a) + high_.col(s.a)), to = 0.5 * (low_.col(s.b) + high_.col(s.b));
    const double around =
        std::max((high_.col(s.a) - low_.col(s.a)).squaredNorm(), (high_.col(s.b) - low_.col(s.b)).squaredNorm());
    reach += 0.5 * ((to - from).norm() + std::sqrt(around));
    return 0.5 * (from + to);
  };
  return (middle(a) - middle(b)).norm() <= reach;
}

/// Finds the solids that these segments may touch while their points are in their boxes. x is a place in the boxes.
void Candidates::findOnSolids(const ContactSurface& surface, const std::vector<SolidPieces>& solids,
                              const std::vector<int>& segments, const Eigen::Matrix3Xd& x, double gap,
                              std::vector<OnSolid>& found)
{
  for (std::size_t k = 0; k < solids.size(); ++k)
    for (const int i : segments)
      findOnSolid(surface, solids[k], {static_cast<int>(k), i, 0}, x, gap, found);
}

void Candidates::findOnSolid(const ContactSurface& surface, const SolidPieces& pieces, OnSolid on,
                             const Eigen::Matrix3Xd& x, double gap, std::vector<OnSolid>& found)
{
  const Pose& pose = solids_[on.solid];
  const ContactSegment& s = surface.segments[on.segment];
  const auto way = [&](int point) {
    return (high_.col(point) - x.col(point)).cwiseMax(x.col(point) - low_.col(point)).norm();
  };
  const Eigen::Vector3d a = x.col(s.a) - pose.position, b = x.col(s.b) - pose.position;
  const double farthest = std::sqrt(std::max(a.squaredNorm(), b.squaredNorm())), half = 0.5 * (b - a).norm();
  // how far a point of the segment may come nearer, seen from the solid
  const double moved = std::max(way(s.a), way(s.b)), shift = shift_[on.solid];
  const double slack = moved + shift + turn_[on.solid] * (farthest + moved + shift);
  const double most = gap + s.radius + slack;
  const Eigen::Vector3d middle = 0.5 * (a + b);
  if (middle.norm() > pieces.reach + half + most || !mayTouch(surface, s, surface.solids[on.solid]))
    return;
  const Eigen::Quaterniond to_solid = pose.orientation.conjugate();
  if (pieces.tree.empty())
  {
    if (pieceDistance(pieces.pieces[0], to_solid * middle).distance <= half + most)
      found.push_back(on);
    return;
  }
  const Eigen::Vector3d za = to_solid * a, zb = to_solid * b;
  triangles_.clear();
  pieces.tree[0].query({za.cwiseMin(zb).array() - most, za.cwiseMax(zb).array() + most}, triangles_);
  for (const int triangle : triangles_)
    found.push_back({on.solid, on.segment, triangle});
}

bool Candidates::holdsFor(const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids) const
{
  if (!built_)
    return false;
  if (has_triangles_)   // which hold only where all points are near one instant of the motion
  {
    const double length2 = way_.squaredNorm();   // of the way of all points
    const double t = length2 > 0.0 ? std::clamp((x - start_).cwiseProduct(way_).sum() / length2, 0.0, 1.0) : 0.0;
    if (((x - start_ - t * way_).array().abs() > margin_).any())
      return false;
  }
  else if ((x.array() < low_.array()).any() || (x.array() > high_.array()).any())
    return false;
  return holdsFor(solids);
}

bool Candidates::holdsFor(const std::vector<Pose>& solids) const
{
  for (std::size_t k = 0; k < solids.size(); ++k)
    if ((solids[k].position - solids_[k].position).norm() > shift_[k] || angleBetween(solids[k], solids_[k]) > turn_[k])
      return false;
  return true;
}

}   // namespace slender
