#include "slender_sim/node/motion_table.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace slender {
namespace {

std::vector<std::string> split(const std::string& line)
{
  std::vector<std::string> fields(1);
  for (const char c : line)
  {
    if (c == ',')
      fields.emplace_back();
    else if (c != ' ' && c != '\t' && c != '\r')
      fields.back() += c;
  }
  return fields;
}

}  // namespace

std::map<std::string, TimedPoses> readMotionTable(std::istream& in, const std::string& name)
{
  std::map<std::string, TimedPoses> bodies;
  std::string line;
  bool first = true;
  for (int number = 1; std::getline(in, line); ++number)
  {
    const std::vector<std::string> fields = split(line.substr(0, line.find('#')));
    if (fields.size() == 1 && fields[0].empty())
      continue;
    const auto fail = [&](const std::string& why) {
      throw std::runtime_error(name + ":" + std::to_string(number) + ": " + why + " in \"" + line + "\"");
    };
    const bool header = first && !fields[0].empty() && fields[0] == "t";
    first = false;
    if (header)
      continue;
    if (fields.size() != 9)
      fail(std::to_string(fields.size()) + " columns, expected the 9 of t,body,x,y,z,qx,qy,qz,qw");
    double v[9];
    for (int i = 0; i < 9; ++i)
    {
      if (i == 1)
        continue;
      char* end = nullptr;
      v[i] = std::strtod(fields[i].c_str(), &end);
      if (fields[i].empty() || *end != '\0' || !std::isfinite(v[i]))
        fail("column " + std::to_string(i + 1) + " is not a finite number");
    }
    const Eigen::Quaterniond q(v[8], v[5], v[6], v[7]);
    if (std::abs(q.norm() - 1.0) > 0.01)
      fail("the quaternion's length is " + std::to_string(q.norm()) + ", must be 1");
    if (fields[1].empty())
      fail("the body has no name");
    TimedPoses& body = bodies[fields[1]];
    if (!body.times.empty() && v[0] <= body.times.back())
      fail("the time is not after the one before of " + fields[1]);
    body.times.push_back(v[0]);
    body.poses.push_back({Eigen::Vector3d(v[2], v[3], v[4]), q.normalized()});
  }
  if (bodies.empty())
    throw std::runtime_error(name + ": holds no poses");
  return bodies;
}

std::map<std::string, TimedPoses> readMotionTable(const std::string& path)
{
  std::ifstream in(path);
  if (!in)
    throw std::runtime_error(path + ": cannot be opened");
  return readMotionTable(in, path);
}

}  // namespace slender
