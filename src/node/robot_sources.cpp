#include "slender_sim/node/robot_sources.h"

#include <ros/package.h>

namespace slender {

RobotSources packageSources()
{
  RobotSources sources;
  sources.package = [](const std::string& name) { return ros::package::getPath(name); };
  return sources;
}

RobotSources rosSources(const ros::NodeHandle& nh)
{
  RobotSources sources = packageSources();
  sources.parameter = [nh](const std::string& name) -> std::optional<std::string> {
    std::string key, text;
    try
    {
      if (nh.searchParam(name, key) && nh.getParam(key, text))
        return text;
    }
    catch (const ros::InvalidNameException&)   // the name is no parameter, for example a file name
    {
    }
    return std::nullopt;
  };
  return sources;
}

}   // namespace slender
