#pragma once

#include <optional>
#include <string>

#include "rod_cases.h"
#include "slender_sim/world/world.h"

namespace slender::study {

/// Model, state and inputs of a world of rods, bodies and obstacles, without a scene. Everything held stays where it
/// is.
struct GroupSetup
{
  WorldModel model;
  WorldState state;
  WorldInputs inputs;

  /// Takes the rod over as it is; returns its index.
  int add(const RodSetup& rod)
  {
    model.rods.emplace_back().model = rod.model;
    state.rods.push_back(rod.state);
    inputs.rods.push_back(rod.inputs);
    return static_cast<int>(model.rods.size()) - 1;
  }
  /// A body at rest; principal moments about its centre of mass, in its axes.
  int add(const std::string& name, double mass, const Eigen::Vector3d& moments, const Pose& X_WB)
  {
    RigidBodyModel body;
    body.name = name;
    body.mass = mass;
    body.inertia = moments.asDiagonal();
    model.bodies.push_back({body, {}, {}, -1.0});
    RigidBodyState at;
    at.X_WB = X_WB;
    state.bodies.push_back(at);
    inputs.bodies.push_back({X_WB, {}});
    return static_cast<int>(model.bodies.size()) - 1;
  }
  /// Welds the section of a rod's node, as it lies when the first world is made.
  void weld(int rod, int node, int body)
  {
    model.welds.push_back({rod, node, node, body, {}});
    inputs.rods[rod].grasps.emplace_back();
  }
  /// A world of this that takes steps of time.step. With the first one the state gets the grasps of the welds. Others
  /// are made from the same start and take the present state as it is.
  World world(const TimeConfig& time)
  {
    model.time = time;
    if (start_)
    {
      WorldState again = *start_;
      return World(model, again);
    }
    start_ = state;
    return World(model, state);
  }
  void setGravity(const Eigen::Vector3d& gravity)
  {
    inputs.gravity = gravity;
    for (RodInputs& rod : inputs.rods)
      rod.gravity = gravity;
  }

private:
  std::optional<WorldState> start_;   ///< of its first world
};

}   // namespace slender::study
