#pragma once

#include <string>

#include "slender_sim/dynamics/newton.h"
#include "slender_sim/thread/thread_stepper.h"
#include "slender_sim/thread/thread_system.h"

namespace slender {

/// A thread's part in a step and its work space, which is reused from step to step.
///
/// Deposited nodes move with the floor and need no equations: the system holds only the active part of the thread, from three nodes
/// before its oldest free node on. A held end adds the inside of its holder as one more edge, so that its section is an ordinary joint.
class ThreadStepper::Impl
{
public:
  Impl(std::shared_ptr<const ThreadModel> m, const NewtonConfig& n, bool is_explicit) : model(std::move(m)), newton(n), explicit_step(is_explicit) {}

  StepReport step(ThreadState& state, const ThreadInputs& inputs, double duration);

  std::shared_ptr<const ThreadModel> model;
  NewtonConfig newton;
  bool explicit_step;
  std::array<EndLoad, 2> loads;

private:
  bool inputsFinite(const ThreadState& state, const ThreadInputs& inputs, double duration, std::string& what) const;
  StepReport refuse(StepReport& report, StepFailure failure, const std::string& message) const;
  std::string explainFailure(StepFailure failure, double length) const;

  StepFailure substep(const ThreadInputs& inputs, double from, double to, double duration, StepReport& report);
  bool loadSystem(double h);
  void setResponse(const ThreadInputs& inputs, double h);
  void setTrial(const ThreadInputs& inputs, double h);
  StepFailure solve(const ThreadInputs& inputs, double h, StepReport& report);
  StepFailure move(const ThreadInputs& inputs, double h);
  void push(double h);
  bool land(const ThreadInputs& inputs, double h);
  void finish(const ThreadInputs& inputs, double h);
  bool remesh();
  int foldedNode() const;
  EndLoad endLoad(int end) const;
  double fedVolume(double h) const { return flow_speed_ * model->nozzleArea() * h; }
  /// Volume of an edge with what flows in during the substep.
  double volume(int j, double h) const { return work.volume[j] + (j + 2 == work.nodes() && work.ends[1].held ? fedVolume(h) : 0.0); }
  bool endHeld(int node) const { return (node == 0 && work.ends[0].held) || (node + 1 == work.nodes() && work.ends[1].held); }
  /// Both its nodes lie on the floor: it moves as a solid.
  bool isSolid(int j) const { return work.deposited[j] && work.deposited[j + 1]; }
  /// Where a held end goes on this substep.
  Pose endPose(int end, const ThreadInputs& inputs, double fraction) const;
  double restingHeight(int node) const;
  double deformingShare(int j) const;

  int inSystem(int node) const { return node - first_ + offset_; }
  int lastInSystem() const { return inSystem(work.nodes() - 1); }

  ThreadSystem system;
  ThreadState work;
  std::array<ThreadEnd, 2> start_ends;   ///< at the start of the step
  std::array<Pose, 2> end_poses;         ///< at the end of the substep
  std::vector<char> landed;              ///< per node: touched the floor in this substep
  double flow_speed_ = 0;                ///< out of the nozzle [m/s]
  int first_ = 0, offset_ = 0;           ///< the oldest active node, and its number in the system
};

}  // namespace slender
