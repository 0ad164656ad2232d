#pragma once

#include <ros/node_handle.h>

#include "slender_sim/scene/robot.h"

namespace slender {

/// ROS packages by rospack, for programs that run without a master.
RobotSources packageSources();

/// The same, and ROS parameters: names are looked for in the namespace of the handle and then in those above it.
RobotSources rosSources(const ros::NodeHandle& nh);

}   // namespace slender
