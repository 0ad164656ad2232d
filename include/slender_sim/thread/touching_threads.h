#pragma once

#include <memory>
#include <string>
#include <vector>

#include "slender_sim/contact/contact_potential.h"
#include "slender_sim/thread/thread_group.h"

namespace slender {

/// What one thread touches. Parts that broke off it count as other threads.
struct ThreadTouch
{
  bool self = true, others = true, solids = true;
  double friction = 0.3;   ///< Coulomb [-]
  /// Surface tension draws parts that touch into each other (thesis 5.4.3), until the distance of their centrelines is
  /// this share of the sum of their radii; there they touch. 0: they do not merge. Half discs of one round section have
  /// their centroids at 0.6.
  double merging = 0.0;
};

/// Threads that may touch each other, themselves or obstacles, and so are stepped together.
struct TouchingModel
{
  /// friction negative: that of the thread
  struct Obstacle
  {
    Shape shape;
    double friction = -1.0;
    std::string name = {};
  };
  std::vector<std::shared_ptr<const ThreadModel>> threads;   ///< floors may slip here
  std::vector<ThreadTouch> touches;                          ///< per thread
  std::vector<Obstacle> obstacles;
  ContactOptions options;
};

struct TouchingState
{
  std::vector<ThreadGroupState> threads;
  std::vector<Pose> obstacles;
  double contact_stiffness = 0.0;   ///< of the barrier [N], 0: not chosen yet
};

struct TouchingInputs
{
  std::vector<ThreadInputs> threads;
  std::vector<Pose> obstacles;   ///< at the end of the step
};

/// Steps threads with contact: one implicit system with the barrier potential of the contact room and the merging
/// potential. Parts that lie on a floor that they stick to move as prescribed and pass through obstacles and other such
/// parts.
class TouchingThreads
{
public:
  /// Throws std::invalid_argument naming what does not fit together.
  TouchingThreads(TouchingModel model, const NewtonConfig& newton);
  ~TouchingThreads();
  TouchingThreads(TouchingThreads&&) noexcept;

  /// Advances by `duration` [s]. On failure the state is untouched and the report says why.
  StepReport step(TouchingState& state, const TouchingInputs& inputs, double duration);

  /// Throws std::invalid_argument when something touches or crosses in this state.
  void checkClearance(const TouchingState& state);
  /// Smallest distance between surfaces [m], up to the gap at which they repel; between parts that merge, of what may
  /// not be entered.
  double clearance(const TouchingState& state);

  /// On the holders of a thread's ends, as of the last successful step.
  const std::array<EndLoad, 2>& endLoads(int thread) const;
  const std::vector<ContactTerm>& contacts() const;   ///< of the last step
  const TouchingModel& model() const;

private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}   // namespace slender
