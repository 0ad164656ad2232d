#include "slender_sim/node/node_main.h"

#include <exception>
#include <iostream>

#include <ros/init.h>

#include "slender_sim/node/arguments.h"
#include "slender_sim/node/scene_node.h"
#include "slender_sim/node/signals.h"

namespace slender {

int nodeMain(int argc, char** argv, const char* name, NodeKind kind)
try
{
  ros::init(argc, argv, name, ros::init_options::NoSigintHandler);
  requireNoArguments(argc, argv);
  stopOnSignals();   // a signal also ends a long step, and the bag is completed
  return SceneNode(ros::NodeHandle(), ros::NodeHandle("~"), kind).spin();
}
catch (const std::exception& e)
{
  std::cerr << name << ": " << e.what() << std::endl;
  return 2;
}

}   // namespace slender
