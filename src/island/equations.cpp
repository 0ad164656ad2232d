// Several parts and their contact as one system for Newton's method: what it consists of, and its measures.
#include "island/equations.h"

#include <algorithm>
#include <cmath>

#include "island/equations_loops.h"

namespace slender {

namespace {

/// Largest motion of contacts that stick at which a solution may end, of the range in which friction sticks. The
/// increment after it is far smaller.
constexpr double kStick = 0.3;

}   // namespace

// ---- what the island consists of

void Equations::setParts(const std::vector<Part*>& parts)
{
  parts_valid_ = parts_valid_ && parts == parts_;
  parts_ = parts;
}

void Equations::setContact(ContactSurface surface, const ContactOptions& options)
{
  contact_ = std::make_unique<ContactPotential>(std::move(surface), options);
  contact_->setThreads(threads_);
  for (auto* poses : {&prescribed_, &poses_, &poses_base_, &poses_end_})
    poses->resize(solids.size());
}

void Equations::setThreads(int threads)
{
  threads_ = threads;
  matrix_.setThreads(threads);
  if (contact_)
    contact_->setThreads(threads);
}

void Equations::countPoints()
{
  part_of_point_.clear();
  shares_.of_point.clear();
  for (Part* part : parts_)
  {
    part->first_point = static_cast<int>(part_of_point_.size());
    part_of_point_.insert(part_of_point_.end(), static_cast<std::size_t>(part->points()), part);
    shares_.of_point.insert(shares_.of_point.end(), static_cast<std::size_t>(part->points()), part->number);
  }
  shares_.of_solid.clear();
  for (const IslandSolid& solid : solids)
    shares_.of_solid.push_back(solid.body     ? solid.body->number
                               : moves(solid) ? MotionShares::kPrescribed
                                              : MotionShares::kFixed);
  const auto count = static_cast<Eigen::Index>(part_of_point_.size());
  for (auto* x : {&points_, &points_base_, &points_end_})
    if (x->cols() != count)
      x->resize(3, count);
  for (auto* turns : {&turns_begin_, &turns_base_, &turns_})
    turns->setZero(count);
}

void Equations::numberUnknowns()
{
  unsettle();
  for (Part* part : parts_)
    parts_valid_ = part->numberUnknowns() && parts_valid_;
}

// ---- configurations

void Equations::placeSolids(double fraction, std::vector<Pose>& poses) const
{
  for (std::size_t k = 0; k < solids.size(); ++k)
    if (const IslandSolid& s = solids[k]; !s.body)
      poses[k] = poseBetween(s.start, s.start_velocity, s.target, duration_, fraction, nullptr) * s.X_BS;
}

/// Settled parts are where they were in the last evaluation.
void Equations::gather(Eigen::Matrix3Xd& x, std::vector<Pose>& poses) const
{
  forAllParts([&](const Part& part) {
    if (!part.settled)
      part.gather(x);
    else if (&x != &points_)
      x.middleCols(part.first_point, part.points()) = points_.middleCols(part.first_point, part.points());
  });
  gatherSolids(poses);
}

void Equations::gatherSolids(std::vector<Pose>& poses) const
{
  for (std::size_t k = 0; k < solids.size(); ++k)
    poses[k] = solids[k].body ? solids[k].body->pose() * solids[k].X_BS : prescribed_[k];
}

void Equations::place(double fraction)
{
  unsettle();
  if (contact_)
    placeSolids(fraction, prescribed_);
  for (Part* part : parts_)
    part->placeHeld(fraction);
  follow();
}

/// Moves in the trial what depends on the motion of other parts, then restores the prescribed averages.
void Equations::follow()
{
  for (Part* part : parts_)
    part->followJoints();
  for (Part* part : parts_)
    if (!part->settled)
      part->meetAverages();
}

void Equations::unsettle()
{
  for (Part* part : parts_)
  {
    part->settled = false;
    part->has_direction = true;
    part->increment = kInfinity;
  }
}

/// Groups of parts settle if their last increments were full ones of Newton's method and within the tolerance at which
/// a solution ends, because the next increments would be far smaller. Threads never settle: small increments do not
/// tell that their forces are balanced.
void Equations::settle()
{
  if (moved_fully_ && by_newton_ && !std::isfinite(tolerances.most_unbalanced))
  {
    // Sweeps solve for all coupled parts together.
    const bool together = matrix_.solver() == SharedMatrix::Solver::sweeps;
    group_moves_.assign(parts_.size(), false);
    for (const Part* part : parts_)
      if (!part->settled && ((together && part->coupled) || !hasArrived(*part)))
        group_moves_[groups_.of(part->number)] = true;
    forParts([&](Part& part) {
      if (group_moves_[groups_.of(part.number)])
        return;
      part.settled = true;
      part.moveAlong(0.0);   // makes the trial complete, which remains the one that others see
      part.evaluate(false, {});
    });
  }
  for (Part* part : parts_)
    part->increment = kInfinity;
}

/// Returns whether the part has converged. It settles when its group has.
bool Equations::hasArrived(const Part& part) const
{
  return part.increment <= arrived_ && (part.coupled || part.evaluation.inertia.positiveDefinite()) &&
         shares_.of(part.number) == 1.0 && part.moved_sticking <= kStick &&
         part.moved_at_contact <= kFineGap * contact_->smallestGap();
}

/// The parts of these points move on.
void Equations::wake(const std::vector<int>& points)
{
  for (const int point : points)
  {
    partOf(point).settled = false;
    partOf(point).increment = kInfinity;   // The last direction does not know what has changed.
  }
}

/// All parts of a group move as long as one of them does.
void Equations::wakeGroups()
{
  group_moves_.assign(parts_.size(), false);
  for (const Part* part : parts_)
    if (!part->settled)
      group_moves_[groups_.of(part->number)] = true;
  for (Part* part : parts_)
    part->settled = part->settled && !group_moves_[groups_.of(part->number)];
}

void Equations::setExact(bool exact)
{
  exact_ = exact;
  unsettle();
}

/// Takes over the present normal forces for friction. Groups in which they have changed move on.
double Equations::lagFriction()
{
  const double change = contact_->lagFriction();
  wake(contact_->pointsOfChanges());
  return change;
}

/// Makes barriers stiffer where they have to be.
bool Equations::stiffen(bool converged)
{
  const bool changed = contact_->stiffen(converged);
  if (changed)
    unsettle();
  return changed;
}

// ---- a step

void Equations::beginSubstep(double fraction)
{
  exact_ = pushing_ = false;
  for (std::size_t k = 0; k < parts_.size(); ++k)   // another island has numbered them differently
    parts_[k]->number = static_cast<int>(k);
  shares_.begin(static_cast<int>(parts_.size()), false);
  least_share_ = 1.0;
  for (Part* part : parts_)
  {
    parts_valid_ = parts_valid_ && part->island == this;   // another island has numbered its unknowns
    part->island = this;
  }
  numberUnknowns();
  if (!contact_)
    return;
  countPoints();
  placeSolids(fraction, prescribed_);
  for (const Part* part : parts_)
    part->gatherStart(points_base_);
  gatherSolids(poses_base_);
}

void Equations::beginStage(bool first)
{
  unsettle();
  if (!contact_)
    return;
  matrix_.beginStage();
  // Friction sticks below a speed over the whole step. In substeps that range would become too narrow to find.
  contact_->begin(points_base_, poses_base_, frictionTime());
  turns_begin_ = turns_base_;
  if (!first)
    return;
  if (attraction_)
    attraction_->evaluate(points_base_, false);
  takeFirst();
}

NewtonResult Equations::solve(double from, double to, const NewtonConfig& newton)
{
  if (!contact_)
    return minimize(*this, newton);
  placeSolids(to, prescribed_);
  gather(points_end_, poses_end_);
  contact_->letPass(points_base_, poses_base_, points_end_, poses_end_);
  const double gap = contact_->options().gap / tolerances.least_edge;
  arrived_ = fineTolerance(newton, gap);
  NewtonResult result = minimizeConfined(*this, from, to, newton, gap);
  if (std::any_of(parts_.begin(), parts_.end(), [](const Part* part) { return part->settled && !isAlone(*part); }))
  {
    // The gradients of settled parts lack what others exert on them.
    unsettle();
    evaluateParts(false, {});
    const double scale = forceScale();
    result.residual = scale > 0.0 ? residual() / scale : 0.0;
  }
  return result;
}

void Equations::endStage()
{
  points_base_ = points_;
  poses_base_ = poses_;
  turns_base_ = turns_begin_ + turns_;
}

/// `alpha` is how far those parts go of which stepLimit() found the least share. All others go farther in proportion.
void Equations::moveAlong(double alpha)
{
  const double most = alpha > 0.0 && least_share_ < 1.0 ? std::min(1.0, alpha / least_share_) : alpha;
  moved_fully_ = most == 1.0;
  forParts([&](Part& part) {
    if (part.has_direction)
      part.moveAlong(least_share_ < 1.0 ? most * shares_.of(part.number) : most);
  });
  follow();
}

void Equations::accept()
{
  forParts([](Part& part) { part.accept(); });
  least_share_ = 1.0;   // The direction is used up.
  if (!contact_)
    return;
  settle();
  endStage();
}

void Equations::saveBase()
{
  forAllParts([](Part& part) { part.saveBase(); });
}

void Equations::restoreBase()
{
  unsettle();
  for (Part* part : parts_)
    part->restoreBase();
}

// ---- measures

double Equations::stepLimit()
{
  double alpha = 1.0;
  for (const Part* part : parts_)
    if (!part->settled)
      alpha = std::min(alpha, part->stepLimit());
  if (!contact_)
    return alpha;
  moveAlong(alpha);
  shares_.begin(static_cast<int>(parts_.size()), false);
  limitShares();
  least_share_ = shares_.least();
  return alpha * least_share_;
}

double Equations::incrementSize()
{
  double largest = 0.0, at_contact = 0.0;
  for (Part* part : parts_)
    if (!part->settled)
    {
      part->increment = part->incrementSize(tolerances.least_edge);
      largest = std::max(largest, part->increment);
      at_contact = std::max(at_contact, part->moved_at_contact);
    }
  if (!contact_)
    return largest;
  // A barrier is resolved when its gaps are, and friction that sticks when the stretch of its springs is.
  if (at_contact > 0.0)
    largest = std::max(largest, tolerance_ * at_contact / (gap_tolerance_ * contact_->smallestGap()));
  return std::max(largest, tolerance_ * moved_sticking_ / kStick);
}

/// Returns whether friction that sticks would hardly move in the next iteration, if increments shrink by this rate.
/// What it moves in each step adds up to a creep.
bool Equations::sticksAfter(double rate) const
{
  constexpr double kHardly = 1e-3;   // of the range in which friction sticks
  return rate * moved_sticking_ <= kHardly;
}

/// Measures how far the direction moves touching surfaces relative to each other. Unless that is far, friction follows.
/// With a shift of positions the direction is not that of Newton's method, so that it does not predict forces.
void Equations::measureContacts()
{
  moves_.clear();
  moved_sticking_ = 0.0;
  for (Part* part : parts_)
    part->moved_at_contact = part->moved_sticking = 0.0;
  for (const ContactTerm& term : contact_->terms())
  {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    Part& first = partOf(term.point[0]);
    if (first.settled)
    {
      moves_.push_back(u);
      continue;
    }
    for (int p = 0; p < 4 && !term.carried; ++p)
      if (term.point[p] >= 0)
        u += term.moveBy(p, partOf(term.point[p]).move(term.point[p] - partOf(term.point[p]).first_point));
    if (term.carried)
      u = carrierOf(term).moveAt(term.position);
    if (const RigidPart* body = bodyOf(term.solid))
      u -= body->moveAt(term.position);
    forTurns(term, [&](Part& part, int point, const Eigen::Vector3d& column) { u += part.moveTurn(point) * column; });
    moves_.push_back(u);
    first.moved_at_contact = std::max(first.moved_at_contact, u.norm());
    if (term.slip_range > 0.0)
      first.moved_sticking = std::max(first.moved_sticking, u.norm() / term.slip_range);
    moved_sticking_ = std::max(moved_sticking_, first.moved_sticking);
  }
  if (shift_.position == 0.0)
    contact_->followFriction(moves_);
  else
    contact_->stopFollowing();
}

double Equations::slope() const
{
  double sum = 0.0;
  for (const Part* part : parts_)
    if (!part->settled)
      sum += part->slope();
  return sum;
}

double Equations::residual() const
{
  double largest = 0.0;
  for (const Part* part : parts_)
    if (!part->settled)
      largest = std::max(largest, part->residual());
  return largest;
}

double Equations::forceScale() const
{
  double largest = 0.0;
  for (const Part* part : parts_)
    largest = std::max(largest, part->forceScale());
  forTerms([&](const ContactTerm& term) { largest = std::max(largest, term.force.norm()); });
  return largest;
}

StepFailure Equations::givesUp() const
{
  for (const Part* part : parts_)
    if (const StepFailure why = part->givesUp(); why != StepFailure::none)
      return why;
  return StepFailure::none;
}

double Equations::noiseLevel() const
{
  double largest = 0.0;
  for (const Part* part : parts_)
    largest = std::max(largest, part->noiseLevel());
  return largest;
}

}   // namespace slender
