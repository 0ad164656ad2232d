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

void ImpulseCloths::prepareCorrection(std::size_t k)
{
  AverageCorrection& to = corrections_[k];
  if (to.ready && to.pins == work_.cloths[k].pins && to.set == work_.cloths[k].average_set)
    return;
  const auto& c = *averagesOf(k)->weights;
  to.weights = c * inverse_mass_.segment(first_[k], first_[k + 1] - first_[k]).asDiagonal();
  to.gram.compute(Eigen::MatrixXd(to.weights * c.transpose()));
  if (averagesOf(k)->bounds.size() > 0)
    to.gram_rows = to.weights * c.transpose();
  to.pins = work_.cloths[k].pins;
  to.set = work_.cloths[k].average_set;
  to.ready = true;
}

/// What push_ does on the masses of a cloth against averages that are met: these balance that part, so that no motion
/// answers it. Pushes that they balance wholly, of a flat sheet that comes down on a floor, would have the rounding
/// errors that are left as their answer.
double ImpulseCloths::balancedWork(std::size_t k, double h)
{
  constexpr int kSweeps = 100;
  prepareCorrection(k);
  AverageCorrection& to = corrections_[k];
  const auto& c = *averagesOf(k)->weights;
  const std::vector<int>& at_bound = next_.cloths[k].at_bound;
  to.gap.setZero(3, c.rows());
  for (Eigen::Index i = 0; i < c.rows(); ++i)
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(to.weights, i); entry; ++entry)
      to.gap.col(i) += entry.value() * push_.col(first_[k] + entry.col());
  if (at_bound.empty())
  {
    to.columns = to.gap.transpose();
    to.gram.solveInPlace(to.columns);
    return h * h * to.gap.cwiseProduct(to.columns.transpose()).sum();
  }
  to.multipliers.setZero(3, c.rows());
  to.forces = to.gap;
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (Eigen::Index i = 0; i < c.rows(); ++i)
    {
      if (std::binary_search(at_bound.begin(), at_bound.end(), static_cast<int>(i)))
        continue;
      const Eigen::Vector3d change = to.forces.col(i) / to.gram_rows.coeff(i, i);
      to.multipliers.col(i) += change;
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(to.gram_rows, i); entry; ++entry)
        to.forces.col(entry.col()) -= entry.value() * change;
    }
  return h * h * to.gap.cwiseProduct(to.multipliers).sum();
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
    within = within && (to.forces.col(i) + to.multipliers.col(i) / (h * h)).norm() <= (1.0 + kBoundSlack) * bounds[i];
  if (within)
    return gap;
  to.multipliers.setZero();
  double needed = 0.0;
  for (int sweep = 0; sweep < kSweeps && budget_->spend(to.gram_rows.nonZeros() / kEntriesPerCount); ++sweep)
  {
    double largest = 0.0;
    for (Eigen::Index i = 0; i < bounds.size(); ++i)
    {
      const double give = h * h * to.gram_rows.coeff(i, i), most = (1.0 + kBoundSlack) * bounds[i];
      const Eigen::Vector3d wanted = to.forces.col(i) + to.gap.col(i) / give, now = to.forces.col(i);
      const bool beyond = wanted.norm() > most;
      const Eigen::Vector3d change = (beyond ? Eigen::Vector3d(most / wanted.norm() * wanted) : wanted) - now;
      if (sweep == 0 && beyond)
        at_bound.push_back(static_cast<int>(i));
      if (sweep == 0 && !(beyond && now.norm() <= most && change.norm() <= unresolved * bounds[i]))
        needed = std::max(needed, give * change.norm() / to.tolerance);
      largest = std::max(largest, give * change.norm());
      to.forces.col(i) += change;
      to.multipliers.col(i) += h * h * change;
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(to.gram_rows, i); entry; ++entry)
        to.gap.col(entry.col()) -= h * h * entry.value() * change;
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
    AverageCorrection& to = corrections_[k];
    const int first = first_[k], count = first_[k + 1] - first;
    const auto x = x_.middleCols(first, count);
    to.gap = sub_inputs_[k].averages;
    for (Eigen::Index i = 0; i < c.rows(); ++i)
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(c, i); entry; ++entry)
        to.gap.col(i) -= entry.value() * x.col(entry.col());
    double gap = to.gap.colwise().norm().maxCoeff() / to.tolerance;
    if (!bounded && !(gap > 1))
    {
      worst = std::max(worst, gap);
      continue;
    }
    prepareCorrection(k);
    to.columns = to.gap.transpose();
    to.gram.solveInPlace(to.columns);
    to.multipliers = to.columns.transpose();
    if (bounded)
      gap = boundAverages(k, h, gap);
    worst = std::max(worst, gap);
    if (!(gap > 1))
      continue;
    for (Eigen::Index i = 0; i < c.rows(); ++i)
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(to.weights, i); entry; ++entry)
      {
        const Eigen::Vector3d shift = entry.value() * to.multipliers.col(i);
        x_.col(first + entry.col()) += shift;
        v_.col(first + entry.col()) += shift / h;
      }
    to.multipliers /= h * h;   // forces
    shared_averages_[k] += to.multipliers;
    for (std::size_t p = 0; p < to.pins.size(); ++p)
      for (Eigen::Index i = 0; i < c.rows(); ++i)
        shared_pins_[k].col(static_cast<Eigen::Index>(p)) += c.coeff(i, to.pins[p]) * to.multipliers.col(i);
  }
  return worst;
}

}   // namespace slender
