#pragma once

#include <vector>

#include "rod_stepper_impl.h"
#include "slender_sim/dynamics/fast_projection.h"
#include "slender_sim/rod/rod_group.h"

namespace slender {

/// Explicit substeps of rods and of the bodies they are welded to (thesis 4.6.1): forces at the start, torques handed
/// to the bodies (4.5.3), velocities and positions, projection of inextensible rods and their bodies (4.5.2), frames.
class ExplicitSystem
{
public:
  /// `group` null: a single rod.
  ExplicitSystem(const RodGroupModel* group, const std::vector<RodStepper::Impl*>& rods);

  void begin(const RodGroupState& state, const RodGroupInputs& inputs, double duration);
  /// `failed`: the rod that a failure is about.
  StepFailure step(const RodInputs* inputs, double duration, double t, double h, StepReport& report,
                   std::size_t& failed);
  void commitStep() { bodies_now_ = bodies_next_; }
  void end(RodGroupState& state);

private:
  /// A simulated body together with the nodes welded to it, whose masses it carries.
  struct Body
  {
    int index = 0;   ///< in the group
    double mass = 0;
    Eigen::Vector3d centre{0, 0, 0};                         ///< of all masses, body axes
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();   ///< about it
    Pose start, predicted;                                   ///< of the centre
    Twist velocity;                                          ///< likewise
  };

  void composeBodies();
  void predictBody(Body& body, double h);
  void placeBody(Body& body, const Pose& X, const Twist& velocity);
  void placeStart(const Body& body, const Pose& X);
  StepFailure project(double h, bool start_only, StepReport& report, std::size_t& failed);
  bool isWelded(const RodStepper::Impl& rod, const Weld& weld) const;

  const RodGroupModel* model_;
  std::vector<RodStepper::Impl*> rods_;
  std::vector<int> chains_;   ///< per rod: its number in the projection, -1: it stretches
  std::vector<Body> bodies_;
  FastProjection projection_;                              ///< its bodies are numbered as bodies_
  std::vector<RigidBodyState> bodies_now_, bodies_next_;   ///< all of the group
  const RodGroupState* origin_ = nullptr;
  const RodGroupInputs* inputs_ = nullptr;
  double duration_ = 0;
  bool inextensible_ = false;
  std::vector<int> owner_;   ///< per node of a rod: -1 free, -2 held, or a body
  std::vector<Eigen::Vector3d> arm_;
};

}   // namespace slender
