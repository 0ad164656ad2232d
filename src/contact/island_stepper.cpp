#include "island_stepper.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/linalg/interruption.h"

namespace slender {

// ---- what the island consists of

void IslandStepper::setMembers(const std::vector<Member>& members)
{
  members_ = members;
  parts_.clear();
  surface_changes_ = false;
  for (const Member& member : members_)
  {
    parts_.push_back(member.part);
    surface_changes_ = surface_changes_ || member.steps->surfaceChanges();
  }
  island_.setParts(parts_);
}

void IslandStepper::takeSurface()
{
  surface_.points = 0;
  surface_.segments.clear();
  surface_.triangles.clear();
  surface_.objects.clear();
  versions_.clear();
  for (const Member& member : members_)
  {
    member.steps->addSurface(surface_);
    versions_.push_back(member.steps->surfaceVersion());
  }
}

bool IslandStepper::surfaceIsStale() const
{
  for (std::size_t k = 0; k < members_.size(); ++k)
    if (members_[k].steps->surfaceVersion() != versions_[k])
      return true;
  return false;
}

void IslandStepper::setContact(const std::vector<ContactSolid>& solids, const ContactOptions& options)
{
  takeSurface();
  ContactSurface surface = surface_;
  surface.solids = solids;
  ContactOptions own = options;
  if (!surface_changes_)
    for (const Member& member : members_)
      own.least_stiffness = std::max(own.least_stiffness, member.steps->barrierRange(options.gap).least);
  island_.setContact(std::move(surface), own);
  gap_ = options.gap;
  first_stiffness_ = island_.contact()->stiffness();
}

void IslandStepper::setAttraction(SubstepPotential* attraction)
{
  attraction_ = attraction;
  island_.setAttraction(attraction);
}

void IslandStepper::setStiffness(double stiffness) { stiffness_ = stiffness > 0.0 ? stiffness : first_stiffness_; }

// ---- a step

StepReport IslandStepper::step(double duration, double& first)
{
  StepReport report;
  duration_ = duration;
  double longest = duration;
  for (const Member& member : members_)
    longest = std::min(longest, member.steps->longestSubstep(duration));
  conserving_ = conserves();
  double allowance = 0.0;
  most_energy_ = conserving_ ? energyAtStart(allowance) : 0.0;
  most_energy_ += allowance;
  SubstepRule rule;
  rule.longest = evenSubstep(duration, longest);
  rule.error_tolerance = surface_changes_ ? 0.0 : time_.error_tolerance;
  rule.min_step = time_.min_step;
  rule.order = order(time_.integrator);
  rule.max_cuts = time_.newton.max_cuts;
  rule.first = rule.error_tolerance > 0 ? first : 0.0;
  island_.beginStep(duration);
  swept_.resize(members_.size());
  for (std::size_t k = 0; k < members_.size(); ++k)
    swept_[k] = members_[k].steps->surfaceBox(0.0);
  SubstepController controller(rule);
  controller.run(*this, duration, report);
  report.linear_iterations += island_.linearIterations();
  if (report.ok)
    first = controller.nextLength();
  return report;
}

/// Whether nothing but the step itself can change the energy. Methods without damping at infinite frequency can feed on
/// a stiff rod's stretching when it turns far in a step. Contact stores energy that is not counted.
bool IslandStepper::conserves() const
{
  return (time_.integrator == Integrator::implicit_midpoint || time_.integrator == Integrator::generalized_alpha) &&
         !island_.contact() &&
         std::all_of(members_.begin(), members_.end(), [](const Member& m) { return m.steps->conserves(); });
}

double IslandStepper::energyAtStart(double& allowance)
{
  double sum = 0.0;
  for (const Member& member : members_)
    sum += member.steps->energyAtStart(allowance);
  return sum;
}

double IslandStepper::energyAtEnd() const
{
  double sum = 0.0;
  for (const Member& member : members_)
    sum += member.steps->energyAtEnd();
  return sum;
}

void IslandStepper::startAccelerations()
{
  for (const Member& member : members_)
    member.steps->addStartLoads();
  for (const Member& member : members_)
    member.steps->solveStartAcceleration();
  for (const Member& member : members_)
    member.steps->takeStartAcceleration();
}

/// Surfaces, stiffness and attraction of a substep of h seconds. Returns false if centrelines meet.
bool IslandStepper::loadContact(double h)
{
  ContactPotential* contact = island_.contact();
  if (!contact)
    return true;
  BarrierRange range{stiffness_, 0.0};   // not what an attempt that failed left
  if (!surface_changes_)
    range.most = std::numeric_limits<double>::infinity();
  for (const Member& member : members_)
  {
    const BarrierRange own = member.steps->barrierRange(gap_);
    range.least = std::max(range.least, surface_changes_ ? own.least : 0.0);
    range.most = std::max(range.most, own.most);
  }
  if (surface_changes_ || surfaceIsStale())
  {
    takeSurface();
    contact->setPieces(surface_);
    if (surface_changes_ && !contact->thinToFit(island_.startPoints(), island_.startSolids()))
      return false;
  }
  if (attraction_)
  {
    attraction_->begin(island_.startPoints(), surface_, contact->nearPairs(), gap_, h);
    range.least = std::max(range.least, attraction_->largestForce());
  }
  // of loads that overflow: what they do to the parts says why
  constexpr double kLargest = std::numeric_limits<double>::max();
  contact->setMostStiffness(std::min(std::max(range.most, range.least), kLargest));
  contact->setStiffness(std::min(range.least, kLargest));
  return true;
}

StepFailure IslandStepper::solveSubstep(const Substep& substep, StepReport& report)
{
  double previous = std::numeric_limits<double>::infinity();
  for (const Member& member : members_)   // a part that has lost its history makes all start anew
    previous = std::min(previous, member.steps->lastSubstep());
  planStep(time_.integrator, time_.spectral_radius, substep.length, std::isfinite(previous) ? previous : 0.0, plan_);
  for (failed_ = 0; failed_ < members_.size(); ++failed_)
    if (const StepFailure failure = members_[failed_].steps->beginSubstep(plan_, substep); failure != StepFailure::none)
      return failure;
  failed_ = 0;
  double& least_edge = island_.tolerances.least_edge;
  least_edge = std::numeric_limits<double>::infinity();
  for (const Member& member : members_)
    least_edge = std::min(least_edge, member.steps->shortestEdge());
  if (plan_.needs_acceleration &&
      std::any_of(members_.begin(), members_.end(), [](const Member& m) { return m.steps->startsFresh(); }))
    startAccelerations();
  island_.beginSubstep(substep.from / duration_);
  if (!loadContact(substep.length))
    return StepFailure::squeezed;
  for (std::size_t s = 0; s < plan_.stages.size(); ++s)
  {
    const NewtonResult newton = solveStage(s, substep);
    report.iterations += newton.iterations;
    report.factorizations += newton.factorizations;
    if (!newton.ok())
    {
      failed_ = farthestFromBalance();
      return newton.failure;
    }
    report.residual = std::max(report.residual, newton.residual);
    report.max_strain = std::max(report.max_strain, newton.max_strain);
    if (island_.contact())
      island_.endStage();
    for (const Member& member : members_)
      member.steps->endStage(s, s + 1 == plan_.stages.size(), report);
  }
  return StepFailure::none;
}

NewtonResult IslandStepper::solveStage(std::size_t s, const Substep& substep)
{
  const double before = s == 0 ? 0.0 : plan_.stages[s - 1].time, now = plan_.stages[s].time, h = substep.length;
  double from = (substep.from + before * h) / duration_;
  const double to = now == 1.0 ? substep.to / duration_ : (substep.from + now * h) / duration_;
  for (const Member& member : members_)
    member.steps->beginStage(s);
  island_.beginStage(s == 0);
  NewtonResult total = island_.solve(from, to, time_.newton);
  while (total.ok())
  {
    bool more = false;
    for (const Member& member : members_)
      more = member.steps->meetsMore() || more;
    if (!more)
      break;
    island_.accept();   // the next solution begins here
    for (const Member& member : members_)
      member.steps->holdMore();
    island_.numberUnknowns();
    from = to;
    const NewtonResult next = island_.solve(from, to, time_.newton);
    const int iterations = total.iterations + next.iterations,
              factorizations = total.factorizations + next.factorizations;
    total = next;
    total.iterations = iterations;
    total.factorizations = factorizations;
  }
  return total;
}

/// The member on which the largest unbalanced force acts.
std::size_t IslandStepper::farthestFromBalance() const
{
  Largest force;
  for (std::size_t k = 0; k < members_.size(); ++k)
    if (const Largest own = members_[k].steps->unbalancedForce(); own.any())
      force.add(static_cast<int>(k), own.value());
  return force.any() ? static_cast<std::size_t>(force.index()) : 0;
}

StepFailure IslandStepper::attempt(const Substep& substep, StepReport& report)
{
  if (const StepFailure failure = solveSubstep(substep, report); failure != StepFailure::none)
    return failure;
  if (conserving_ && energyAtEnd() > most_energy_)
    return StepFailure::energy_grew;
  if (ContactPotential* contact = island_.contact())
    contact->adaptStiffness();
  for (failed_ = 0; failed_ < members_.size(); ++failed_)
    if (const StepFailure failure = members_[failed_].steps->finishSubstep(report); failure != StepFailure::none)
      return failure;
  failed_ = 0;
  return StepFailure::none;
}

void IslandStepper::accept(const Substep& substep)
{
  for (std::size_t k = 0; k < members_.size(); ++k)
  {
    members_[k].steps->acceptSubstep(substep);
    swept_[k].include(members_[k].steps->surfaceBox(0.0));
  }
  if (const ContactPotential* contact = island_.contact())
    stiffness_ = contact->stiffness();
}

bool IslandStepper::shorterMayHelp(StepFailure failure) const
{
  return failed_ >= members_.size() || members_[failed_].steps->shorterMayHelp(failure);
}

bool IslandStepper::mend(StepReport& report)
{
  constexpr int kMostFolds = 20;   // in one step
  if (report.mended_folds >= kMostFolds)
    return false;
  for (const Member& member : members_)
    if (member.steps->mend())
    {
      ++report.mended_folds;
      return true;
    }
  return false;
}

void IslandStepper::refuse(const Substep& substep, StepFailure failure, StepReport& report)
{
  if (failure == StepFailure::interrupted)
  {
    report.ok = false;
    report.failure = failure;
    report.message = kStepInterrupted;
    return;
  }
  members_[std::min(failed_, members_.size() - 1)].steps->refuse(failure, substep.length, report);
}

}   // namespace slender
