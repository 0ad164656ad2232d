#include "slender_sim/dynamics/failure_place.h"

#include <cmath>
#include <cstdio>
#include <limits>

namespace slender {

void Largest::add(int index, double value)
{
  const double size = std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
  if (index_ < 0 || size > value_)
  {
    index_ = index;
    value_ = size;
  }
}

std::string Largest::text(const std::string& unit) const
{
  if (!std::isfinite(value_))
    return "infinite";
  return shortNumber(value_, 3) + (unit.empty() ? unit : " " + unit);
}

std::string shortNumber(double value, int digits)
{
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

std::string metres(const Eigen::Vector3d& position)
{
  return "(" + shortNumber(position.x(), 4) + ", " + shortNumber(position.y(), 4) + ", " +
         shortNumber(position.z(), 4) + ") m";
}

}   // namespace slender
