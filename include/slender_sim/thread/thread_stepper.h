#pragma once

#include <array>
#include <memory>

#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/dynamics/time_config.h"
#include "slender_sim/thread/thread_model.h"
#include "slender_sim/thread/thread_state.h"

namespace slender {

/// Inputs of one thread, latched once per step.
struct ThreadInputs
{
  Eigen::Vector3d gravity{0, 0, -9.81};                      ///< [m/s^2]
  std::array<Pose, 2> ends;                                  ///< where the held ends shall be at the end of the step
  double flow_rate = 0.0;                                    ///< [m^3/s] out of the nozzle during the step, >= 0
  Eigen::Vector3d belt_velocity = Eigen::Vector3d::Zero();   ///< [m/s] of the floor; what has landed moves with it
};

/// Advances one viscous thread (thesis 5.3): the rod's energies with viscous stiffnesses, their rest strains those at
/// the start of the step. implicit_euler for use; symplectic_euler, stable only for steps of about rho l^2 / (6 mu) at
/// the shortest edge l, for comparison.
class ThreadStepper
{
public:
  /// Throws std::invalid_argument for a model that is not valid, or another integrator.
  ThreadStepper(std::shared_ptr<const ThreadModel> model, const NewtonConfig& newton,
                Integrator integrator = Integrator::implicit_euler);
  ~ThreadStepper();
  ThreadStepper(ThreadStepper&&) noexcept;
  ThreadStepper& operator=(ThreadStepper&&) noexcept;

  /// Advances by `duration` [s]. On failure the state is untouched and the report says why.
  StepReport step(ThreadState& state, const ThreadInputs& inputs, double duration);

  /// At the end of the last successful step; zero for a free end.
  const std::array<Wrench, 2>& endLoads() const;

  const ThreadModel& model() const;

private:
  struct Alone;
  std::unique_ptr<Alone> alone_;
};

}   // namespace slender
