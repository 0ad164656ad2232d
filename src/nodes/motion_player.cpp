#include <exception>
#include <iostream>

#include <ros/init.h>

#include "slender_sim/node/arguments.h"
#include "slender_sim/node/motion_player.h"
#include "slender_sim/node/signals.h"

int main(int argc, char** argv)
try
{
  ros::init(argc, argv, "motion_player", ros::init_options::NoSigintHandler);
  slender::requireNoArguments(argc, argv);
  slender::stopOnSignals();
  slender::MotionPlayer(ros::NodeHandle(), ros::NodeHandle("~")).spin();
  return 0;
}
catch (const std::exception& e)
{
  std::cerr << "motion_player: " << e.what() << std::endl;
  return 2;
}
