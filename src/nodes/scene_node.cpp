#include "slender_sim/node/node_main.h"

int main(int argc, char** argv) { return slender::nodeMain(argc, argv, "scene_node", slender::NodeKind::scene); }
