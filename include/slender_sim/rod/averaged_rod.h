#pragma once

#include <memory>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "slender_sim/rod/rod_stepper.h"

namespace slender {

/// Advances one rod of which weighted averages of the nodes are prescribed (thesis 6.4.3; see WeakConstraints), by
/// constrained implicit Euler.
///
/// The averages C x = target are linear: each Newton direction of the free rod, -K^-1 g, is taken back to them by
/// multipliers from the Schur complement C K^-1 C^T over the banded factor, 3 x averages more solves with it. Started
/// on the constraints, Newton's method stays there and its line search holds.
class AveragedRod
{
public:
  using Averages = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// averages: count x nodes, rows sum to 1. Throws std::invalid_argument for averages that do not fit or have no
  /// weight on a row, and for another integrator than implicit_euler with fixed steps.
  AveragedRod(std::shared_ptr<const RodModel> model, std::shared_ptr<const Averages> averages, const TimeConfig& time);
  ~AveragedRod();
  AveragedRod(AveragedRod&&) noexcept;

  /// Advances by `duration` [s] to averages `targets` (3 x count [m]), which move uniformly from where the rod's are. A
  /// step that fails is halved, at most newton.max_cuts times. On failure the state is untouched and the report says
  /// why; averages that depend on each other on the nodes that are free make every step fail.
  StepReport step(RodState& state, const RodInputs& inputs, const Eigen::Matrix3Xd& targets, double duration);

  /// Force [N] with which each average acts on the rod (3 x count), spread over its nodes by their weights, at the end
  /// of the last successful step.
  const Eigen::Matrix3Xd& averageForces() const;
  /// As RodStepper::wrenches(); with what the averages do to held nodes.
  const std::vector<Wrench>& wrenches() const;
  RodEnergies energies(const RodState& state, const Eigen::Vector3d& gravity) const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
