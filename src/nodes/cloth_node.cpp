#include "slender_sim/node/node_main.h"

int main(int argc, char** argv) { return slender::nodeMain(argc, argv, "cloth_node", slender::NodeKind::cloths); }
