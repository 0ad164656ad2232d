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

/// What is published and recorded of one instant, in scene order. What is large is shared: record first, then publish,
/// and do not read it afterwards.
struct SceneMessages
{
  std::vector<SharedMessage<slender_sim::RodState>> states;       ///< per rod
  std::vector<SharedMessage<slender_sim::ThreadState>> threads;   ///< per thread and piece of it
  SharedMessage<slender_sim::ClothState> cloth_state;             ///< all of them in one message; none: not published
  std_msgs::Header header;                                        ///< of all messages of this instant
  /// Frames of the edges at their middles, object after object.
  SharedMessage<geometry_msgs::PoseArray> rod_poses, thread_poses;
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
  void fillRods(const Simulation& simulation);
  void fillThreads(const Simulation& simulation);
  void fillCloths(const Simulation& simulation);
  void fillGrasps(const Simulation& simulation);
  void fillSolids(const Simulation& simulation);

  std::uint32_t epoch_ = 0;
};

}   // namespace slender
