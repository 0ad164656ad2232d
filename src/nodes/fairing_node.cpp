#include "slender_sim/node/fairing_node.h"

#include <ros/ros.h>

#include "slender_sim/node/node_main.h"

int main(int argc, char** argv)
{
  return slender::nodeMain(argc, argv, "fairing_node", [] {
    const slender::FairingNode node(ros::NodeHandle("~"));
    ros::spin();
    return 0;
  });
}
