#include "candidates.h"

#include <algorithm>
#include <cmath>

#include "linalg/parallel_for.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

double angleBetween(const Pose& a, const Pose& b)
{
  return rotationVector(a.orientation * b.orientation.conjugate()).norm();
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
  const double gap = range.gap;
  margin_ = range.margin;
  start_ = motion.x;
  way_ = motion.x_end - motion.x;
  const Eigen::Map<const Eigen::RowVectorXd> margins(range.margins.data(), motion.x.cols());
  low_ = motion.x.cwiseMin(motion.x_end).rowwise() - margins;
  high_ = motion.x.cwiseMax(motion.x_end).rowwise() + margins;
  boxes_.resize(surface.segments.size());
  sets_.resize(surface.segments.size());
  parallelFor(range.threads, static_cast<int>(boxes_.size()), 1024, [&](int i) {
    const ContactSegment& s = surface.segments[i];
    const double around = s.radius + 0.5 * gap;
    boxes_[i].low = low_.col(s.a).cwiseMin(low_.col(s.b)).array() - around;
    boxes_[i].high = high_.col(s.a).cwiseMax(high_.col(s.b)).array() + around;
    sets_[i] = surface.objects[s.object].self ? GridPairs::kNone : s.object;
  });
  pairs_.clear();
  if (std::any_of(surface.objects.begin(), surface.objects.end(),
                  [](const ContactObject& o) { return o.self || o.others; }))
    for (const GridPairs::Pair& p : grid_.find(boxes_, sets_, range.threads))
      if (mayMeet(surface, surface.segments[p.first], surface.segments[p.second], gap))
        pairs_.push_back(p);
  on_solids_.clear();
  solids_ = motion.solids;
  shift_.resize(solids_.size());
  turn_.resize(solids_.size());
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    shift_[k] = (motion.solids_end[k].position - solids_[k].position).norm() + margin_;
    turn_[k] = angleBetween(motion.solids_end[k], solids_[k]) + range.turn;
    findOnSolid(surface, static_cast<int>(k), solids[k], motion, range);
  }
  if (!sheets.empty())
    sheets_.build(surface, sheets, solids, motion, {gap, margin_, shift_, turn_});
  has_triangles_ = !sheets.empty();
  built_ = true;
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

void Candidates::findOnSolid(const ContactSurface& surface, int solid, const SolidPieces& pieces, const Motion& motion,
                             const Range& range)
{
  const Pose& pose = solids_[solid];
  const ContactSolid& properties = surface.solids[solid];
  const double reach = pieces.reach, corner = std::sqrt(3.0);
  for (std::size_t i = 0; i < surface.segments.size(); ++i)
  {
    const ContactSegment& s = surface.segments[i];
    const Eigen::Vector3d a = motion.x.col(s.a) - pose.position, b = motion.x.col(s.b) - pose.position;
    const double moved = std::sqrt(std::max((motion.x_end.col(s.a) - motion.x.col(s.a)).squaredNorm(),
                                            (motion.x_end.col(s.b) - motion.x.col(s.b)).squaredNorm())) +
                         corner * std::max(range.margins[s.a], range.margins[s.b]);
    const double farthest = std::sqrt(std::max(a.squaredNorm(), b.squaredNorm())), half = 0.5 * (b - a).norm();
    // how far a point of the segment may come nearer, seen from the solid
    const double slack = moved + shift_[solid] + turn_[solid] * (farthest + moved + shift_[solid]);
    const double most = range.gap + s.radius + slack;
    const Eigen::Vector3d middle = 0.5 * (a + b);
    if (middle.norm() > reach + half + most || !mayTouch(surface, s, properties))
      continue;
    const Eigen::Quaterniond to_solid = pose.orientation.conjugate();
    if (pieces.tree.empty())
    {
      if (pieceDistance(pieces.pieces[0], to_solid * middle).distance <= half + most)
        on_solids_.push_back({solid, static_cast<int>(i), 0});
      continue;
    }
    const Eigen::Vector3d za = to_solid * a, zb = to_solid * b;
    triangles_.clear();
    pieces.tree[0].query({za.cwiseMin(zb).array() - most, za.cwiseMax(zb).array() + most}, triangles_);
    for (int triangle : triangles_)
      on_solids_.push_back({solid, static_cast<int>(i), triangle});
  }
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
  for (std::size_t k = 0; k < solids.size(); ++k)
    if ((solids[k].position - solids_[k].position).norm() > shift_[k] || angleBetween(solids[k], solids_[k]) > turn_[k])
      return false;
  return true;
}

}   // namespace slender
