#pragma once

#include <functional>
#include <optional>
#include <string>

namespace slender {

/// Sources of robot descriptions besides files. The library does not depend on ROS. Programs that use ROS set these
/// functions.
struct RobotSources
{
  /// Returns the text of the ROS parameter of this name, or nothing if there is none. Null if the program has no
  /// parameters.
  std::function<std::optional<std::string>(const std::string& name)> parameter;
  /// Returns the folder of the ROS package of this name, or an empty text if there is none. Null if the program cannot
  /// find packages.
  std::function<std::string(const std::string& name)> package;
};

/// Sets the sources in which the reader looks for robot descriptions and their meshes. They are used for all scenes
/// that are read afterwards.
void setRobotSources(RobotSources sources);

}   // namespace slender
