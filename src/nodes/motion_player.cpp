#include "slender_sim/node/motion_player.h"

#include "slender_sim/node/node_main.h"

int main(int argc, char** argv)
{
  return slender::nodeMain(argc, argv, "motion_player", [] {
    slender::MotionPlayer(ros::NodeHandle(), ros::NodeHandle("~")).spin();
    return 0;
  });
}
