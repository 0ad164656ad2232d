#include "slender_sim/node/node_main.h"

#include <csignal>
#include <exception>
#include <iostream>

#include <ros/init.h>

#include "slender_sim/linalg/interruption.h"
#include "slender_sim/node/arguments.h"
#include "slender_sim/node/scene_node.h"

namespace slender {
namespace {

/// SIGINT and SIGTERM end the step that is being solved and ask for shutdown, which finishes the bag. A second one ends
/// the process at once. Needs ros::init() with NoSigintHandler: roscpp would replace the first handler as the node
/// starts.
void stopOnSignals()
{
  struct sigaction action = {};
  action.sa_handler = [](int) {
    interruptSteps();
    ros::requestShutdown();
  };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM})
    ::sigaction(signal, &action, nullptr);
}

}   // namespace

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
