#pragma once

#include <string>

#include "slender_sim/dynamics/substep_controller.h"
#include "slender_sim/thread/thread_remesh.h"
#include "slender_sim/thread/thread_stepper.h"
#include "slender_sim/thread/thread_system.h"

namespace slender {

/// The working copy of a thread: its part in a step and its work space, which is reused from step to step.
///
/// Deposited nodes move with the floor and need no equations. The system holds only the active part of the thread, from
/// three nodes before its oldest free node on. A held end adds the inside of its holder as one more edge, so that its
/// section is an ordinary joint.
class ThreadWork
{
public:
  ThreadWork(std::shared_ptr<const ThreadModel> m, const NewtonConfig& n, bool is_explicit)
    : model(std::move(m)),
      newton(n),
      explicit_step(is_explicit)
  {
  }

  // ---- a step in substeps
  /// Returns false if an input or the state is not sound. The report then says so.
  bool accepts(const ThreadState& state, const ThreadInputs& inputs, double duration, StepReport& report) const;
  /// Takes a step of `duration` [s] from a state that it accepts. The inputs must live until the end of the step.
  void begin(const ThreadState& state, const ThreadInputs& step_inputs, double step_duration);
  /// Of a substep: no more than an edge leaves the nozzle at a time, and ThreadLimits::max_step.
  double longestSubstep(double duration) const
  {
    const double longest = std::min(duration, model->limits.max_step);
    return flow_speed_ > 0 ? std::min(longest, model->feed_length / flow_speed_) : longest;
  }
  /// The equations of a substep and a first guess.
  StepFailure beginSubstep(const Substep& next_substep);
  /// Explicit substep, first half: everything goes on as it moves. What resists this motion is then known.
  StepFailure explicitPredict(const Substep& next_substep);
  /// Takes the solution over as the present state. After an explicit substep the forces change the velocities.
  void finish();
  /// Divides, joins and takes away edges, as far as the guard (may be null) allows.
  StepFailure changeMesh(const RemeshGuard* guard);
  /// Returns the inner node at which the last trial turns most, if that is more than a right angle; -1 without one.
  /// `cosine`: as in ThreadSystem::sharpestJoint().
  int foldedNode(double& cosine) const;
  /// The edge whose section has grown beyond what a thread can be; -1: there is none. See explainFailure().
  int overgrownEdge() const;
  /// "thread 'honey': ", for messages.
  std::string nameOf(const ThreadState& state) const;
  std::string explainFailure(StepFailure failure, double length) const;
  std::string explainDisc(int node) const;
  /// Largest unbalanced force [N] on a free node in the last evaluation, by the thread's numbers of nodes.
  Largest unbalancedForce() const;
  /// Refuses a step of `length` seconds that could not be solved. The message says why and where the thread was
  /// farthest from a solution.
  StepReport refuseUnsolved(StepReport& report, StepFailure failure, double length) const;

  /// When the first node goes through the floor, as a fraction of the substep; above 1: none does.
  double firstLanding() const;
  /// Stops the nodes that meet the floor at about that time, and holds them at the place where they meet it. Returns
  /// false if none does.
  bool stopLanding();

  bool endHeld(int node) const
  {
    return (node == 0 && work.ends[0].held) || (node + 1 == work.nodes() && work.ends[1].held);
  }
  bool isHeld(int node) const { return work.deposited[node] || endHeld(node); }
  /// Its number in the system; less than 0: it lies on the floor and moves with that.
  int inSystem(int node) const { return node < first_ ? -1 : node - first_ + offset_; }
  int lastInSystem() const { return inSystem(work.nodes() - 1); }
  /// Puts a node of the system somewhere, and with an end the inside of its holder.
  void placeNode(int node, const Eigen::Vector3d& x);

  ThreadSystem system;
  ThreadState work;
  std::shared_ptr<const ThreadModel> model;
  NewtonConfig newton;
  bool explicit_step;
  std::array<Wrench, 2> loads;
  const ThreadInputs* inputs = nullptr;   ///< of the step
  double duration = 1.0;                  ///< of the step [s]
  Substep substep;

private:
  bool inputsFinite(const ThreadState& state, const ThreadInputs& inputs, double duration, std::string& what) const;
  bool loadSystem();
  void setResponse();
  void setTrial();
  void push();
  /// Returns false if the step would take more edges than a motion can mean.
  bool remesh(const RemeshGuard* guard);
  bool meetsFloor(int node, double& when) const;
  void restBetweenLying();
  void split(int j, double fraction, const RemeshGuard* guard);
  Wrench endLoad(int end) const;
  double flowSpeed(const ThreadInputs& step_inputs) const
  {
    return step_inputs.flow_rate > 0 ? step_inputs.flow_rate / model->nozzleArea() : 0.0;
  }
  double fedVolume() const { return flow_speed_ * model->nozzleArea() * substep.length; }
  /// Volume of an edge with what flows in during the substep.
  double volume(int j) const
  {
    return work.volume[j] + (j + 2 == work.nodes() && work.ends[1].held ? fedVolume() : 0.0);
  }
  /// Both its nodes lie on the floor: it moves as a solid.
  bool isSolid(int j) const { return work.deposited[j] && work.deposited[j + 1]; }
  /// Where a held end is at a fraction of the step.
  Pose endPose(int end, double fraction) const;
  double restingHeight(int node) const;
  double deformingShare(int j) const;
  double spinWithFed(int j, double area) const;
  double longestEdge(int j) const;

  std::array<ThreadEnd, 2> start_ends;   ///< at the start of the step
  std::array<Pose, 2> end_poses;         ///< at the end of the substep
  std::vector<char> landed;              ///< per node: touched the floor in this substep
  double flow_speed_ = 0;                ///< out of the nozzle [m/s]
  int first_ = 0, offset_ = 0;           ///< the oldest active node, and its number in the system
};

}   // namespace slender
