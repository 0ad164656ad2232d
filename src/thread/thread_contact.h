#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "../contact/confined_newton.h"
#include "../contact/coupled_chains.h"
#include "merging.h"
#include "slender_sim/thread/touching_threads.h"
#include "thread_loop.h"

namespace slender {

/// Equations of threads with contact and merging, for minimize(). Threads that nothing touches keep their own band
/// matrices; the others share one sparse matrix (CoupledChains).
class ThreadContact : public RemeshGuard
{
public:
  explicit ThreadContact(const TouchingModel& model);

  struct Thread
  {
    ThreadStepper::Impl* thread;
    int kind;   ///< index into the model's threads
  };

  // ---- a step (thread_contact_step.cpp)
  /// Of these threads; obstacles move from `from` to `to` in `duration` seconds, floors with the velocities `belts` of
  /// the model's threads.
  void beginStep(const std::vector<Thread>& threads, const std::vector<Pose>& from, const std::vector<Pose>& to,
                 const std::vector<Eigen::Vector3d>& belts, double duration, double stiffness);
  /// A substep of h seconds from the fraction `from` of the step to `to`, after all threads' prepare().
  StepFailure solve(double from, double to, double h, StepReport& report);
  double stiffness() const { return stiffness_now_; }
  double clearance(const std::vector<const ThreadState*>& states, const std::vector<int>& kinds,
                   const std::vector<Pose>& obstacles);
  /// After clearance() of the same: the two that are nearest to each other, "thread 'honey' and obstacle 'plate'".
  std::string nearest(const std::vector<const ThreadState*>& states, const std::vector<Pose>& obstacles) const;
  const std::vector<ContactTerm>& terms() const { return contact_.terms(); }
  bool allows(const ThreadState& state, int first, int last, const Eigen::Vector3d& from,
              const Eigen::Vector3d& to) const override;
  bool mayJoin(const ThreadState& state, int i) const override;

  // ---- the system of a substep, as minimize() needs it (thread_contact.cpp)
  RodEvaluation evaluate(bool with_hessian, const HessianShift& shift = {});
  void solve();
  void moveAlong(double alpha);
  void accept();
  void saveBase();
  void restoreBase();
  double stepLimit();
  double incrementSize() const;
  static constexpr bool anglesMayKeepShift() { return false; }
  static constexpr double mostUnbalanced() { return ThreadSystem::mostUnbalanced(); }
  double slope() const;
  double residual() const;
  double forceScale() const;
  double noiseLevel() const;

  // ---- and minimizeConfined()
  Approach approach(double from, double to, double& reached);
  void placeHeld(double to);
  void resolve(double tolerance, double gap_tolerance) { tolerance_ = tolerance, gap_tolerance_ = gap_tolerance; }
  ContactPotential& contact() { return contact_; }

private:
  struct Part : CoupledChains::Chain
  {
    ThreadStepper::Impl* thread = nullptr;
    int kind = 0;
    int point = 0;   ///< its first contact point
  };
  const ThreadSystem& systemOf(const Part& part) const { return part.thread->system; }
  const std::vector<ContactTerm>* attractions() const { return merges_ ? &merging_.terms() : nullptr; }

  /// Calls f(other, j, core) for every edge that the edges first to last of `state` may touch; stops and returns false
  /// when f does.
  template <class F>
  bool forOthers(const ThreadState& state, int first, int last, F&& f) const;
  void addCurve(const ThreadState& state, int kind);
  bool load(double from, double h);
  void gather(Eigen::Matrix3Xd& x) const;
  void placeSolids(double fraction, std::vector<Pose>& solids) const;
  void mapUnknowns();
  void buildPattern();
  void assemble(const HessianShift& shift, bool whole);

  const TouchingModel& model_;
  ContactPotential contact_;
  double first_stiffness_;   ///< of the barrier in a state that has none yet
  MergingPotential merging_;
  bool merges_ = false;
  std::vector<Part> parts_;
  std::size_t part_count_ = 0;   ///< of parts_ in use
  double duration_ = 0, least_edge_ = 0, stiffness_now_ = 0;
  std::vector<Pose> solids_from_, solids_to_;   ///< over the step
  Eigen::Matrix3Xd points_, points_base_, points_end_, points_target_;
  std::vector<Pose> solids_, solids_base_, solids_end_;
  std::vector<ContactSegment> segments_;   ///< with their full radii
  std::vector<ContactObject> objects_;
  std::vector<MergingFluid> fluids_;   ///< per object
  std::vector<char> held_;             ///< per point
  /// of increments: over the shortest edge, and at contacts over the smallest gap
  double tolerance_ = 0, gap_tolerance_ = 0;

  CoupledChains coupled_{true};
};

}   // namespace slender
