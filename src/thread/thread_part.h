#pragma once

#include <vector>

#include "../contact/chain_part.h"
#include "thread_stepper_impl.h"

namespace slender {

/// A thread as a part of an island. All its nodes are surface points. Those that lie on a floor which they stick to move
/// with that floor and have no unknowns.
class ThreadPart : public ChainPart
{
public:
  explicit ThreadPart(ThreadStepper::Impl& thread) : ChainPart(thread.system), thread_(thread) {}

  ThreadStepper::Impl& thread() const { return thread_; }
  /// A substep of h seconds between these fractions of the step, after the thread's prepare().
  void begin(double from, double to, double h);
  /// Nodes have been held where they met the floor: they go there from the base.
  void holdLanded();

  bool numberUnknowns() override;
  void placeHeld(double fraction) override;
  bool heldMoves(double from, double to) const override;
  void retreatHeld(double share) override;
  int points() const override { return thread_.work.nodes(); }
  void gather(Eigen::Matrix3Xd& x) const override;
  void gatherStart(Eigen::Matrix3Xd& x) const override;

protected:
  int nodeOf(int point) const override { return thread_.inSystem(point); }

private:
  bool isHeld(int node) const { return nodeOf(node) >= 0 && !system_.isFree(nodeOf(node)); }
  Eigen::Vector3d lying(int node) const { return thread_.work.x[node] + share_ * (end_[node] - thread_.work.x[node]); }

  ThreadStepper::Impl& thread_;
  double from_ = 0.0, to_ = 1.0;
  double share_ = 1.0;                  ///< of the substep, at which what is held stands in the trial
  std::vector<Eigen::Vector3d> end_;    ///< per node that is held or lies: its place at the end of the substep
};

}   // namespace slender
