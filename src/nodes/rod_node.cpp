#include "slender_sim/node/node_main.h"

int main(int argc, char** argv) { return slender::nodeMain(argc, argv, "rod_node", slender::NodeKind::rods); }
