#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "slender_sim/cloth/cloth_state.h"
#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/contact/contact_surface.h"
#include "slender_sim/rod/rigid_body.h"
#include "slender_sim/rod/rod_state.h"
#include "slender_sim/rod/rod_stepper.h"
#include "slender_sim/thread/thread_group.h"
#include "slender_sim/thread/thread_stepper.h"
#include "slender_sim/tracking/function_blend.h"

namespace slender {

/// The guide of a tracked rod or cloth at one instant; of other parts all of it is empty.
struct GuideState
{
  Eigen::Matrix3Xd points;     ///< nodes or vertices of the guide [m]
  Eigen::Matrix3Xd velocity;   ///< over the last step [m/s]; of cloths with several sets of test functions
  Eigen::Matrix3Xd forces;     ///< with which the guide acted in the last step, per test function [N]
  FunctionBlend blend;         ///< of the set in force, which ClothState::average_set names
};

/// An object by its number among those of its kind in the world.
struct ObjectRef
{
  enum Kind : int
  {
    rod,
    cloth,
    body,   ///< where contact is meant, its solid
    obstacle
  };
  int kind = obstacle, index = 0;
  bool isCloth() const { return kind == cloth; }
  bool operator<(const ObjectRef& b) const { return kind != b.kind ? kind < b.kind : index < b.index; }
  bool operator==(const ObjectRef& b) const { return kind == b.kind && index == b.index; }
};

/// A spring of friction between an object and a partner, see FrictionSpring.
struct ContactSpring
{
  ObjectRef partner;
  int piece = 0;
  std::array<int, 4> point{-1, -1, -1, -1};
  Eigen::Vector3d tension{0, 0, 0};   ///< [N]
};

/// An obstacle or a body that a body repels only within a share of the gap, because they started that close together.
struct ContactRange
{
  ObjectRef partner;
  double share = 1.0;   ///< of the gap, in (0, 1]
};

/// What contact by the barrier keeps of an object from one step to the next.
struct ContactMemory
{
  BarrierLaw barrier;
  std::vector<ContactSpring> springs;
  std::vector<ContactRange> ranges;   ///< of a body, from the start on
};

/// Per object. The lists are as long as those of the state, or empty where no object can meet another one by the
/// barrier.
struct ContactMemories
{
  std::vector<ContactMemory> rods, threads, bodies, cloths;
};

/// A force of contact and where it acts.
struct ContactForce
{
  Eigen::Vector3d position;   ///< [m]
  Eigen::Vector3d force;      ///< on what touches, a solid excepted [N]
};

/// The contacts by the barrier, and the sum of their forces on each obstacle and body. Torques are about the world's
/// origin.
struct ContactLoads
{
  std::vector<ContactForce> contacts;
  std::vector<Wrench> obstacles, bodies;
};

/// Everything that changes while a world moves; saving and restoring it restarts bit-equal.
struct WorldState
{
  double time = 0.0;   ///< simulated [s] = steps * step length
  std::uint64_t steps = 0;
  std::vector<RodState> rods;              ///< each with its own grasps first, then those of its welds
  std::vector<GuideState> rod_guides;      ///< per rod; none where no rod tracks anything
  std::vector<ThreadGroupState> threads;   ///< per thread: it and what has broken off it
  std::vector<ClothState> cloths;
  std::vector<GuideState> cloth_guides;   ///< per cloth; none where no cloth tracks anything
  std::vector<RigidBodyState> bodies;     ///< driven ones included
  std::vector<Pose> obstacles;
  std::vector<Twist> obstacle_velocities;
  ContactMemories contact;
  std::vector<std::array<Wrench, 2>> end_loads;   ///< per thread, of the last step

  /// The nodes of a rod or the vertices of a cloth [m].
  const Eigen::Matrix3Xd& points(const ObjectRef& of) const
  {
    return of.isCloth() ? cloths[of.index].x : rods[of.index].x;
  }
  /// The guide of a rod or a cloth.
  const GuideState& guide(const ObjectRef& of) const { return (of.isCloth() ? cloth_guides : rod_guides)[of.index]; }
  GuideState& guide(const ObjectRef& of) { return (of.isCloth() ? cloth_guides : rod_guides)[of.index]; }
};

/// Inputs of one step, latched before it. All lists are as long as those of the model, except where something else is
/// said.
struct WorldInputs
{
  Eigen::Vector3d gravity{0, 0, -9.81};   ///< of bodies [m/s^2]
  std::vector<RodInputs> rods;            ///< grasps of welds are ignored
  std::vector<ThreadInputs> threads;
  std::vector<ClothInputs> cloths;   ///< averages of tracked cloths are ignored: they follow from the guides
  std::vector<GraspTarget> bodies;   ///< at the end of the step; simulated ones are ignored
  std::vector<GraspTarget> obstacles;
  /// Points of the guides at the end of the step (3 x n [m]), see TrackedGuide::input. The guide of a cloth that
  /// follows another cloth is ignored.
  std::vector<Eigen::Matrix3Xd> guides;
};

}   // namespace slender
