#pragma once

#include <functional>
#include <optional>
#include <string>

namespace slender {

/// Where robot descriptions come from besides files. The library knows no ROS; programs that do say how to ask it.
struct RobotSources
{
  /// Text of the ROS parameter of this name; nothing if there is none. Null: the program has no parameters.
  std::function<std::optional<std::string>(const std::string& name)> parameter;
  /// Folder of the ROS package of this name; empty if there is none. Null: the program knows no packages.
  std::function<std::string(const std::string& name)> package;
};

/// Sets where the reader looks for robot descriptions and their meshes. It holds for all scenes that are read later.
void setRobotSources(RobotSources sources);

}   // namespace slender
