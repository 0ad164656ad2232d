#include <exception>
#include <iostream>

#include <ros/ros.h>

#include "slender_sim/node/arguments.h"
#include "slender_sim/node/fairing_node.h"
#include "slender_sim/node/signals.h"

int main(int argc, char** argv)
try
{
  ros::init(argc, argv, "fairing_node", ros::init_options::NoSigintHandler);
  slender::requireNoArguments(argc, argv);
  slender::stopOnSignals();
  const slender::FairingNode node(ros::NodeHandle("~"));
  ros::spin();
  return 0;
}
catch (const std::exception& e)
{
  std::cerr << "fairing_node: " << e.what() << std::endl;
  return 2;
}
