#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../contact/island_system.h"
#include "merging.h"
#include "slender_sim/thread/touching_threads.h"
#include "thread_loop.h"
#include "thread_part.h"

namespace slender {

/// Steps of threads with contact and merging: the parts of an island, and their substeps.
class ThreadContact : public RemeshGuard
{
public:
  explicit ThreadContact(const TouchingModel& model);

  struct Thread
  {
    ThreadStepper::Impl* thread;
    int kind;   ///< index into the model's threads
  };

  /// A step of these threads; obstacles move from `from` to `to` in `duration` seconds, floors with the velocities
  /// `belts` of the model's threads.
  void beginStep(const std::vector<Thread>& threads, const std::vector<Pose>& from, const std::vector<Pose>& to,
                 const std::vector<Eigen::Vector3d>& belts, double duration, double stiffness);
  /// A substep of h seconds from the fraction `from` of the step to `to`, after all threads' prepare().
  StepFailure solve(double from, double to, double h, StepReport& report);
  double stiffness() const { return stiffness_now_; }
  double clearance(const std::vector<const ThreadState*>& states, const std::vector<int>& kinds,
                   const std::vector<Pose>& obstacles);
  /// After clearance() of the same: the two that are nearest to each other, "thread 'honey' and obstacle 'plate'".
  std::string nearest(const std::vector<const ThreadState*>& states, const std::vector<Pose>& obstacles) const;
  const std::vector<ContactTerm>& terms() const { return island_.contact()->terms(); }
  bool allows(const ThreadState& state, int first, int last, const Eigen::Vector3d& from,
              const Eigen::Vector3d& to) const override;
  bool mayJoin(const ThreadState& state, int i) const override;

private:
  /// Calls f(other, j, core) for every edge that the edges first to last of `state` may touch; stops and returns false
  /// when f does.
  template <class F>
  bool forOthers(const ThreadState& state, int first, int last, F&& f) const;
  const ThreadState& stateOf(std::size_t thread) const { return threads_[thread].thread->work; }
  void addCurve(const ThreadState& state, int kind);
  bool load(double from, double to, double h);
  void setStiffness(double h);

  const TouchingModel& model_;
  double first_stiffness_;   ///< of the barrier in a state that has none yet
  MergingPotential merging_;
  bool merges_ = false;
  std::vector<Thread> threads_;
  std::vector<std::unique_ptr<ThreadPart>> parts_;   ///< of threads that have been in an island so far
  std::vector<ThreadPart*> used_;                    ///< per thread: its part
  std::vector<Part*> island_parts_;                  ///< the same
  double duration_ = 0, stiffness_now_ = 0;
  std::vector<ContactSegment> segments_;   ///< with their full radii
  std::vector<ContactObject> objects_;
  std::vector<MergingFluid> fluids_;   ///< per object
  std::vector<char> held_;             ///< per point
  IslandSystem island_{true};
};

}   // namespace slender
