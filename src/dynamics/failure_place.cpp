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
  char number[40];
  std::snprintf(number, sizeof number, "%.3g", value_);
  return number + (unit.empty() ? unit : " " + unit);
}

std::string metres(const Eigen::Vector3d& position)
{
  char text[120];
  std::snprintf(text, sizeof text, "(%.4g, %.4g, %.4g) m", position.x(), position.y(), position.z());
  return text;
}

}   // namespace slender
