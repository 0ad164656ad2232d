#pragma once

#include <stdexcept>
#include <string>

namespace slender {

/// After ros::init(), which takes what is ROS's. Throws std::invalid_argument naming what is left.
inline void requireNoArguments(int argc, char** argv)
{
  if (argc > 1)
    throw std::invalid_argument("unknown argument \"" + std::string(argv[1]) +
                                "\"; parameters are given as _name:=value, topics remapped as from:=to");
}

}   // namespace slender
