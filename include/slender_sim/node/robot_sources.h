#pragma once

#include <ros/node_handle.h>

#include "slender_sim/scene/robot.h"

namespace slender {

/// Returns sources that find ROS packages with rospack and have no parameters. They work without a ROS master.
RobotSources packageSources();

/// Returns sources that find ROS packages and also read ROS parameters. A parameter is searched for in the namespace of
/// the handle and then in the namespaces above it.
RobotSources rosSources(const ros::NodeHandle& nh);

}   // namespace slender
