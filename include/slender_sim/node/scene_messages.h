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

/// The undeformed cloths.
slender_sim::MeshStamped clothMesh(const Simulation& simulation, const ros::Time& stamp, const std::string& frame_id);

/// All messages that are published and recorded for one instant, in scene order. Large messages are shared with their
/// subscribers: record them first, then publish them, and do not read them afterwards.
struct SceneMessages
{
  std::vector<SharedMessage<slender_sim::RodState>> states;       ///< per rod
  std::vector<SharedMessage<slender_sim::ThreadState>> threads;   ///< per thread and piece of it
  SharedMessage<slender_sim::ClothState> cloth_state;   ///< one message for all cloths; nullptr: not published
  std_msgs::Header header;                              ///< common header of the messages of this instant
  /// One pose per edge: the material frame at the middle of the edge, object after object.
  SharedMessage<geometry_msgs::PoseArray> rod_poses, thread_poses;
  std::vector<geometry_msgs::WrenchStamped> wrenches;   ///< per grasp; zero while released
  /// per thread: the wrench that the thread exerts on its nozzle, about the outlet; zero without a nozzle
  std::vector<geometry_msgs::WrenchStamped> nozzles;
  /// the simulated and driven bodies of the scene; not published if there are none
  slender_sim::BodyStates bodies;

  slender_sim::GraspStates grasps;     ///< neither published nor recorded if there are none
  slender_sim::BodyStates obstacles;   ///< neither published nor recorded if there are none

  slender_sim::Fields fields;   ///< see fillFields(); neither published nor recorded if it has no tables

  void fill(const Simulation& simulation, const ros::Time& stamp, const std::string& frame_id, std::uint32_t epoch);
  /// Computes the fields that `record.fields` of the scene asks for, at the instant of the last fill(). Call it only if
  /// the fields are used, because it takes time.
  void fillFields(const Simulation& simulation);

private:
  void fillRods(const Simulation& simulation);
  void fillThreads(const Simulation& simulation);
  void fillCloths(const Simulation& simulation);
  void fillGrasps(const Simulation& simulation);
  void fillSolids(const Simulation& simulation);

  std::uint32_t epoch_ = 0;
};

}   // namespace slender
