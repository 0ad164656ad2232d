#pragma once

#include <array>
#include <vector>

#include "slender_sim/dynamics/time_config.h"

namespace slender {

/// Known quantities that a stage combines: state at the start of the step, one step before it, and the first stage.
enum History
{
  kQ,
  kV,
  kA,
  kQPrevious,
  kVPrevious,
  kQStage,
  kVStage,
  kHistoryCount
};
using Combination = std::array<double, kHistoryCount>;

/// One implicit stage of a time step, for M q'' = F(q, q'): find q with
///   M (q - qHat) / tau_a^2 = F(q, (q - qTilde) / tau_v).
/// Every implicit method here is a sequence of such stages, so all share one Newton solver, and a backward difference
/// (q - qTilde) / tau_v of the strain gives viscous forces of the same order (thesis 5.3.1).
struct Stage
{
  double time;           ///< of the inputs, as a fraction of the step
  double tau_a, tau_v;   ///< [s]
  Combination q_hat, q_tilde;
};

/// How the stages of one step of length h end: q1 = q0 + (q - q0) / fraction, likewise v; a1 = a0 + (a - a0) /
/// a_fraction.
struct StepPlan
{
  Integrator integrator = Integrator::implicit_euler;
  std::vector<Stage> stages;
  double fraction = 1.0, a_fraction = 1.0;
  bool needs_acceleration = false;   ///< of the start of the step
};

/// Plan for a step of h seconds. `previous_step` is the length of the step before (0: there was none, multistep methods
/// then start with implicit Euler). Not for symplectic_euler and imex. Reuses the memory of `plan`.
///  - implicit_euler: first order, L-stable.
///  - bdf2: variable-step second order, L-stable [Hairer & Wanner, Solving ODEs II, V.1].
///  - tr_bdf2: trapezoid to gamma h, then BDF2, gamma = 2 - sqrt 2; second order, L-stable [Bank et al. 1985; Hosea &
///  Shampine 1996].
///  - implicit_midpoint: second order, symplectic, no damping at infinite frequency.
///  - generalized_alpha: second order, damping at infinite frequency by spectral_radius (1: midpoint-like, 0: most)
///  [Chung & Hulbert 1993].
void planStep(Integrator integrator, double spectral_radius, double h, double previous_step, StepPlan& plan);

/// Steps from 0 s to `end` [s], at least 1: a time that is a whole number of steps but for round-off takes no more. At
/// most 1e15, whose end nobody sees.
long stepsUntil(double end, double step);

/// Returns true for symplectic_euler and imex, which solve no nonlinear equations. Their steps have one length, on
/// which their stability depends.
bool isExplicit(Integrator integrator);

/// Constant C in the local position error C h^2 |a1 - a0| (second order) or C h^2 |a1| (implicit Euler).
double errorConstant(Integrator integrator);

/// Order of convergence.
int order(Integrator integrator);

}   // namespace slender
