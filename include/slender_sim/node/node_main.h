#pragma once

#include "slender_sim/node/node_kind.h"

namespace slender {

/// The main program of a simulating node: runs a SceneNode until it ends. Returns the exit status: that of
/// SceneNode::spin(), or 2 with a message when the node cannot start.
int nodeMain(int argc, char** argv, const char* name, NodeKind kind);

}   // namespace slender
