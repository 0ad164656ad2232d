#pragma once

#include <memory>
#include <vector>

#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/rod/rigid_body.h"
#include "slender_sim/rod/rod_stepper.h"

namespace slender {

/// What may touch in a group. Points of the contact surface are the nodes of the rods named here, one rod after the
/// other.
struct GroupContact
{
  struct Rod
  {
    int rod = 0;
    bool self = true, others = true, solids = true;
    double friction = 0.3;
  };
  struct Obstacle
  {
    Shape shape;
    double friction = -1.0;
  };   ///< negative: that of what touches it
  struct Body
  {
    int body = 0;
    Shape shape;
    Pose X_BS;
    double friction = -1.0;
  };
  std::vector<Rod> rods;
  std::vector<Obstacle> obstacles;
  std::vector<Body> bodies;
  ContactOptions options;
};

/// Rods that are stepped together, because bodies join them or because they may touch.
struct RodGroupModel
{
  std::vector<std::shared_ptr<const RodModel>> rods;
  std::vector<RigidBodyModel> bodies;
  std::vector<Weld> welds;   ///< indices into rods and bodies
  GroupContact contact;      ///< no rods: nothing touches
};

struct RodGroupState
{
  std::vector<RodState> rods;
  std::vector<RigidBodyState> bodies;
  std::vector<Pose> obstacles;
  std::vector<Twist> obstacle_velocities;
  double contact_stiffness = 0.0;   ///< [N], 0: not chosen yet
};

/// Inputs latched once per step. Entries of welded grasps and of simulated bodies are ignored.
struct RodGroupInputs
{
  std::vector<RodInputs> rods;
  std::vector<GraspTarget> bodies;   ///< where driven bodies are at the end of the step
  std::vector<GraspTarget> obstacles;
  Eigen::Vector3d gravity{0, 0, -9.81};
};

/// Welds a rod's section or edges, as they lie now, to a body: appends the grasp to the rod's state and returns the
/// weld.
Weld makeWeld(RodGroupModel& model, RodGroupState& state, int rod, int first_node, int last_node, int body);

/// Advances a group: one implicit system for rods, bodies and contact, or explicit steps with projection.
class RodGroup
{
public:
  /// Throws std::invalid_argument naming what does not fit together.
  RodGroup(RodGroupModel model, const TimeConfig& time);
  ~RodGroup();
  RodGroup(RodGroup&&) noexcept;

  /// Advances by `duration` [s]. On failure the state is untouched and the report says why.
  StepReport step(RodGroupState& state, const RodGroupInputs& inputs, double duration);

  /// Equilibrium under the inputs, without friction: implicit Euler steps that grow, from rest each time. Velocities
  /// become zero. An unstable equilibrium is left along its mode of negative curvature, until a stable one is found or
  /// every way was tried; then report.stable is false. `leave_saddles` false: it is kept.
  StepReport solveEquilibrium(RodGroupState& state, const RodGroupInputs& inputs, bool leave_saddles = true);

  /// Throws std::invalid_argument when something touches or crosses in this state, naming what.
  void checkClearance(const RodGroupState& state);
  /// Smallest distance between surfaces [m], up to the gap at which they repel.
  double clearance(const RodGroupState& state);

  const std::vector<Wrench>& wrenches(int rod) const;
  RodEnergies energies(int rod, const RodState& state, const Eigen::Vector3d& gravity) const;
  const RodGroupModel& model() const;
  const std::vector<ContactTerm>& contacts() const;   ///< of the last step; empty without contact
  void setThreads(int threads);

  class Impl;

private:
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
