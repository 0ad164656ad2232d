#pragma once

#include <vector>

#include "island/chain_part.h"
#include "slender_sim/contact/contact_properties.h"
#include "thread_work.h"

namespace slender {

/// A thread as a part of an island. If it touches something, all its nodes are surface points. Those that lie on a
/// floor which they stick to move with that floor and have no unknowns.
class ThreadPart : public ChainPart
{
public:
  explicit ThreadPart(ThreadWork& thread) : ChainPart(thread.system), thread_(thread) {}

  ThreadWork& thread() const { return thread_; }

  /// What the thread touches; without a call nothing. `owner` is the number of the thread of which it is a part.
  /// `merging`: as WorldModel::Thread::merging.
  void setContact(const ContactProperties& contact, double merging, int owner)
  {
    touches_ = true;
    contact_ = contact;
    merging_ = merging;
    owner_ = owner;
  }
  double merging() const { return merging_; }
  int owner() const { return owner_; }
  /// In the steps below: what a change of shape may not come near (null: nothing).
  void setGuard(const RemeshGuard* guard) { guard_ = guard; }
  int points() const override { return touches_ ? thread_.work.nodes() : 0; }
  void addSurface(ContactSurface& surface) const override;

private:
  // ---- as Part
  int nodeOf(int point) const override { return thread_.inSystem(point); }
  bool numberUnknowns() override;
  void placeHeld(double fraction) override;
  bool heldMoves(double from, double to) const override;
  void retreatHeld(double share) override;
  void gather(Eigen::Matrix3Xd& x) const override;
  void gatherStart(Eigen::Matrix3Xd& x) const override;

  // ---- its steps
  double longestSubstep(double duration) const override { return thread_.longestSubstep(duration); }
  double shortestEdge() const override { return system_.leastRestLength(); }
  StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) override;
  bool surfaceChanges() const override { return true; }
  BoundingBox surfaceBox(double ahead) const override;
  BarrierRange barrierRange(double gap) const override;
  bool meetsMore() override { return thread_.firstLanding() <= 1.0; }
  void holdMore() override;
  StepFailure predict(const Substep& substep, StepReport&) override { return thread_.explicitPredict(substep); }
  StepFailure finishSubstep(StepReport&) override
  {
    thread_.finish();
    return StepFailure::none;
  }
  StepFailure changeMesh() override { return thread_.changeMesh(guard_); }
  void acceptSubstep(const Substep&) override {}   // finishSubstep() changed the present state
  bool shorterMayHelp(StepFailure failure) const override;
  double sharpestFold() const override;
  bool mend() override;
  Largest unbalancedForce() const override { return thread_.unbalancedForce(); }
  void refuse(StepFailure failure, double length, StepReport& report) const override;

  /// Keeps where nodes that are held or lie will be at the end of the substep, once it has begun.
  void noteEnds();
  bool isHeld(int node) const { return nodeOf(node) >= 0 && !system_.isFree(nodeOf(node)); }
  Eigen::Vector3d lying(int node) const { return thread_.work.x[node] + share_ * (end_[node] - thread_.work.x[node]); }

  ThreadWork& thread_;
  bool touches_ = false;
  ContactProperties contact_;
  double merging_ = 0.0;
  int owner_ = 0;
  const RemeshGuard* guard_ = nullptr;
  double share_ = 1.0;                 ///< of the substep, at which what is held stands in the trial
  std::vector<Eigen::Vector3d> end_;   ///< per node that is held or lies: its place at the end of the substep
};

}   // namespace slender
