#pragma once

#include <string>
#include <vector>

#include <geometry_msgs/WrenchStamped.h>
#include <ros/node_handle.h>

#include "slender_sim/node/scene_messages.h"

namespace slender {

/// Publishes `grasps/NAME/wrench`, the force and torque of the object on its gripper about the grasp's origin, and
/// `grasps/NAME/wrench_filtered`, the same through a low-pass filter of first order for controllers.
class GraspWrenches
{
public:
  struct Options
  {
    bool world = false;          ///< axes of the node's frame, else of the grasp's own tf frame
    double filter_time = 0.05;   ///< [s] > 0, time constant of the filter
  };

  /// `frames`: tf frames of the grasps, as in FrameBroadcaster.
  GraspWrenches(ros::NodeHandle& nh, const std::vector<std::string>& names, std::vector<std::string> frames,
                const Options& options);

  /// True when somebody listens.
  bool isHeard() const;
  /// Takes wrenches and poses of the grasps from the messages of one instant.
  void publish(const SceneMessages& messages);
  /// The state was replaced: the filter begins anew with the next wrench.
  void restart();

private:
  struct Channel
  {
    ros::Publisher raw, filtered;
    std::string frame;
    geometry_msgs::WrenchStamped last;   // output of the filter, in world axes
    bool started = false;
  };
  void publish(const ros::Publisher& publisher, const Channel& channel, geometry_msgs::WrenchStamped message,
               const geometry_msgs::Pose& pose) const;

  Options options_;
  std::vector<Channel> channels_;
};

}   // namespace slender
