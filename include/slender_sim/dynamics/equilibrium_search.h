#pragma once

#include <algorithm>
#include <cmath>

#include "slender_sim/dynamics/newton.h"
#include "slender_sim/dynamics/step_report.h"

namespace slender {

/// What the second derivative of the energy says of a stationary configuration.
struct EquilibriumStability
{
  bool stable = true;          ///< no eigenvalue lies below the neutral band
  double lowest = 0.0;         ///< lowest eigenvalue [1/s^2], see StepReport::lowest_eigenvalue
  double energy = 0.0;         ///< elastic energy and that of the loads [J]
  double energy_noise = 0.0;   ///< differences of energies below it are round-off [J]
  double work = 0.0;           ///< work of loads without a potential since the search began [J]
  /// The search goes down this: the energy without what those loads have done.
  double balance() const { return energy - work; }
};

/// Largest unbalanced force over the largest force at an equilibrium. Newton's increments of 1e-8 of an edge leave
/// 1e-7. Where nothing balances a load, as much as the load is left.
constexpr double kMostUnbalanced = 1e-4;

/// Leaves the saddle at which the search is, along its mode of negative curvature: to both sides, and less and less
/// far, until the search settles at a stationary configuration of lower energy. By symmetry both sides are usually
/// equal; the one that the sign of the mode gives comes first. Returns false, with the search at the saddle, when no
/// attempt ends lower. `System` as for settleStably().
template <class System>
bool leaveSaddle(System& system, const EquilibriumStability& at)
{
  const auto saddle = system.configuration();
  for (const double turn : {0.1, -0.1, 0.01, -0.01, 1e-3, -1e-3})   // [rad] of the edge that the mode turns most
  {
    system.restore(saddle);
    if (system.displace(turn) && system.settleFrom(at.lowest) &&
        system.assess(false).balance() < at.balance() - at.energy_noise)
      return true;
  }
  system.restore(saddle);
  return false;
}

/// Goes on from the stationary configuration at which `system` is until the equilibrium is stable or every way down
/// from a saddle was tried. With `leave_saddles` false it only assesses. The report gets stability, lowest eigenvalue,
/// energy and the number of saddles that were left.
///
/// System offers
///   assess(spectrum)               the EquilibriumStability of the present configuration; with `spectrum` also its
///   eigenvalue and mode, configuration(), restore(c)    the present configuration, and the way back to it,
///   displace(turn)                 moves along the mode of the last assess(true); returns false where that is not
///   possible, settleFrom(lowest)             minimises the energy from a displaced saddle with this lowest eigenvalue;
///   returns false if it does not settle.
template <class System>
void settleStably(System& system, bool leave_saddles, StepReport& report)
{
  constexpr int kMostEscapes = 50;
  for (int escapes = 0;; ++escapes)
  {
    const EquilibriumStability at = system.assess(true);
    report.stable = at.stable;
    report.lowest_eigenvalue = at.lowest;
    report.energy = at.energy;
    if (at.stable || !leave_saddles || escapes == kMostEscapes || !leaveSaddle(system, at))
      return;
    ++report.escapes;
  }
}

/// Static equilibrium by continuation: what is prescribed is carried to its targets in small moves, and at each the
/// energy is minimised with a proximal term 1/2 w |x - x_k|^2 about the last configuration. Its weight falls to zero as
/// the iteration settles. What it settles at is stationary. The inertia of the Hessian says whether it is a minimum;
/// from a saddle the search goes on (settleStably()).
///
/// System offers, besides what settleStably() needs except settleFrom(),
/// - round(fraction, weight): minimises with what is prescribed at this fraction of its way, and a proximal weight
///   in units of its own. The result becomes the present configuration on success;
/// - shift(): returns the largest displacement of the last round over the size of the system;
/// - takeBase(): takes the last configuration of a round that did not converge as the present one;
/// - weightOf(rate): returns the proximal weight whose term has this eigenvalue [1/s^2]. The weight may be infinite
///   or not a number.
template <class System>
class EquilibriumSearch
{
public:
  EquilibriumSearch(System& system, StepReport& report) : system_(system), report_(report) {}

  /// Carries what is prescribed to its targets in at least `moves` moves. With none (0) nothing is done. Returns false
  /// when the system cannot follow; failure() says why.
  bool carry(double moves)
  {
    constexpr int kMostFailures = 40;
    constexpr double kLeastAdvance = 1e-6;
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

  /// Minimises the energy from the present configuration on. Returns false when that does not settle; failure() says
  /// why.
  bool settle()
  {
    constexpr int kMostRounds = 1000, kMostFailures = 40;
    constexpr double kNoWeight = 1e-9;   // below it the proximal term is left out
    double ease = 0.01;                  // smallest factor by which the weight falls from round to round
    for (int k = 0, failures = 0; k < kMostRounds; ++k)
    {
      const double weight = weight_ < kNoWeight ? 0.0 : weight_;
      if (!round(1.0, weight))
      {
        if (failure_ == StepFailure::newton_diverged && weight > 0)
          system_.takeBase();   // Newton did not arrive but came further down: the next round begins there
        weight_ = std::max(10.0 * weight_, 1e-6);
        // The weight falls more slowly now, so that the search does not come back here at once.
        ease = std::sqrt(ease);
        if (++failures > kMostFailures || failure_ == StepFailure::interrupted)
          return false;
        continue;
      }
      if (weight == 0.0)
        return true;
      failures = 0;
      const double shift = system_.shift();
      weight_ *= std::max(ease, shift < 1e-3 ? 0.01 : shift < 0.05 ? 0.2 : 0.7);
      ease = std::max(0.01, 0.7 * ease);
    }
    failure_ = StepFailure::newton_diverged;
    return false;
  }

  /// Settles, then leaves saddles (with `leave_saddles`) until the equilibrium is stable or no way leads down. Returns
  /// false if nothing settled.
  bool settleStably(bool leave_saddles)
  {
    if (!settle())
      return false;
    slender::settleStably(*this, leave_saddles, report_);
    return true;
  }

  /// Why the last round failed.
  StepFailure failure() const { return failure_; }

  // ---- what settleStably() needs
  EquilibriumStability assess(bool spectrum) { return system_.assess(spectrum); }
  auto configuration() const { return system_.configuration(); }
  template <class Configuration>
  void restore(const Configuration& configuration)
  {
    system_.restore(configuration);
  }
  bool displace(double turn) { return system_.displace(turn); }
  bool settleFrom(double lowest)
  {
    // A weight above the negative eigenvalue makes the first rounds convex, so that they slide down instead of jumping.
    weight_ = std::max(1e-6, system_.weightOf(2.0 * std::abs(lowest)));
    if (!std::isfinite(weight_))
      weight_ = 1e-2;
    return settle();
  }

private:
  bool round(double fraction, double weight)
  {
    const NewtonResult result = system_.round(fraction, weight);
    report_.iterations += result.iterations;
    failure_ = result.failure;
    if (!result.ok())
      return false;
    ++report_.substeps;
    return true;
  }

  System& system_;
  StepReport& report_;
  StepFailure failure_ = StepFailure::none;
  double weight_ = 1.0;   ///< of the proximal term, in the system's own unit
};

}   // namespace slender
