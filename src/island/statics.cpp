// Static equilibria of parts: continuation, the inertia and the lowest mode of the Hessian, and the way from saddles.
#include "island/statics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/statics_advice.h"
#include "slender_sim/dynamics/lowest_eigenvalue.h"

namespace slender {

void Statics::setParts(Equations& equations, std::vector<Part*> parts, const NewtonConfig& newton)
{
  equations_ = &equations;
  parts_ = std::move(parts);
  newton_ = newton;
  newton_.tolerance = std::min(newton_.tolerance, 1e-8);
  newton_.max_iterations = std::max(60, newton_.max_iterations);
}

/// The largest of a measure of the parts.
template <class F>
double Statics::largest(F&& of) const
{
  double result = 0.0;
  for (Part* part : parts_)
    result = std::max(result, of(*part));
  return result;
}

void Statics::loadParts()
{
  for (Part* part : parts_)
    part->loadPresent();
}

void Statics::takeTrial()
{
  for (Part* part : parts_)
    part->takeTrial();
}

std::function<void()> Statics::wayBack()
{
  std::vector<std::function<void()>> ways;
  for (Part* part : parts_)
    ways.push_back(part->wayBack());
  return [ways = std::move(ways)] {
    for (const auto& way : ways)
      way();
  };
}

// ---- the search

StepFailure Statics::solve(bool search, bool leave_saddles)
{
  report_ = {};
  weight_ = 1.0;
  if (search && (!carry() || !settle()))
    return failure_;
  settleStably(search && leave_saddles);
  const RodEvaluation at = load();
  report_.residual = equations_->residual() / equations_->forceScale();
  report_.max_strain = at.max_strain;
  return !search || report_.residual < kMostUnbalanced ? StepFailure::none : StepFailure::newton_diverged;
}

/// Minimises with what is prescribed at this fraction of its way. On success the result becomes the present
/// configuration.
bool Statics::round(double fraction, double weight)
{
  loadParts();
  equations_->place(fraction);
  for (Part* part : parts_)
    part->setProximal(weight);
  equations_->beginSubstep(fraction);
  const NewtonResult result = equations_->solve(fraction, fraction, newton_);
  report_.iterations += result.iterations;
  report_.factorizations += result.factorizations;
  report_.residual = result.residual;
  failure_ = result.failure;
  if (!result.ok())
    return false;
  takeTrial();
  ++report_.substeps;
  return true;
}

/// Carries what is prescribed to its targets. Returns false when the parts cannot follow.
bool Statics::carry()
{
  constexpr int kMostFailures = 40;
  constexpr double kLeastAdvance = 1e-6;
  const double moves = largest([](const Part& part) { return part.moves(); });
  const double most = moves > 1 ? 1.0 / moves : 1.0;
  double done = moves > 0 ? 0.0 : 1.0, advance = most;
  for (int failures = 0; done < 1.0;)
  {
    const double fraction = std::min(1.0, done + advance);
    if (round(fraction, weight_))
    {
      done = fraction;
      failures = 0;
      weight_ = std::max(0.2 * weight_, 1.0);
      advance = std::min(1.5 * advance, most);
      continue;
    }
    weight_ = std::min(10.0 * weight_, 1e8);
    advance *= 0.5;
    if (++failures > kMostFailures || advance < kLeastAdvance || failure_ == StepFailure::interrupted)
      return false;
  }
  return true;
}

/// Minimises the energy from the present configuration on. Returns false when that does not settle.
bool Statics::settle()
{
  constexpr int kMostRounds = 1000, kMostFailures = 40, kMostLast = 5;
  constexpr double kNoWeight = 1e-9;   // below it the proximal term is left out
  double ease = 0.01;                  // smallest factor by which the weight falls from round to round
  for (int k = 0, failures = 0, last = 0; k < kMostRounds; ++k)
  {
    const double weight = weight_ < kNoWeight ? 0.0 : weight_;
    if (!round(1.0, weight))
    {
      if (failure_ == StepFailure::newton_diverged && weight > 0)
      {
        // Newton did not arrive but came further down: the next round begins there.
        equations_->moveAlong(0.0);
        equations_->evaluate(false);
        takeTrial();
      }
      weight_ = std::max(10.0 * weight_, 1e-6);
      // The weight falls more slowly now, so that the search does not come back here at once.
      ease = std::sqrt(ease);
      if (++failures > kMostFailures || failure_ == StepFailure::interrupted)
        return false;
      continue;
    }
    // Along a soft mode a last increment may be small and leave forces that are not. Another round then balances them.
    if (weight == 0.0 && (report_.residual < kMostUnbalanced || ++last == kMostLast))
      return true;
    failures = 0;
    const double shift = largest([](const Part& part) { return part.shift(); });
    weight_ *= std::max(ease, shift < 1e-3 ? 0.01 : shift < 0.05 ? 0.2 : 0.7);
    ease = std::max(0.01, 0.7 * ease);
  }
  failure_ = StepFailure::newton_diverged;
  return false;
}

bool Statics::settleFrom(double lowest)
{
  // A weight above the negative eigenvalue makes the first rounds convex, so that they slide down instead of jumping.
  weight_ = std::max(1e-6, largest([&](const Part& part) { return part.weightOf(2.0 * std::abs(lowest)); }));
  if (!std::isfinite(weight_))
    weight_ = 1e-2;
  return settle();
}

/// Goes on from a stationary configuration until the equilibrium is stable or every way down from a saddle was tried.
/// Without `leave_saddles` it only assesses.
void Statics::settleStably(bool leave_saddles)
{
  constexpr int kMostEscapes = 50;
  for (int escapes = 0;; ++escapes)
  {
    const EquilibriumStability at = assess(true);
    report_.stable = at.stable;
    report_.lowest_eigenvalue = at.lowest;
    report_.energy = at.energy;
    if (at.stable || !leave_saddles || escapes == kMostEscapes || !leaveSaddle(at))
      return;
    ++report_.escapes;
  }
}

/// Leaves the saddle at which the search is, along its mode of negative curvature: to both sides, and less and less
/// far, until the search settles at a stationary configuration of lower energy. By symmetry both sides are usually
/// equal; the one that the sign of the mode gives comes first. Returns false, with the search at the saddle, when no
/// attempt ends lower.
bool Statics::leaveSaddle(const EquilibriumStability& at)
{
  const std::function<void()> back = wayBack();
  for (const double turn : {0.1, -0.1, 0.01, -0.01, 1e-3, -1e-3})   // [rad] of the edge that the mode turns most
  {
    if (displace(turn) && settleFrom(at.lowest) && assess(false).balance() < at.balance() - at.energy_noise)
      return true;
    back();
  }
  return false;
}

/// The present configuration becomes what lies along the mode of the last assess(true). Returns false when something
/// is in the way.
bool Statics::displace(double turn)
{
  load();
  Eigen::Index from = 0;
  for (Part* part : parts_)
  {
    Eigen::Map<Eigen::VectorXd> directions = part->directions();
    directions = mode_.segment(from, directions.size());
    from += directions.size();
  }
  equations_->moveAlong(turn);
  if (equations_->contact())
  {
    constexpr double kTooLittle = 1e-3;   // contact is in the way of this direction
    const double room = equations_->roomToTrial();
    if (room < kTooLittle)
      return false;
    equations_->moveAlong(room * turn);
  }
  const RodEvaluation at = equations_->evaluate(false);
  if (!std::isfinite(at.energy()) || at.min_chi <= kFoldedChi)
    return false;
  takeTrial();
  return true;
}

// ---- the present configuration

/// Loads the present configuration, at which everything stands still, and evaluates it. Afterwards the gradients of
/// the parts hold the forces there.
RodEvaluation Statics::load()
{
  equations_->beginStep(1.0);
  loadParts();
  equations_->place(1.0);
  equations_->beginSubstep(1.0);
  equations_->setExact(true);
  if (ContactPotential* contact = equations_->contact())
    contact->begin(equations_->startPoints(), equations_->startSolids(), equations_->frictionTime());
  for (Part* part : parts_)
    part->setPencil(0.0);
  const RodEvaluation at = equations_->evaluate(false);
  equations_->accept();
  return at;
}

EquilibriumStability Statics::assess(bool spectrum)
{
  const RodEvaluation at = load();
  EquilibriumStability result;
  result.energy = at.energy() - (equations_->contact() ? equations_->contact()->frictionEnergy() : 0.0);
  result.energy_noise = 1e-13 * (std::abs(at.stretch) + std::abs(at.bend_twist) + std::abs(at.potential));
  for (const Part* part : parts_)
    result.work += part->staticWork();
  if (!spectrum)
    return result;
  const double neutral = neutralBand();
  result.lowest = lowestEigenvalue([this](double rate) { return definite(rate); }, neutral).value;
  findMode();
  if (!std::isfinite(result.lowest))   // nothing is factored
    mode_.setZero();
  if (std::abs(result.lowest) <= std::max(neutral, rounding()))
    result.lowest = 0.0;
  result.stable = result.lowest >= 0;
  return result;
}

// ---- eigenvalues

/// Factors K + rate M, with the exact second derivative of contact and with friction that sticks. Returns whether the
/// matrix is positive definite.
bool Statics::definite(double rate)
{
  for (Part* part : parts_)
    part->setPencil(rate);
  return equations_->evaluate(true).inertia.positiveDefinite();
}

/// Half width of the band of eigenvalues that count as zero [1/s^2].
double Statics::neutralBand() const
{
  constexpr double kLeast = 1e-12;   // [1/s^2] of bodies on their own: a period of twelve days
  StaticScales all;
  for (const Part* part : parts_)
  {
    const StaticScales own = part->scales();
    all.mass += own.mass;
    all.least_mass = std::min(all.least_mass, own.least_mass);
    all.bending = std::min(all.bending, own.bending);
    all.largest = std::max(all.largest, own.largest);
    all.points += own.points;
  }
  if (const ContactPotential* contact = equations_->contact())
    for (const ContactTerm& term : contact->terms())
      all.largest = std::max(all.largest, 4 * term.stiffness.norm() / all.least_mass);
  // Rounding errors of different points are independent, so that they cancel in part.
  const double rounding = std::numeric_limits<double>::epsilon() * all.largest / std::sqrt(std::max(1, all.points));
  const double bending = std::isfinite(all.bending) ? all.bending / all.mass : 0.0;
  return std::max(kLeast, kNeutralShare * bending + 4.0 * rounding);
}

/// What rounding errors of the matrix and its factor change of the eigenvalue of the mode [1/s^2].
double Statics::rounding() const
{
  double stiffness = 0.0, inertia = 1e-300;
  for (const Part* part : parts_)
    part->addRounding(stiffness, inertia);
  return std::numeric_limits<double>::epsilon() * stiffness / inertia;
}

/// The directions of all parts, divided by a number, become the mode. Returns its entry of the largest size, or 0 if
/// there is none or one is not finite.
double Statics::takeMode(double divisor)
{
  Eigen::Index from = 0, at = 0;
  for (Part* part : parts_)
  {
    Eigen::Map<Eigen::VectorXd> directions = part->directions();
    directions /= divisor;
    mode_.conservativeResize(from + directions.size());
    mode_.tail(directions.size()) = directions;
    from += directions.size();
  }
  const double most = from > 0 && mode_.allFinite() ? mode_.cwiseAbs().maxCoeff(&at) : 0.0;
  return most > 0.0 ? mode_[at] : 0.0;
}

/// By inverse iteration with the matrix last factored.
void Statics::findMode()
{
  for (Part* part : parts_)
  {
    Eigen::Map<Eigen::VectorXd> directions = part->directions();
    for (Eigen::Index k = 0; k < directions.size(); ++k)
      directions[k] = startOfMode(static_cast<double>(k));
  }
  double most = 1.0;
  for (int k = 0; k < 12 && most != 0.0; ++k)
  {
    takeMode(std::abs(most));
    for (Part* part : parts_)
      part->weighDirection();
    equations_->solveAgain();
    most = takeMode(1.0);
  }
  const double turn = largest([](const Part& part) { return part.largestTurn(); });
  if (most != 0.0 && turn > 0.0)
    takeMode(most < 0.0 ? -turn : turn);
  else
    mode_.setZero();
}

}   // namespace slender
