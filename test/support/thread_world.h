#pragma once

#include <memory>

#include "slender_sim/world/world.h"

namespace slender::test {

/// Threads that touch, and obstacles: the model of a world, its state and its inputs, without a scene.
struct ThreadWorld
{
  WorldModel model;
  WorldState state;
  WorldInputs inputs;

  /// `gap`: at which surfaces repel [m]; `step` [s].
  ThreadWorld(double gap, double step)
  {
    model.contact.gap = gap;
    model.contact.least_stiffness = 1e-8;
    model.time.step = step;
  }
  void add(const ThreadModel& m, const ThreadState& s, const ThreadInputs& in, const ContactProperties& contact = {},
           double merging = 0.0)
  {
    addLone(m, s, in);
    model.threads.back().contact = contact;
    model.threads.back().merging = merging;
  }
  /// A thread that touches nothing but its floor.
  void addLone(const ThreadModel& m, const ThreadState& s, const ThreadInputs& in)
  {
    model.threads.push_back({std::make_shared<ThreadModel>(m), {}, 0.0});
    state.threads.emplace_back();
    state.threads.back().threads.push_back(s);
    state.end_loads.emplace_back();
    inputs.threads.push_back(in);
  }
  void addObstacle(const Shape& shape, const Pose& pose, double friction)
  {
    model.obstacles.push_back({shape, friction, "obstacle"});
    state.obstacles.push_back(pose);
    state.obstacle_velocities.emplace_back();
    inputs.obstacles.push_back({pose, {}});
  }
  const ThreadState& thread(int k) const { return state.threads[static_cast<std::size_t>(k)].threads[0]; }
};

}   // namespace slender::test
