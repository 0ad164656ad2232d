#pragma once

#include <vector>

#include "rod_stepper_impl.h"
#include "slender_sim/dynamics/fast_projection.h"
#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/rod/rigid_body.h"

namespace slender {

/// Explicit steps of rods and of the bodies they are welded to (thesis 4.6.1): forces at the start, torques handed to
/// the bodies (4.5.3), velocities and positions, projection of inextensible rods and their bodies (4.5.2), frames.
class ExplicitSystem : SubstepEquations
{
public:
  /// A simulated body and the number by which welds and states know it.
  struct SimulatedBody
  {
    int number;
    const RigidBodyModel* model;
  };
  /// `welds` with other bodies than these have no effect. A weld names its rod by the place in `rods`. The rods must
  /// outlive the system.
  ExplicitSystem(const TimeConfig& time, const std::vector<RodStepper::Impl*>& rods,
                 const std::vector<SimulatedBody>& bodies = {}, std::vector<Weld> welds = {});

  /// Inputs of a rod in the next step. They must live as long as the step.
  void setInputs(std::size_t rod, const RodInputs& inputs) { rods_[rod].inputs = &inputs; }
  /// Loads the bodies for a step. `bodies` holds the states of all bodies, by their numbers; gravity [m/s^2].
  void begin(const std::vector<RigidBodyState>& bodies, const Eigen::Vector3d& gravity);
  /// Advances the rods, which have been loaded, and the bodies by `duration` [s]. On failure the report says why.
  StepReport step(double duration);
  void end(std::vector<RigidBodyState>& bodies) const;

private:
  StepFailure attempt(const Substep& substep, StepReport& report) override;
  void accept(const Substep& substep) override;
  /// Explicit steps have one length, on which their stability depends.
  bool shorterMayHelp(StepFailure) const override { return false; }
  void refuse(const Substep& substep, StepFailure failure, StepReport& report) override;

  /// A simulated body together with the nodes welded to it, whose masses it carries.
  struct Body
  {
    int number;
    const RigidBodyModel* model;
    RigidBodyState now, next;   ///< at the start and the end of the substep
    double mass = 0;
    Eigen::Vector3d centre{0, 0, 0};                         ///< of all masses, body axes
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();   ///< about it
    Pose start, predicted;                                   ///< of the centre
    Twist velocity;                                          ///< likewise
  };

  void composeBodies();
  void predictBody(Body& body, double h);
  void placeBody(Body& body, const Pose& X, const Twist& velocity);
  void placeStart(Body& body, const Pose& X);
  StepFailure project(double h, bool start_only, StepReport& report);
  bool isWelded(const Weld& weld) const;

  struct Rod
  {
    RodStepper::Impl* rod;
    int chain;   ///< its number in the projection, -1: it stretches
    const RodInputs* inputs;
  };
  const TimeConfig time_;
  double duration_ = 0.0;    ///< of the present step [s]
  std::size_t failed_ = 0;   ///< rod that the last failure is about
  std::vector<Rod> rods_;
  std::vector<Body> bodies_;
  const std::vector<Weld> welds_;
  FastProjection projection_;   ///< its bodies are numbered as bodies_
  Eigen::Vector3d gravity_{0, 0, 0};
  bool inextensible_ = false;
  std::vector<int> owner_;   ///< per node of a rod: -1 free, -2 held, or a body
  std::vector<Eigen::Vector3d> arm_;
};

}   // namespace slender
