#pragma once

#include <set>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <tf2_msgs/TFMessage.h>

#include "slender_sim/node/scene_topics.h"
#include "slender_sim/scene/simulation.h"

namespace slender {

/// Publishes tf frames: bodies as NAME, grasps as NODE/grasps/NAME, sections of rods as NODE/rods/ROD/NAME, nozzles
/// as NODE/nozzle or NODE/threads/NAME/nozzle. Frames are computed only while somebody listens to /tf.
class FrameBroadcaster
{
public:
  /// `node` is the name of the node with its namespace and without a leading slash. With `grasps` the grasps have
  /// frames.
  FrameBroadcaster(ros::NodeHandle& nh, const std::string& node, std::string frame_id, const SceneTopics& topics,
                   bool grasps);

  const std::vector<std::string>& graspFrames() const { return grasps_; }
  void broadcast(const Simulation& simulation, const ros::Time& stamp);

private:
  void add(const std::string& child, const Pose& X_WC, const ros::Time& stamp);

  std::string node_, frame_id_;
  bool has_grasps_;
  std::vector<std::string> grasps_, nozzles_;
  ros::Publisher publisher_;
  tf2_msgs::TFMessage message_;
};

/// Returns the names of all frames that a node may publish for a scene.
std::set<std::string> broadcastFrames(const std::string& node, const SceneTopics& topics, const Simulation& simulation);

}   // namespace slender
