#pragma once

#include <csignal>

#include <ros/init.h>

#include "slender_sim/linalg/interruption.h"

namespace slender {

/// SIGINT and SIGTERM end the step that is being solved and ask for shutdown, which finishes the bag. A second one ends
/// the process at once. Needs ros::init() with NoSigintHandler: roscpp would replace the first handler as the node
/// starts.
inline void stopOnSignals()
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

}   // namespace slender
