#pragma once

#include <string>
#include <vector>

#include <geometry_msgs/WrenchStamped.h>
#include <ros/node_handle.h>

#include "slender_sim/node/scene_messages.h"

namespace slender {

/// Publishes `grasps/NAME/wrench` and `grasps/NAME/wrench_filtered`. The wrench is the force [N] and torque [N m] that
/// the object exerts on its gripper, about the grasp's origin. The filtered wrench is meant for controllers; it is the
/// output of a first-order low-pass filter.
class GraspWrenches
{
public:
  struct Options
  {
    bool world = false;          ///< true: axes of the node's frame; false: axes of the grasp's own tf frame
    double filter_time = 0.05;   ///< [s] > 0, time constant of the filter
  };

  /// `frames` are the tf frames of the grasps, as in FrameBroadcaster.
  GraspWrenches(ros::NodeHandle& nh, const std::vector<std::string>& names, std::vector<std::string> frames,
                const Options& options);

  /// Returns true if one of the topics has a subscriber.
  bool isHeard() const;
  /// Publishes the wrenches of one instant, from the wrenches and poses of the grasps in `messages`.
  void publish(const SceneMessages& messages);
  /// Continues the filters of `before` on topics of the same name. Call it after an edit of the scene.
  void takeOver(const GraspWrenches& before);
  /// Restarts the filter with the next wrench. Call it after the state was replaced.
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
