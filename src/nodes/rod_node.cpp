#include <csignal>
#include <exception>
#include <iostream>

#include <ros/init.h>

#include "slender_sim/node/arguments.h"
#include "slender_sim/node/scene_node.h"

int main(int argc, char** argv)
try
{
  ros::init(argc, argv, "rod_node");
  slender::requireNoArguments(argc, argv);
  std::signal(SIGTERM, [](int) { ros::requestShutdown(); });   // like SIGINT, or the bag stays unfinished
  return slender::SceneNode(ros::NodeHandle(), ros::NodeHandle("~"), slender::NodeKind::rods).spin();
}
catch (const std::exception& e)
{
  std::cerr << "rod_node: " << e.what() << std::endl;
  return 2;
}
