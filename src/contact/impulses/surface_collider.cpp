#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "surface_collider.h"
#include "slender_sim/linalg/interruption.h"

namespace slender {

namespace {

constexpr double kKept = 0.2;     // share of a gap that no collision may go below
constexpr double kTarget = 0.5;   // share of the gap that impulses leave
constexpr double kNear = 2.0;     // shells, up to where places of contact at the start tell those at the end
constexpr int kColliderSweeps = 25;
constexpr int kImpulseRounds = 12;
constexpr long kLimitWork = 8;   // of a WorkBudget: when a pair meets

}   // namespace

bool SurfaceCollider::fail(const std::string& reason, int first, int second)
{
  report_.ok = false;
  report_.reason = reason;
  report_.points[0] = first, report_.points[1] = second;
  return false;
}

/// What was found so far is not all there is.
bool SurfaceCollider::failSpent()
{
  known_ = false;
  report_.spent = true;
  return fail("more work than a step is given");
}

bool SurfaceCollider::load(const CollisionStep& step, const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& v, bool again)
{
  const int n = elements_.sheet_points;
  const std::size_t solids = elements_.objects.size() - elements_.sheet_count;
  if (step.x_start.cols() != n || x.cols() != n || v.cols() != n || step.inverse_mass.size() != n)
    throw std::invalid_argument("collisions: " + std::to_string(n) + " points expected");
  if (step.solids.size() != solids || step.solids_end.size() != solids)
    throw std::invalid_argument("collisions: poses of " + std::to_string(solids) + " solids expected");
  if (!(step.h > 0.0) || !(step.inverse_mass.minCoeff() >= 0.0))
    throw std::invalid_argument("collisions: the step must be positive, inverse masses not negative");
  known_ = known_ && again;
  step_ = &step;
  budget_ = step.budget ? step.budget : &unbounded_;
  report_ = CollisionReport();
  from_.leftCols(n) = step.x_start;
  to_.leftCols(n) = x;
  velocity_.leftCols(n) = v;
  elements_.place(step.solids, from_);
  elements_.place(step.solids_end, to_);
  const Eigen::Index rest = from_.cols() - n;
  velocity_.rightCols(rest) = (to_.rightCols(rest) - from_.rightCols(rest)) / step.h;
  inverse_mass_.head(n) = step.inverse_mass;
  if (!from_.allFinite() || !to_.allFinite() || !velocity_.allFinite())
    return fail("a position or velocity is not finite");
  rows_.clear(static_cast<int>(from_.cols()));
  zones_.clear(static_cast<int>(from_.cols()), static_cast<int>(solids));
  return true;
}

/// Distance from which a pair repels: less than the shells where pieces of a sheet are close to each other at rest.
double SurfaceCollider::reach(const CollisionPair& pair) const
{
  const double shell = pairs_.shell(pair);
  return pairs_.object(pair, false) != pairs_.object(pair, true)
             ? shell
             : std::min(shell, 0.5 * pairs_.place(pair, elements_.reference).distance);
}

/// Appends a row of a pair that meets at this place. Its bound is set by the caller.
CollisionRow& SurfaceCollider::addRow(const CollisionPair& pair, const PairPlace& place)
{
  CollisionRow row{};
  row.normal = place.normal;
  row.anchor.setZero();
  for (int i = 0; i < 4; ++i)
  {
    row.point[i] = place.point[i];
    row.weight[i] = place.weight[i];
    row.anchor += place.weight[i] * from_.col(place.point[i]);
  }
  row.friction = elements_.friction(pairs_.object(pair, false), pairs_.object(pair, true));
  rows_.rows.push_back(row);
  return rows_.rows.back();
}

void SurfaceCollider::repel(const CollisionPair& pair, const PairPlace& place, double range)
{
  CollisionRow& row = addRow(pair, place);
  row.push = push_ * std::max(0.0, range - pair.gap);
  row.bound = pairs_.core(pair) + std::min(pair.gap, range) + row.push;
  row.tolerance = 0.02 * std::min(pair.gap, range);
  ++report_.repulsions;
}

/// Finds all pairs that may come near each other; those within their shells, or near them and about to enter, get
/// repulsions.
bool SurfaceCollider::examineStart()
{
  const std::vector<CollisionPair>& pairs =
      known_ ? pairs_.update(from_, to_, *budget_) : pairs_.find(from_, to_, *budget_);
  known_ = budget_->spend(static_cast<long>(pairs.size()));
  if (!known_)
    return failSpent();
  for (const CollisionPair& pair : pairs)
  {
    if (!(pair.gap > 0.0))
      return failAtStart("surfaces meet at the start of the step", pair.point[0], pair.point[3]);
    if (pair.gap >= kNear * pairs_.shell(pair))
      continue;
    const double range = reach(pair);
    if (pair.gap >= kNear * range)
      continue;
    const PairPlace place = pairs_.place(pair, from_);
    const bool lone = pair.edges && (elements_.edges[pair.first].lone || elements_.edges[pair.second].lone);
    // Other places of two edges are a vertex's, too. Beyond the shells a tilted normal would stop what only passes by.
    if (!place.inside && (pair.gap >= range || (pair.edges && !lone)))
      continue;
    double end = 0.0;
    for (int i = 0; i < 4; ++i)
      end += place.weight[i] * place.normal.dot(to_.col(place.point[i]));
    if (std::min(pair.gap, end - pairs_.core(pair)) < range)
      repel(pair, place, range);
  }
  return true;
}

double SurfaceCollider::planeGap(int plane, const std::vector<Pose>& poses, const Eigen::Vector3d& x) const
{
  const Pose& pose = poses[elements_.planes[plane] - elements_.sheet_count];
  return (pose.orientation * Eigen::Vector3d::UnitZ()).dot(x - pose.position);
}

/// Whether a point comes too near a plane whose origin and normal go along straight lines: the gap is quadratic in
/// time.
bool SurfaceCollider::planeHit(int point, int plane) const
{
  const int solid = elements_.planes[plane] - elements_.sheet_count;
  const Pose &p0 = step_->solids[solid], &p1 = step_->solids_end[solid];
  const Eigen::Vector3d n0 = p0.orientation * Eigen::Vector3d::UnitZ(), n1 = p1.orientation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d r0 = from_.col(point) - p0.position, r1 = to_.col(point) - p1.position;
  const double start = n0.dot(r0), end = n1.dot(r1),
               goal = kKept * std::min(start, elements_.objects[elements_.point_object[point]].shell);
  const double square = (n1 - n0).dot(r1 - r0), slope = end - start - square;
  double least = std::min(start, end);
  if (square > 0.0 && slope < 0.0 && -slope < 2.0 * square)
    least = start - 0.25 * slope * slope / square;
  return !(least > goal);
}

void SurfaceCollider::addPlaneRow(int point, int plane, double gap, bool hit)
{
  const int object = elements_.planes[plane], solid = object - elements_.sheet_count,
            sheet = elements_.point_object[point];
  const Pose& end = step_->solids_end[solid];
  const double shell = elements_.objects[sheet].shell;
  CollisionRow row{};
  std::fill(row.point, row.point + 4, point);
  row.weight[0] = 1.0;
  row.normal = end.orientation * Eigen::Vector3d::UnitZ();
  row.anchor = end * (step_->solids[solid].inverse() * Eigen::Vector3d(from_.col(point)));
  row.push = hit ? 0.0 : push_ * std::max(0.0, shell - gap);
  row.bound = row.normal.dot(end.position) + (hit ? kTarget : 1.0) * std::min(gap, shell) + row.push;
  row.tolerance = 0.02 * std::min(gap, shell);
  row.friction = elements_.friction(sheet, object);
  rows_.rows.push_back(row);
  ++(hit ? report_.impulses : report_.repulsions);
}

bool SurfaceCollider::examinePlanes()
{
  for (std::size_t plane = 0; plane < elements_.planes.size(); ++plane)
    for (int i = 0; i < elements_.sheet_points; ++i)
    {
      const int sheet = elements_.point_object[i];
      if (sheet < 0 || !elements_.mayTouch(sheet, elements_.planes[plane]))
        continue;
      const double gap = planeGap(static_cast<int>(plane), step_->solids, from_.col(i));
      if (!(gap > 0.0))
        return failAtStart("a plane is passed through at the start of the step", i);
      const double shell = elements_.objects[sheet].shell;
      if (gap < kNear * shell &&
          std::min(gap, planeGap(static_cast<int>(plane), step_->solids_end, to_.col(i))) < shell)
        addPlaneRow(i, static_cast<int>(plane), gap, false);
    }
  return true;
}

/// Fills hits_ and plane_hits_: all collisions along the present motions. After the first time only pairs whose motion
/// has changed need a look.
void SurfaceCollider::detect()
{
  const bool first = report_.rounds++ == 0;
  for (Eigen::Index i = 0; i < to_.cols(); ++i)
    changed_[i] = first || to_(0, i) != tested_(0, i) || to_(1, i) != tested_(1, i) || to_(2, i) != tested_(2, i);
  const auto changed = [&](const CollisionPair& p) {
    return changed_[p.point[0]] | changed_[p.point[1]] | changed_[p.point[2]] | changed_[p.point[3]];
  };
  hits_.erase(std::remove_if(hits_.begin(), hits_.end(), changed), hits_.end());
  const std::vector<CollisionPair>& pairs = pairs_.update(from_, to_, *budget_);
  budget_->spend(static_cast<long>(pairs.size() / 8) + to_.cols());
  for (const CollisionPair& pair : pairs)
    if (changed(pair) && !CollisionPairs::separated(pair, to_))
    {
      if (!budget_->spend(kLimitWork))
        break;
      if (pairs_.limit(pair, from_, to_, limitOf(pair)) < 1.0)
        hits_.push_back(pair);
    }
  std::sort(hits_.begin(), hits_.end(), [](const CollisionPair& a, const CollisionPair& b) {
    return std::tie(a.edges, a.first, a.second) < std::tie(b.edges, b.first, b.second);
  });
  plane_hits_.clear();
  for (std::size_t plane = 0; plane < elements_.planes.size(); ++plane)
    for (int i = 0; i < elements_.sheet_points; ++i)
      if (const int sheet = elements_.point_object[i];
          sheet >= 0 && elements_.mayTouch(sheet, elements_.planes[plane]) && planeHit(i, static_cast<int>(plane)))
        plane_hits_.push_back({i, static_cast<int>(plane)});
  tested_ = to_;
}

ApproachLimit SurfaceCollider::limitOf(const CollisionPair& pair) const
{
  ApproachLimit limit;
  limit.thickness = pairs_.core(pair);
  limit.reach = pairs_.shell(pair);
  limit.kept = kKept;
  return limit;
}

/// The end of the step has to stay on this side, seen where the pieces come too near each other.
void SurfaceCollider::stop(const CollisionPair& pair)
{
  const ApproachLimit limit = limitOf(pair);
  const double share = pairs_.limit(pair, from_, to_, limit), gap = std::min(pair.gap, limit.reach);
  CollisionRow& row = addRow(pair, pairs_.place(pair, from_, to_, share));
  row.bound = limit.thickness + kTarget * gap;
  row.tolerance = 0.02 * gap;
  ++report_.impulses;
}

/// Velocities at the end do not approach where pieces touch then, with friction.
void SurfaceCollider::solveVelocities()
{
  const double h = step_->h;
  auto& rows = rows_.rows;
  for (CollisionRow& row : rows)
  {
    Eigen::Vector3d start = Eigen::Vector3d::Zero(), end = Eigen::Vector3d::Zero();
    for (int i = 0; i < 4; ++i)
    {
      start += row.weight[i] * from_.col(row.point[i]);
      end += row.weight[i] * to_.col(row.point[i]);
    }
    row.anchor = (row.anchor - start) / h;   // zero, or the velocity of a plane
    row.bound = row.normal.dot(row.anchor);
    row.tolerance /= h;
  }
  rows_.restart(inverse_mass_, 1.0 / h, velocity_);
  rows_.relax(inverse_mass_, kColliderSweeps, velocity_, *budget_);
  takeHeldImpulses();
  if (zones_.empty())
    return;
  for (const ImpactZones::Zone& zone : zones_.zones(inverse_mass_))
  {
    ++report_.zones;
    report_.zone_points = std::max(report_.zone_points, zone.count);
    if (zone.count == 0)
      continue;
    const bool free = zone.prescribed_count == 0;
    const RigidFit fit = rigidFit(zone.members, zone.count, inverse_mass_, to_, velocity_);
    Eigen::Vector3d gained = Eigen::Vector3d::Zero();
    for (int k = 0; k < zone.count; ++k)
    {
      const int i = zone.members[k];
      const Eigen::Vector3d v = free ? fit.rate(to_.col(i)) : Eigen::Vector3d((to_.col(i) - from_.col(i)) / h);
      gained += (v - velocity_.col(i)) / inverse_mass_[i];
      velocity_.col(i) = v;
    }
    if (!free && zone.prescribed[zone.prescribed_count - 1] < elements_.sheet_points)   // bodies come last
      for (int k = 0; k < zone.prescribed_count; ++k)
        held_impulses_.col(zone.prescribed[k]) -= gained / zone.prescribed_count;
  }
}

void SurfaceCollider::takeHeldImpulses()
{
  held_impulses_.setZero(3, elements_.sheet_points);
  for (const CollisionRow& row : rows_.rows)
    for (int i = 0; i < 4; ++i)
      if (const int p = row.point[i]; row.mobility > 0.0 && p < elements_.sheet_points && inverse_mass_[p] == 0.0)
        held_impulses_.col(p) += row.weight[i] * (row.impulse * row.normal + row.rubbing);
}

void SurfaceCollider::addHits()
{
  for (const CollisionPair& pair : hits_)
    stop(pair);
  for (const PlaneHit& hit : plane_hits_)
    addPlaneRow(hit.point, hit.plane, planeGap(hit.plane, step_->solids, from_.col(hit.point)), true);
}

bool SurfaceCollider::approach(const CollisionStep& step, Eigen::Matrix3Xd& x, bool again)
{
  push_ = 0.0;   // which moves pieces apart but causes no velocity
  const bool fine = load(step, x, step.x_start, again) && examineStart() && examinePlanes();
  push_ = kPush;
  hits_.clear();
  if (!fine)
    return false;
  rows_.relax(inverse_mass_, kColliderSweeps, to_, *budget_);
  detect();
  if (!(hits_.empty() && plane_hits_.empty()))
  {
    addHits();
    rows_.relax(inverse_mass_, kColliderSweeps, to_, *budget_);
  }
  x = to_.leftCols(elements_.sheet_points);
  return !budget_->spent() || failSpent();
}

CollisionReport SurfaceCollider::resolve(const CollisionStep& step, Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& v,
                                         bool again)
{
  if (!load(step, x, v, again) || !examineStart() || !examinePlanes())
    return report_;
  hits_.clear();
  rows_.relax(inverse_mass_, kColliderSweeps, to_, *budget_);
  detect();
  while (!(hits_.empty() && plane_hits_.empty()) && report_.rounds <= kImpulseRounds && !budget_->spent() &&
         !stepsInterrupted())
  {
    addHits();
    rows_.relax(inverse_mass_, kColliderSweeps, to_, *budget_);
    detect();
  }
  displacement_ = to_ - from_;
  while (!budget_->spent() && !stepsInterrupted() && joinHits())
  {
    if (!moveZones())
      return report_;
    detect();
  }
  if (!budget_->spent())
    solveVelocities();
  if (budget_->spent())   // with something left out
  {
    failSpent();
    return report_;
  }
  x = to_.leftCols(elements_.sheet_points);
  v = velocity_.leftCols(elements_.sheet_points);
  return report_;
}

}   // namespace slender
