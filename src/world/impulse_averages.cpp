// Averages that are prescribed, and contact.
#include <algorithm>
#include <limits>

#include "impulse_cloths.h"

namespace slender {

namespace {

constexpr int kMeetRounds = 200;
// of forces' bounds: the cloth's own step keeps them to its tolerance alone, 5e-3 of the load
constexpr double kBoundSlack = 1e-3;
constexpr long kEntriesPerCount = 16;   // of sparse matrices, to a count of a WorkBudget
// that must halve the averages' errors; slow convergence as it was seen makes a third of them
constexpr int kStallRounds = 8;

}   // namespace

/// Guides press cloths into what is in their way.
std::string ImpulseCloths::blameAverages(const CollisionReport& failure) const
{
  if (failure.at_start)
    return "";
  for (const int point : failure.points)
  {
    const ClothModel* cloth = point >= 0 && point < vertices() ? &steppers_[clothOf(point)].model() : nullptr;
    if (cloth && !cloth->averages.empty())
      return "; the averages of cloth '" + cloth->name +
             "' are to be where its guide is, whatever is in the way: keep the guide clear of it, or " +
             (cloth->averages[0].bounds.size() > 0 ? "take a lower max_traction" : "bound their forces (max_traction)");
  }
  return "";
}

/// What takes so much is seldom what the last substep failed at.
void ImpulseCloths::blameWork(double h, StepReport& report) const
{
  const auto tracked = std::find_if(steppers_.begin(), steppers_.end(),
                                    [](const ClothStepper& s) { return !s.model().averages.empty(); });
  const bool guided = tracked != steppers_.end();
  const std::string last = report.failure == StepFailure::work_exceeded ? "" : "; at last " + report.message;
  report.failure = StepFailure::work_exceeded;
  report.message =
      "cloth '" + (guided ? *tracked : steppers_[0]).model().name + (steppers_.size() > 1 ? "' and others" : "'") +
      ": contact needs more work than a step is given, at " + milliseconds(h) + ": use a shorter step, or " +
      (guided ? "a guide that moves by less at once, does not crumple, and is clear of obstacles"
              : "move what holds it and obstacles by less at once, and leave it more room") +
      last;
}

/// Collisions move averages that are prescribed. Going back and forth between both leads to where both are met, by a
/// factor of about a thousand each time where what touches is little of what an average is taken over; where a cloth is
/// pressed flat a hundred rounds were seen. Collisions have the last word.
CollisionReport ImpulseCloths::resolve(const CollisionStep& step)
{
  held_impulses_.setZero(3, vertices());
  CollisionReport report = resolveContacts(step);
  double earlier = std::numeric_limits<double>::infinity();
  for (int round = 1; report.ok && round <= kMeetRounds; ++round)
  {
    const double gap = meetAverages(step.h);
    if (gap <= 1)
      break;
    const CollisionReport again = resolveContacts(step);
    if (!again.ok)
      return again;
    report.impulses += again.impulses;
    report.rounds += again.rounds;
    report.zones = again.zones;
    report.zone_points = again.zone_points;
    if (round % kStallRounds == 0)
    {
      if (gap > 0.5 * earlier)   // both cannot be had
        break;
      earlier = gap;
    }
  }
  return report;
}

/// The averages do not depend on each other: otherwise the cloth's own step has failed.
ImpulseCloths::AverageCorrection& ImpulseCloths::prepareCorrection(std::size_t k)
{
  AverageCorrection& to = corrections_[k];
  if (to.set != work_.cloths[k].average_set)
  {
    to.set = work_.cloths[k].average_set;
    to.projection = std::make_unique<AverageProjection>(*averagesOf(k)->weights);
    to.gap.assign(4 * static_cast<std::size_t>(to.projection->count()), 0.0);
    to.multipliers = to.gap;
  }
  to.projection->prepare(inertia_.segment(first_[k], first_[k + 1] - first_[k]),
                         [&](int i) { return inverse_mass_[first_[k] + i] > 0.0; });
  return to;
}

/// What push_ does on the masses of a cloth against averages that are met: these balance that part, so that no motion
/// answers it. Pushes that they balance wholly, of a flat sheet that comes down on a floor, would have the rounding
/// errors that are left as their answer.
double ImpulseCloths::balancedWork(std::size_t k, double h)
{
  AverageCorrection& to = prepareCorrection(k);
  const auto& c = *averagesOf(k)->weights;
  for (Eigen::Index i = 0; i < c.rows(); ++i)
  {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (AverageProjection::Averages::InnerIterator entry(c, i); entry; ++entry)
      sum += entry.value() * to.projection->give()[entry.col()] * push_.col(first_[k] + entry.col());
    point(to.gap, i) = sum;
  }
  to.multipliers = to.gap;
  to.projection->leaveOut(next_.cloths[k].at_bound);
  to.projection->solve(to.multipliers);
  to.projection->leaveOut({});
  return h * h * pointKernels().dot(to.projection->count(), to.gap.data(), to.multipliers.data());
}

/// Makes the multipliers of a cloth's averages those that bounds of their forces allow: block Gauss-Seidel over
/// averages, each force projected into its ball. Forces so far are those of the cloth's own step and of what contacts
/// have changed since. Returns the largest change that is needed, as meetAverages() counts it.
double ImpulseCloths::boundAverages(std::size_t k, double h, double gap)
{
  constexpr int kSweeps = 2000;
  AverageCorrection& to = corrections_[k];
  // of a force's direction, by the cloth's own step
  const double unresolved = 2.0 * cloth(k).options.linear_tolerance;
  const Eigen::VectorXd& bounds = averagesOf(k)->bounds;
  std::vector<int>& at_bound = next_.cloths[k].at_bound;
  at_bound.clear();
  to.forces = steppers_[k].averageForces() + shared_averages_[k];
  bool within = true;
  for (Eigen::Index i = 0; i < bounds.size(); ++i)
    within =
        within && (to.forces.col(i) + point(to.multipliers, i) / (h * h)).norm() <= (1.0 + kBoundSlack) * bounds[i];
  if (within)
    return gap;
  std::fill(to.multipliers.begin(), to.multipliers.end(), 0.0);
  const PointMatrix& gram = to.projection->gram();
  double needed = 0.0;
  for (int sweep = 0; sweep < kSweeps && budget_->spend(static_cast<long>(gram.values().size()) / kEntriesPerCount);
       ++sweep)
  {
    double largest = 0.0;
    for (Eigen::Index i = 0; i < bounds.size(); ++i)
    {
      const int row = static_cast<int>(i), end = gram.starts()[row + 1];
      double give = 0.0;
      for (int e = gram.starts()[row]; e < end; ++e)
        if (gram.column(e) == row)
          give = h * h * gram.values()[e];
      const double most = (1.0 + kBoundSlack) * bounds[i];
      const Eigen::Vector3d wanted = to.forces.col(i) + point(to.gap, i) / give, now = to.forces.col(i);
      const bool beyond = wanted.norm() > most;
      const Eigen::Vector3d change = (beyond ? Eigen::Vector3d(most / wanted.norm() * wanted) : wanted) - now;
      if (sweep == 0 && beyond)
        at_bound.push_back(static_cast<int>(i));
      if (sweep == 0 && !(beyond && now.norm() <= most && change.norm() <= unresolved * bounds[i]))
        needed = std::max(needed, give * change.norm() / to.tolerance);
      largest = std::max(largest, give * change.norm());
      to.forces.col(i) += change;
      point(to.multipliers, i) += h * h * change;
      for (int e = gram.starts()[row]; e < end; ++e)
        point(to.gap, gram.column(e)) -= h * h * gram.values()[e] * change;
    }
    if (sweep == 0 && !(needed > 1))
      return needed;
    if (largest < 0.1 * to.tolerance)
      break;
  }
  return needed;
}

/// Moves what is free, by as little as its mass allows. Returns the largest error of an average that there was, in
/// units of what is tolerated; nothing moves when that is at most 1.
double ImpulseCloths::meetAverages(double h)
{
  double worst = 0.0;
  for (std::size_t k = 0; k < steppers_.size(); ++k)
  {
    if (!averagesOf(k))
      continue;
    const bool bounded = averagesOf(k)->bounds.size() > 0;
    const auto& c = *averagesOf(k)->weights;
    AverageCorrection& to = prepareCorrection(k);
    const int first = first_[k];
    double gap = 0.0;
    for (Eigen::Index i = 0; i < c.rows(); ++i)
    {
      Eigen::Vector3d left = sub_inputs_[k].averages.col(i);
      for (AverageProjection::Averages::InnerIterator entry(c, i); entry; ++entry)
        left -= entry.value() * x_.col(first + entry.col());
      point(to.gap, i) = left;
      gap = std::max(gap, left.norm() / to.tolerance);
    }
    if (!bounded && !(gap > 1))
    {
      worst = std::max(worst, gap);
      continue;
    }
    to.multipliers = to.gap;
    to.projection->solve(to.multipliers);
    if (bounded)
      gap = boundAverages(k, h, gap);
    worst = std::max(worst, gap);
    if (!(gap > 1))
      continue;
    for (Eigen::Index i = 0; i < c.rows(); ++i)
    {
      const Eigen::Vector3d moved = point(to.multipliers, i);
      for (AverageProjection::Averages::InnerIterator entry(c, i); entry; ++entry)
      {
        const Eigen::Vector3d shift = entry.value() * to.projection->give()[entry.col()] * moved;
        x_.col(first + entry.col()) += shift;
        v_.col(first + entry.col()) += shift / h;
      }
      shared_averages_[k].col(i) += moved / (h * h);   // forces
    }
    const std::vector<int>& pins = work_.cloths[k].pins;
    for (std::size_t p = 0; p < pins.size(); ++p)
      for (Eigen::Index i = 0; i < c.rows(); ++i)
        shared_pins_[k].col(static_cast<Eigen::Index>(p)) += c.coeff(i, pins[p]) / (h * h) * point(to.multipliers, i);
  }
  return worst;
}

}   // namespace slender
