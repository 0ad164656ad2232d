#pragma once

#include <functional>
#include <vector>

#include "island/equations.h"
#include "slender_sim/dynamics/step_report.h"

namespace slender {

/// Largest unbalanced force over the largest force at an equilibrium. Newton's increments of 1e-8 of an edge leave
/// 1e-7. Where nothing balances a load, as much as the load is left.
constexpr double kMostUnbalanced = 1e-4;

/// What the second derivative of the energy says of a stationary configuration.
struct EquilibriumStability
{
  bool stable = true;          ///< no eigenvalue lies below the neutral band
  double lowest = 0.0;         ///< lowest eigenvalue [1/s^2], see StepReport::lowest_eigenvalue
  double energy = 0.0;         ///< elastic energy and that of the loads [J]
  double energy_noise = 0.0;   ///< differences of energies below it are round-off [J]
  double work = 0.0;           ///< work of loads without a potential so far [J]
  /// The search goes down this: the energy without what those loads have done.
  double balance() const { return energy - work; }
};

/// Static equilibria of the parts of an island. What is prescribed is carried to its targets in small moves, and at
/// each the energy is minimised with a proximal term 1/2 w |x - x_k|^2 about the last configuration. Its weight falls
/// to zero as the iteration settles, so that the end is stationary. The inertia of the Hessian says whether it is a
/// minimum. A saddle is left along its mode of negative curvature, and the search goes on.
class Statics
{
public:
  virtual ~Statics() = default;
  /// The parts of the equations, which have loaded their present configuration. All of them must outlive the statics.
  void setParts(Equations& equations, std::vector<Part*> parts, const NewtonConfig& newton);
  /// Finds an equilibrium, and with `leave_saddles` goes on until it is stable or every way down was tried. It becomes
  /// the present configuration of the parts. Returns why none was found; also if nothing balances the loads, and then
  /// the residual of the report is not small. Without `search` it only judges the present configuration, which must be
  /// stationary.
  StepFailure solve(bool search, bool leave_saddles);
  /// Returns residual, strain, energy, stability and counts of the last solve().
  const StepReport& report() const { return report_; }
  /// Mode of the lowest eigenvalue of the last equilibrium: the directions of all parts. No edge turns by more than 1
  /// rad, and its largest entry is positive. Zero if none was found.
  const Eigen::VectorXd& mode() const { return mode_; }

protected:
  void settleStably(bool leave_saddles);
  RodEvaluation load();
  Equations& equations() { return *equations_; }

  /// Loads the present configuration of all parts.
  virtual void loadParts();
  /// The trial becomes the present configuration.
  virtual void takeTrial();
  virtual std::function<void()> wayBack();
  /// Minimises the energy from a displaced saddle with this lowest eigenvalue [1/s^2]. Returns false if it does not
  /// settle.
  virtual bool settleFrom(double lowest);

  StepReport report_;
  StepFailure failure_ = StepFailure::none;   ///< why the last round failed

private:
  bool round(double fraction, double weight);
  bool carry();
  bool settle();
  bool leaveSaddle(const EquilibriumStability& at);
  EquilibriumStability assess(bool spectrum);
  bool displace(double turn);
  bool definite(double rate);
  double neutralBand() const;
  double rounding() const;
  double takeMode(double divisor);
  void findMode();
  template <class F>
  double largest(F&& of) const;

  Equations* equations_ = nullptr;
  std::vector<Part*> parts_;
  NewtonConfig newton_;
  double weight_ = 1.0;   ///< of the proximal term
  Eigen::VectorXd mode_;
};

}   // namespace slender
