#include "island/island.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "slender_sim/linalg/interruption.h"

namespace slender {

// ---- what the island consists of

void Island::setParts(const std::vector<Part*>& parts)
{
  if (parts != parts_)
    versions_.clear();   // of another surface
  parts_ = parts;
  barrier_.resize(parts_.size());
  surface_changes_ = std::any_of(parts_.begin(), parts_.end(), [](const Part* part) { return part->surfaceChanges(); });
  equations_.setParts(parts_);
  if (!isExplicit(time_.integrator))
    return;
  inextensible_.clear();
  projection_ = std::make_unique<FastProjection>();
  std::copy_if(parts_.begin(), parts_.end(), std::back_inserter(inextensible_),
               [this](Part* part) { return part->addTo(*projection_); });
  if (inextensible_.empty())
    projection_.reset();
}

void Island::takeSurface()
{
  surface_.points = 0;
  surface_.segments.clear();
  surface_.triangles.clear();
  surface_.objects.clear();
  versions_.clear();
  object_.clear();
  for (Part* part : parts_)
  {
    const int object = static_cast<int>(surface_.objects.size());
    part->addSurface(surface_);
    object_.push_back(object < static_cast<int>(surface_.objects.size()) ? object : -1);
    versions_.push_back(part->surfaceVersion());
  }
}

bool Island::surfaceIsStale() const
{
  if (versions_.size() != parts_.size())
    return true;
  for (std::size_t k = 0; k < parts_.size(); ++k)
    if (parts_[k]->surfaceVersion() != versions_[k])
      return true;
  return false;
}

void Island::setContact(const std::vector<ContactSolid>& solids, const ContactOptions& options)
{
  takeSurface();
  ContactSurface surface = surface_;
  surface.solids = solids;
  for (std::size_t k = 0; k < solids.size(); ++k)
    if (const RigidPart* body = equations_.solids[k].body)
      surface.solids[k].least_stiffness = body->barrierRange(options.gap).least;
  equations_.setContact(std::move(surface), options);
  gap_ = options.gap;
}

void Island::setAttraction(SubstepPotential* attraction)
{
  attraction_ = attraction;
  equations_.setAttraction(attraction);
}

void Island::loadBarriers(double least)
{
  for (std::size_t k = 0; k < parts_.size(); ++k)
  {
    if (object_[k] < 0)
      continue;
    BarrierRange range = parts_[k]->barrierRange(gap_);
    BarrierLaw law = barrier_[k];
    if (parts_[k]->surfaceChanges())   // Barriers do not begin at the gaps of pieces that are new.
    {
      range.least = std::max(range.least, least);
      law.layers[0].stiffness =
          std::max(law.layers[0].stiffness, std::min(range.least, std::numeric_limits<double>::max()));
    }
    range.most = std::max(range.least, range.most);
    equations_.contact()->setBarrier(object_[k], law, range);
  }
}

// ---- a step

StepReport Island::step(double duration, double& first)
{
  StepReport report;
  duration_ = duration;
  double longest = duration;
  for (Part* part : parts_)
    longest = std::min(longest, part->longestSubstep(duration));
  conserving_ = conserves();
  double allowance = 0.0;
  most_energy_ = conserving_ ? energyAtStart(allowance) : 0.0;
  most_energy_ += allowance;
  SubstepRule rule;
  rule.longest = evenSubstep(duration, longest);
  rule.error_tolerance = surface_changes_ || isExplicit(time_.integrator) ? 0.0 : time_.error_tolerance;
  rule.min_step = time_.min_step;
  rule.order = order(time_.integrator);
  rule.max_cuts = time_.newton.max_cuts;
  rule.first = rule.error_tolerance > 0 ? first : 0.0;
  equations_.beginStep(duration);
  swept_.resize(parts_.size());
  for (std::size_t k = 0; k < parts_.size(); ++k)
    swept_[k] = parts_[k]->surfaceBox(0.0);
  SubstepController controller(rule);
  controller.run(*this, duration, report);
  report.linear_iterations += equations_.linearIterations();
  if (report.ok)
    first = controller.nextLength();
  return report;
}

/// Whether nothing but the step itself can change the energy. Methods without damping at infinite frequency can feed on
/// a stiff rod's stretching when it turns far in a step. Contact stores energy that is not counted.
bool Island::conserves() const
{
  return (time_.integrator == Integrator::implicit_midpoint || time_.integrator == Integrator::generalized_alpha) &&
         !equations_.contact() &&
         std::all_of(parts_.begin(), parts_.end(), [](const Part* part) { return part->conserves(); });
}

double Island::energyAtStart(double& allowance)
{
  double sum = 0.0;
  for (Part* part : parts_)
    sum += part->energyAtStart(allowance);
  return sum;
}

double Island::energyAtEnd() const
{
  double sum = 0.0;
  for (Part* part : parts_)
    sum += part->energyAtEnd();
  return sum;
}

void Island::startAccelerations()
{
  for (Part* part : parts_)
    part->addStartLoads();
  for (Part* part : parts_)
    part->solveStartAcceleration();
  for (Part* part : parts_)
    part->takeStartAcceleration();
}

/// Surfaces, barriers and attraction of a substep of h seconds. Returns false if centrelines meet.
bool Island::loadContact(double h)
{
  ContactPotential* contact = equations_.contact();
  if (!contact)
    return true;
  if (surface_changes_ || surfaceIsStale())
  {
    takeSurface();
    contact->setPieces(surface_);
    if (surface_changes_ && !contact->thinToFit(equations_.startPoints(), equations_.startSolids()))
      return false;
  }
  if (attraction_)
    attraction_->begin(equations_.startPoints(), surface_, contact->nearPairs(), gap_, h);
  loadBarriers(attraction_ ? attraction_->largestForce() : 0.0);   // not what an attempt that failed left
  contact->setSprings(springs);
  return true;
}

StepFailure Island::solveSubstep(const Substep& substep, StepReport& report)
{
  double previous = std::numeric_limits<double>::infinity();
  for (Part* part : parts_)   // a part that has lost its history makes all start anew
    previous = std::min(previous, part->lastSubstep());
  planStep(time_.integrator, time_.spectral_radius, substep.length, std::isfinite(previous) ? previous : 0.0, plan_);
  for (failed_ = 0; failed_ < parts_.size(); ++failed_)
    if (const StepFailure failure = parts_[failed_]->beginSubstep(plan_, substep); failure != StepFailure::none)
      return failure;
  failed_ = 0;
  double& least_edge = equations_.tolerances.least_edge;
  least_edge = std::numeric_limits<double>::infinity();
  for (Part* part : parts_)
    least_edge = std::min(least_edge, part->shortestEdge());
  if (plan_.needs_acceleration &&
      std::any_of(parts_.begin(), parts_.end(), [](const Part* part) { return part->startsFresh(); }))
    startAccelerations();
  equations_.beginSubstep(substep.from / duration_);
  if (!loadContact(substep.length))
  {
    const auto changed = std::find_if(parts_.begin(), parts_.end(), [](Part* part) { return part->surfaceChanges(); });
    failed_ = static_cast<std::size_t>(changed - parts_.begin());
    return StepFailure::squeezed;
  }
  for (std::size_t s = 0; s < plan_.stages.size(); ++s)
  {
    const NewtonResult newton = solveStage(s, substep);
    report.iterations += newton.iterations;
    report.factorizations += newton.factorizations;
    if (!newton.ok())
    {
      const auto hopeless = std::find_if(parts_.begin(), parts_.end(),
                                         [&](const Part* part) { return part->givesUp() == newton.failure; });
      failed_ = hopeless == parts_.end() ? farthestFromBalance() : static_cast<std::size_t>(hopeless - parts_.begin());
      return newton.failure;
    }
    report.residual = std::max(report.residual, newton.residual);
    report.max_strain = std::max(report.max_strain, newton.max_strain);
    if (ContactPotential* contact = equations_.contact())
    {
      equations_.endStage();
      if (substep.may_halve && contact->passedThrough(equations_.startPoints(), equations_.startSolids()))
        return StepFailure::passed_through;
      if (plan_.fraction == 1.0)
        contact->keepSprings(equations_.startSolids());
    }
    for (Part* part : parts_)
      part->endStage(s, s + 1 == plan_.stages.size(), report);
  }
  return StepFailure::none;
}

NewtonResult Island::solveStage(std::size_t s, const Substep& substep)
{
  const double before = s == 0 ? 0.0 : plan_.stages[s - 1].time, now = plan_.stages[s].time, h = substep.length;
  double from = (substep.from + before * h) / duration_;
  const double to = now == 1.0 ? substep.to / duration_ : (substep.from + now * h) / duration_;
  for (Part* part : parts_)
    part->beginStage(s);
  equations_.beginStage(s == 0);
  NewtonResult total = equations_.solve(from, to, time_.newton);
  while (total.ok())
  {
    bool more = false;
    for (Part* part : parts_)
      more = part->meetsMore() || more;
    if (!more)
      break;
    equations_.accept();   // the next solution begins here
    for (Part* part : parts_)
      part->holdMore();
    equations_.numberUnknowns();
    from = to;
    const NewtonResult next = equations_.solve(from, to, time_.newton);
    const int iterations = total.iterations + next.iterations,
              factorizations = total.factorizations + next.factorizations;
    const double max_strain = std::max(total.max_strain, next.max_strain);
    total = next;
    total.max_strain = max_strain;
    total.iterations = iterations;
    total.factorizations = factorizations;
  }
  return total;
}

/// The part on which the largest unbalanced force acts.
std::size_t Island::farthestFromBalance() const
{
  Largest force;
  for (std::size_t k = 0; k < parts_.size(); ++k)
    if (const Largest own = parts_[k]->unbalancedForce(); own.any())
      force.add(static_cast<int>(k), own.value());
  return force.any() ? static_cast<std::size_t>(force.index()) : 0;
}

/// Restores the lengths of inextensible parts at the end of the substep, or with `at_start` as it begins: before a
/// run's first step, whatever stretching they come with is taken out without becoming a velocity.
StepFailure Island::project(double h, bool at_start, StepReport& report)
{
  for (Part* part : parts_)
    part->giveTo(*projection_, at_start);
  const ProjectionReport result = projection_->project(h);
  report.projection_iterations = std::max(report.projection_iterations, result.iterations);
  report.constraint_error = std::max(report.constraint_error, result.constraint_error);
  if (result.ok && at_start && result.iterations == 0)
    return StepFailure::none;
  for (failed_ = 0; failed_ < parts_.size(); ++failed_)
    if (const StepFailure failure = parts_[failed_]->takeFrom(*projection_, result, at_start);
        failure != StepFailure::none)
      return failure;
  failed_ = 0;
  return StepFailure::none;
}

/// Forces at the start, velocities and positions, projection of inextensible parts and of the bodies that carry them.
StepFailure Island::stepExplicitly(const Substep& substep, StepReport& report)
{
  if (std::any_of(inextensible_.begin(), inextensible_.end(),
                  [](const Part* part) { return part->lastSubstep() == 0.0; }))
    if (const StepFailure failure = project(substep.length, true, report); failure != StepFailure::none)
      return failure;
  for (failed_ = parts_.size(); failed_-- > 0;)   // bodies come last: rods act on them
    if (const StepFailure failure = parts_[failed_]->predict(substep, report); failure != StepFailure::none)
      return failure;
  return projection_ ? project(substep.length, false, report) : StepFailure::none;
}

StepFailure Island::attempt(const Substep& substep, StepReport& report)
{
  const StepFailure solved =
      isExplicit(time_.integrator) ? stepExplicitly(substep, report) : solveSubstep(substep, report);
  if (solved != StepFailure::none)
    return solved;
  if (conserving_ && energyAtEnd() > most_energy_)
    return StepFailure::energy_grew;
  if (ContactPotential* contact = equations_.contact())
    contact->adaptStiffness(keeps_barriers_ ? 0.0 : substep.length);
  for (failed_ = 0; failed_ < parts_.size(); ++failed_)
    if (const StepFailure failure = parts_[failed_]->finishSubstep(report); failure != StepFailure::none)
      return failure;
  for (failed_ = 0; failed_ < parts_.size(); ++failed_)
    if (const StepFailure failure = parts_[failed_]->changeMesh(); failure != StepFailure::none)
      return failure;
  failed_ = 0;
  return StepFailure::none;
}

void Island::accept(const Substep& substep)
{
  for (std::size_t k = 0; k < parts_.size(); ++k)
  {
    parts_[k]->acceptSubstep(substep);
    swept_[k].include(parts_[k]->surfaceBox(0.0));
  }
  const ContactPotential* contact = equations_.contact();
  if (!contact)
    return;
  for (std::size_t k = 0; k < parts_.size(); ++k)
    if (object_[k] >= 0)
      barrier_[k] = contact->barrier(object_[k]);
  springs = contact->springs();
}

bool Island::shorterMayHelp(StepFailure failure) const
{
  if (failure == StepFailure::passed_through)
    return true;
  return !isExplicit(time_.integrator) && (failed_ >= parts_.size() || parts_[failed_]->shorterMayHelp(failure));
}

/// Takes out a fold of the part that is folded most. A part that is merely bent may fail only because of it.
bool Island::mend(StepReport& report)
{
  constexpr int kMostFolds = 20;   // in one step
  if (report.mended_folds >= kMostFolds)
    return false;
  folded_.clear();
  for (Part* part : parts_)
    if (const double fold = part->sharpestFold(); fold < 1.0)
      folded_.emplace_back(fold, part);
  std::stable_sort(folded_.begin(), folded_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [fold, part] : folded_)
    if (part->mend())
    {
      ++report.mended_folds;
      return true;
    }
  return false;
}

void Island::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  if (failure == StepFailure::interrupted)
    report.refuse(failure, kStepInterrupted);
  else
    parts_[std::min(failed_, parts_.size() - 1)]->refuse(failure, substep.length, report);
}

}   // namespace slender
