#pragma once

#include <memory>
#include <vector>

#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/geometry/pose_motion.h"
#include "slender_sim/rod/rod_model.h"
#include "slender_sim/rod/rod_state.h"
#include "slender_sim/dynamics/time_config.h"

namespace slender {

/// Inputs of one rod, latched once per step. `grasps` is as long as RodState::grasps (entries of inactive grasps are
/// ignored).
struct RodInputs
{
  std::vector<GraspTarget> grasps;
  Eigen::Vector3d gravity{0, 0, -9.81};   ///< [m/s^2]
  Eigen::Vector3d wind{0, 0, 0};          ///< [m/s]
  Eigen::Matrix3Xd forces;                ///< extra nodal forces, 3 x n [N], or empty
  /// Torques about the tangents of the edges [N m], one per edge, or empty. They turn the material frames and go along
  /// where a tangent turns. Implicit midpoint and generalised alpha refuse them, since their check of the energy does
  /// not know the work of such a torque.
  Eigen::VectorXd torques;
};

struct RodEnergies
{
  double stretch = 0, bend = 0, twist = 0, kinetic = 0, gravity = 0;   ///< [J]
  double total() const { return stretch + bend + twist + kinetic + gravity; }
};

class RodWork;

/// Advances one rod: implicit steps as an island of one part, whose matrix is a band, or explicit symplectic Euler
/// (thesis 4.6).
class RodStepper
{
public:
  RodStepper(std::shared_ptr<const RodModel> model, const TimeConfig& time);
  ~RodStepper();
  RodStepper(RodStepper&&) noexcept;

  /// Advances by `duration` [s]. On failure the state is untouched and the report says why.
  StepReport step(RodState& state, const RodInputs& inputs, double duration);

  /// Static equilibrium under the inputs, reached by continuation; velocities become zero. An unstable equilibrium is
  /// left along its mode of negative curvature, until a stable one is found or every way was tried; then report.stable
  /// is false. `leave_saddles` false: it is kept.
  StepReport solveEquilibrium(RodState& state, const RodInputs& inputs, bool leave_saddles = true);
  /// Residual, energy, lowest eigenvalue and stability of a state that is an equilibrium under the inputs already.
  StepReport assessEquilibrium(const RodState& state, const RodInputs& inputs);
  /// Mode of the lowest eigenvalue of the last equilibrium: displacement of each node and turn of the edge after it (4
  /// x n, [m] and [rad]), scaled so that the edge that turns most turns by 1 rad.
  Eigen::Map<const Eigen::Matrix4Xd> lowestMode() const;

  /// Of the last successful step() or solveEquilibrium(); one per grasp, zero for inactive ones. They belong to the
  /// instant at which the step balances forces: its end, but its middle for implicit_midpoint and 1 / (1 +
  /// spectral_radius) of it for generalized_alpha.
  const std::vector<Wrench>& wrenches() const;

  RodEnergies energies(const RodState& state, const Eigen::Vector3d& gravity) const;

  const RodModel& model() const;

  /// Islands of several parts use the working copy.
  RodWork& work() { return *work_; }

private:
  struct Alone;
  bool accepts(const RodState& state, const RodInputs& inputs, StepReport& report);

  std::unique_ptr<RodWork> work_;
  std::unique_ptr<Alone> alone_;   ///< of steps and equilibria; null before the first one
};

}   // namespace slender
