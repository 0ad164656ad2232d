#include "slender_sim/node/node_main.h"

int main(int argc, char** argv) { return slender::nodeMain(argc, argv, "thread_node", slender::NodeKind::threads); }
