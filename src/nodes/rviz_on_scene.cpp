#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include "slender_sim/node/camera_fit.h"

/// rviz_on_scene -d CONFIG [further arguments of rviz]: opens rviz with the camera on the scene. The program waits for
/// the first pictures on the topics of the configuration's marker displays. It writes a configuration with a view that
/// shows these pictures to ~/.ros, and then executes rviz in its place.
namespace {

constexpr double kPatience = 60.0;   // [s] time after which rviz opens without a picture
constexpr double kTogether = 0.5;    // [s] time in which the pictures of several nodes arrive

std::string textOf(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns the points of the first picture of each topic, or of fewer topics if the time runs out.
std::vector<Eigen::Vector3d> firstPictures(const std::vector<std::string>& topics)
{
  ros::NodeHandle nh;
  std::map<std::string, visualization_msgs::MarkerArray> pictures;
  std::vector<ros::Subscriber> subscribers;
  for (const std::string& topic : topics)
  {
    const boost::function<void(const visualization_msgs::MarkerArray&)> take =
        [&pictures, topic](const visualization_msgs::MarkerArray& picture) { pictures.emplace(topic, picture); };
    subscribers.push_back(nh.subscribe<const visualization_msgs::MarkerArray&>(topic, 1, take));
  }
  const ros::WallTime start = ros::WallTime::now();
  ros::WallTime first;
  while (ros::ok() && pictures.size() < topics.size() && (ros::WallTime::now() - start).toSec() < kPatience &&
         (first.isZero() || (ros::WallTime::now() - first).toSec() < kTogether))
  {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
    if (first.isZero() && !pictures.empty())
      first = ros::WallTime::now();
  }
  visualization_msgs::MarkerArray all;
  for (const auto& [topic, picture] : pictures)
    all.markers.insert(all.markers.end(), picture.markers.begin(), picture.markers.end());
  return slender::pointsToShow(all);
}

/// Returns the path of a configuration with the fitted view, or `config` if there is nothing to fit.
std::string fittedFile(const std::string& config)
{
  const std::string text = textOf(config);
  const std::vector<Eigen::Vector3d> points = firstPictures(slender::markerTopics(text));
  if (points.empty())
  {
    ROS_WARN("rviz_on_scene: no picture came on the marker topics of %s; rviz opens with its view as it is",
             config.c_str());
    return config;
  }
  const std::optional<std::string> fitted = slender::fittedConfig(text, points);
  if (!fitted)
  {
    ROS_WARN("rviz_on_scene: %s has no camera that orbits (rviz/Orbit); rviz opens with its view as it is",
             config.c_str());
    return config;
  }
  const char *home = std::getenv("ROS_HOME"), *user = std::getenv("HOME");
  const std::filesystem::path folder =
      home ? std::filesystem::path(home) : std::filesystem::path(user ? user : "/tmp") / ".ros";
  std::string name = ros::this_node::getName();
  std::replace(name.begin(), name.end(), '/', '_');
  const std::string path = (folder / ("fitted" + name + ".rviz")).string();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::ofstream file(path, std::ios::binary);
  file << *fitted;
  file.close();
  if (file)
    return path;
  ROS_WARN("rviz_on_scene: %s cannot be written; rviz opens with its view as it is", path.c_str());
  return config;
}

}   // namespace

int main(int argc, char** argv)
{
  const std::vector<std::string> given(argv + 1, argv + argc);   // with the remappings, for rviz
  ros::init(argc, argv, "rviz");
  const ros::NodeHandle alive;   // keeps ROS running; ROS shuts down with its last handle
  std::vector<std::string> arguments = {"rviz"};
  bool has_config = false;
  for (std::size_t k = 0; k < given.size(); ++k)
  {
    arguments.push_back(given[k]);
    if (given[k] != "-d" || k + 1 == given.size())
      continue;
    has_config = true;
    arguments.push_back(fittedFile(given[++k]));
  }
  if (!has_config)
  {
    std::cerr << "usage: rviz_on_scene -d CONFIG.rviz [arguments of rviz]\n";
    return 2;
  }
  if (!ros::ok())
    return 0;
  ros::shutdown();
  std::vector<char*> words;
  for (std::string& argument : arguments)
    words.push_back(argument.data());
  words.push_back(nullptr);
  ::execvp("rviz", words.data());
  std::cerr << "rviz_on_scene: rviz cannot be started; Debian's package rviz has it\n";
  return 3;
}
