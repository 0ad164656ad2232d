#pragma once

#include <string>
#include <vector>

#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/WrenchStamped.h>

#include "slender_sim/RodState.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Names of the grasps in topics, in scene order: the grasp's own name, or ROD/NAME where several rods use the same name.
/// Throws std::invalid_argument for a name that cannot stand in a topic.
std::vector<std::string> graspTopicNames(const Simulation& simulation);

/// What is published and recorded of one instant, in scene order.
struct SceneMessages
{
  std::vector<slender_sim::RodState> states;            ///< per rod
  geometry_msgs::PoseArray poses;                       ///< the edges' frames at their middles, all rods one after the other
  std::vector<geometry_msgs::WrenchStamped> wrenches;   ///< per grasp; zero while released

  void fill(const Simulation& simulation, const ros::Time& stamp, const std::string& frame_id, std::uint32_t epoch);
};

}  // namespace slender
