#include <exception>
#include <iostream>

#include <ros/init.h>

#include "slender_sim/node/arguments.h"
#include "slender_sim/node/scene_node.h"
#include "slender_sim/node/signals.h"

int main(int argc, char** argv)
try
{
  ros::init(argc, argv, "cloth_node", ros::init_options::NoSigintHandler);
  slender::requireNoArguments(argc, argv);
  slender::stopOnSignals();   // or the bag stays unfinished, and a long step goes on
  return slender::SceneNode(ros::NodeHandle(), ros::NodeHandle("~"), slender::NodeKind::cloths).spin();
}
catch (const std::exception& e)
{
  std::cerr << "cloth_node: " << e.what() << std::endl;
  return 2;
}
