#pragma once

#include <istream>
#include <map>
#include <string>
#include <vector>

#include "slender_sim/geometry/pose.h"

namespace slender {

/// Timed poses of one body, times [s] strictly increasing.
struct TimedPoses
{
  std::vector<double> times;
  std::vector<Pose> poses;
};

/// Reads a table of timed poses of named bodies: lines `t,body,x,y,z,qx,qy,qz,qw` (s, m, unit quaternion), '#' comments, an
/// optional header line. Bodies may come in any order, each body's times must increase. Throws std::runtime_error with `name`,
/// line and value for anything else.
std::map<std::string, TimedPoses> readMotionTable(std::istream& in, const std::string& name);
std::map<std::string, TimedPoses> readMotionTable(const std::string& path);

}  // namespace slender
