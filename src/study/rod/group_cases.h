#pragma once

#include "rod_cases.h"
#include "slender_sim/rod/rod_group.h"

namespace slender::study {

/// Model, state and inputs of rods and bodies that belong together; everything held stays where it is.
struct GroupSetup
{
  RodGroupModel model;
  RodGroupState state;
  RodGroupInputs inputs;

  /// Takes the rod over as it is; returns its index.
  int add(const RodSetup& rod)
  {
    model.rods.push_back(rod.model);
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
    model.bodies.push_back(body);
    RigidBodyState at;
    at.X_WB = X_WB;
    state.bodies.push_back(at);
    inputs.bodies.push_back({X_WB, {}});
    return static_cast<int>(model.bodies.size()) - 1;
  }
  /// Welds the section of a rod's node, as it lies now.
  void weld(int rod, int node, int body)
  {
    makeWeld(model, state, rod, node, node, body);
    inputs.rods[rod].grasps.push_back({state.rods[rod].grasps.back().X_WG, {}});
  }
  void setGravity(const Eigen::Vector3d& gravity)
  {
    inputs.gravity = gravity;
    for (RodInputs& rod : inputs.rods)
      rod.gravity = gravity;
  }
};

}   // namespace slender::study
