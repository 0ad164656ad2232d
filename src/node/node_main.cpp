#include "slender_sim/node/node_main.h"

#include <exception>
#include <iostream>

#include <ros/init.h>

#include "slender_sim/node/arguments.h"
#include "slender_sim/node/scene_node.h"
#include "slender_sim/node/signals.h"

namespace slender {

int nodeMain(int argc, char** argv, const char* name, const std::function<int()>& run)
try
{
  ros::init(argc, argv, name, ros::init_options::NoSigintHandler);
  requireNoArguments(argc, argv);
  stopOnSignals();   // a signal also ends a long step, and the bag is completed
  return run();
}
catch (const std::exception& e)
{
  std::cerr << name << ": " << e.what() << std::endl;
  return 2;
}

int nodeMain(int argc, char** argv, const char* name, NodeKind kind)
{
  return nodeMain(argc, argv, name, [kind] { return SceneNode(ros::NodeHandle(), ros::NodeHandle("~"), kind).spin(); });
}

}   // namespace slender
