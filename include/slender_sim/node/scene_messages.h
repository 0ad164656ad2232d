#pragma once

#include <string>
#include <vector>

#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/WrenchStamped.h>

#include "slender_sim/BodyStates.h"
#include "slender_sim/ClothState.h"
#include "slender_sim/Fields.h"
#include "slender_sim/GraspStates.h"
#include "slender_sim/MeshStamped.h"
#include "slender_sim/RodState.h"
#include "slender_sim/ThreadState.h"
#include "slender_sim/node/shared_message.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Names of the grasps in scene order, as they stand in topics (the reader has made sure that they differ). Throws
/// std::invalid_argument for a rod, a cloth or a grasp whose name cannot be part of a topic.
std::vector<std::string> graspTopicNames(const Simulation& simulation);

/// Before the topics of a thread: nothing in a scene of one thread, else "threads/NAME/". Throws like
/// graspTopicNames().
std::vector<std::string> threadTopicPrefixes(const Simulation& simulation);

/// The undeformed cloths.
slender_sim::MeshStamped clothMesh(const Simulation& simulation, const ros::Time& stamp, const std::string& frame_id);

/// What is published and recorded of one instant, in scene order. What is large is shared: record first, then publish,
/// and do not read it afterwards.
struct SceneMessages
{
  std::vector<SharedMessage<slender_sim::RodState>> states;       ///< per rod
  std::vector<SharedMessage<slender_sim::ThreadState>> threads;   ///< per thread and piece of it
  SharedMessage<slender_sim::ClothState> cloth_state;             ///< all of them in one message; none: not published
  /// the edges' frames at their middles, all rods and threads one after the other
  SharedMessage<geometry_msgs::PoseArray> edge_poses;
  std::vector<geometry_msgs::WrenchStamped> wrenches;   ///< per grasp; zero while released
  /// per thread: what it does to its nozzle, about the outlet; zero without one
  std::vector<geometry_msgs::WrenchStamped> nozzles;
  /// the scene's bodies, simulated and driven; none: not published
  slender_sim::BodyStates bodies;

  slender_sim::GraspStates grasps;     ///< none: neither published nor recorded
  slender_sim::BodyStates obstacles;   ///< likewise

  slender_sim::Fields fields;   ///< see fillFields(); no tables: neither published nor recorded

  void fill(const Simulation& simulation, const ros::Time& stamp, const std::string& frame_id, std::uint32_t epoch);
  /// What `record.fields` of the scene asks for, of the instant of the last fill(). It is computed here, so call it
  /// only if somebody takes it.
  void fillFields(const Simulation& simulation);

private:
  void fillRods(const Simulation& simulation, std::uint32_t epoch, geometry_msgs::PoseArray& poses);
  void fillThreads(const Simulation& simulation, std::uint32_t epoch, geometry_msgs::PoseArray& poses);
  void fillCloths(const Simulation& simulation, std::uint32_t epoch, const std_msgs::Header& header);
  void fillGrasps(const Simulation& simulation, const std_msgs::Header& header);
  void fillSolids(const Simulation& simulation, const std_msgs::Header& header);
};

}   // namespace slender
