#pragma once

#include <memory>

#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/dynamics/time_config.h"
#include "slender_sim/dynamics/work_budget.h"

namespace slender {

/// Inputs of one cloth, latched once per step.
struct ClothInputs
{
  /// where each pin shall be at the end of the step, 3 x pins; the motion inside it is uniform
  Eigen::Matrix3Xd pins;
  /// what the averages of the state's set shall be at the end of the step, 3 x count; in between their motion is
  /// uniform
  Eigen::Matrix3Xd averages;
  Eigen::Vector3d gravity{0, 0, -9.81};   ///< [m/s^2]
  Eigen::Vector3d wind{0, 0, 0};          ///< [m/s]
  Eigen::Matrix3Xd forces;                ///< extra forces on the vertices, 3 x n [N], or empty
};

struct ClothEnergies
{
  double membrane = 0, bending = 0, kinetic = 0, gravity = 0;   ///< [J]
  double total() const { return membrane + bending + kinetic + gravity; }
};

/// Says how linear equations are solved. The study implicit_step compares both ways.
enum class ClothSolver
{
  cholesky,      ///< The whole matrix is factored. Prescribed averages are refused.
  gauss_seidel   ///< Symmetric Gauss-Seidel sweeps precondition conjugate gradients.
};

/// Says how the equations of a cloth are solved.
struct ClothSolving
{
  bool one_newton_step = false;   ///< implicit stages: linearised about their start [Baraff & Witkin 1998]
  ClothSolver solver = ClothSolver::gauss_seidel;
  /// Of sweeps: last over first residual, in the preconditioner's norm (0, 1). The first one is that of unchanged
  /// velocity. With averages and one_newton_step it is that of the same cloth without them, and of what it takes to
  /// move them; then at most a fifth of what is left at the start may be left.
  double linear_tolerance = 5e-3;
};

/// Says how a cloth is advanced. These are the integrators:
///  - implicit_euler: first order; damps what the step does not resolve.
///  - tr_bdf2: second order, likewise damping; two stages, each at about the price of a step of implicit Euler.
///  - imex: first order. Bending, its damping and mass damping are implicit; the membrane, its damping and the wind
///    are explicit (thesis 2.5.2). The matrix is constant (n x n) and is factored once, so that a step costs one
///    back-solve. Bending never limits the step. The membrane limits it as in explicit steps: h < 2 / omega, where
///    omega^2 is the largest eigenvalue of M^-1 K of the membrane. That is about 0.5 edge sqrt(area density / modulus)
///    [s]. Bending has to be isometric, or there is none.
///  - symplectic_euler: first order, explicit; bending limits the step as well.
///
/// Only implicit_euler and tr_bdf2 control the local error.
struct ClothOptions : TimeConfig, ClothSolving
{
  ClothOptions() { integrator = Integrator::implicit_euler; }
};

/// Advances one cloth.
class ClothStepper
{
public:
  /// Throws std::invalid_argument for a model or options that are not valid.
  ClothStepper(std::shared_ptr<const ClothModel> model, const ClothOptions& options);
  ~ClothStepper();
  ClothStepper(ClothStepper&&) noexcept;

  /// Steps spend this from now on, which others start; null: one of their own.
  void useBudget(std::shared_ptr<WorkBudget> budget);
  /// Advances by `duration` [s]. On failure the state is untouched and the report says why.
  StepReport step(ClothState& state, const ClothInputs& inputs, double duration);
  /// The same by one step of implicit Euler, for tr_bdf2 and controlled steps; it is cut only where it cannot be
  /// solved.
  StepReport stepUndivided(ClothState& state, const ClothInputs& inputs, double duration);

  /// Static equilibrium under gravity, forces and pins (velocities become zero), with elastic forces alone: damping
  /// does not act, and neither does air at rest. An unstable equilibrium is left along its mode of negative curvature,
  /// until a stable one is found or every way was tried; then report.stable is false. `leave_saddles` false: it is
  /// kept. Refuses wind, plasticity and prescribed averages.
  StepReport solveEquilibrium(ClothState& state, const ClothInputs& inputs, bool leave_saddles = true);
  /// Residual, energy, lowest eigenvalue and stability of a state that is an equilibrium under the inputs already.
  StepReport assessEquilibrium(const ClothState& state, const ClothInputs& inputs);
  /// Mode of the lowest eigenvalue of the last equilibrium: displacement of each vertex (3 x n [m]), scaled so that the
  /// edge that turns most turns by 1 rad.
  const Eigen::Matrix3Xd& lowestMode() const;

  /// Displacement of the vertices by additional forces, both 3 x n [m, N], at the end of the last successful step, and
  /// by how much the pins' forces and those of the averages, which stay, change [N]: linear, with the stiffness of its
  /// last Newton iteration and the inertia of a step of implicit Euler of `duration` [s], whatever the stages and
  /// substeps were, so that responses of several cloths go together; after explicit steps that of the masses alone.
  /// Returns false if the matrix cannot be used.
  bool respond(const Eigen::Matrix3Xd& forces, double duration, Eigen::Matrix3Xd& displacement,
               Eigen::Matrix3Xd& pin_forces_change, Eigen::Matrix3Xd& average_forces_change);
  /// Of explicit integrators: the longest step for which the cloth at rest is stable [s], by the largest eigenvalue of
  /// M^-1 K (power iteration); damping by stiffness makes it shorter. Infinite for implicit ones. Not cheap: for
  /// messages.
  double stableStep() const;
  /// Force of the cloth on each pin [N], 3 x pins, at the end of the last successful step or in the last equilibrium.
  const Eigen::Matrix3Xd& pinForces() const;

  /// Force [N] with which each prescribed average acts on the cloth (3 x count), spread over its vertices by their
  /// weights: the Lagrange multipliers at the end of the last successful step; with bounds those of its linear
  /// equations, which keep them.
  const Eigen::Matrix3Xd& averageForces() const;

  ClothEnergies energies(const ClothState& state, const Eigen::Vector3d& gravity) const;
  const ClothModel& model() const;

  /// For the world, which steps its objects together.
  class Impl;
  Impl& impl() { return *impl_; }

private:
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
