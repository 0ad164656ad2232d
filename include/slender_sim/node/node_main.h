#pragma once

#include <functional>

#include "slender_sim/node/node_kind.h"

namespace slender {

/// Main program of a node. Starts ROS and returns the exit status of run(). Prints a message and returns 2 if run()
/// throws.
int nodeMain(int argc, char** argv, const char* name, const std::function<int()>& run);
/// Main program of a simulating node. Runs a SceneNode and returns the exit status of SceneNode::spin(). Prints a
/// message and returns 2 if the node cannot start.
int nodeMain(int argc, char** argv, const char* name, NodeKind kind);

}   // namespace slender
