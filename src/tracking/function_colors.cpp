#include "slender_sim/tracking/function_colors.h"

#include <algorithm>
#include <cmath>

namespace slender {

namespace {

/// Hues by the golden ratio lie far apart for successive functions; lightness changes along, too, for there are
/// hundreds.
Eigen::Vector3d colorOf(Eigen::Index function)
{
  const double hue = 6.0 * std::fmod(0.13 + 0.6180339887498949 * static_cast<double>(function), 1.0),
               value = function % 3 == 0   ? 0.95
                       : function % 3 == 1 ? 0.75
                                           : 0.85;
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + hue, 6.0);
    return value * (1.0 - 0.65 * std::max(0.0, std::min({k, 4.0 - k, 1.0})));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

}   // namespace

Eigen::Matrix3Xd functionColors(const TestFunctions::Values& values)
{
  Eigen::Matrix3Xd colors = Eigen::Matrix3Xd::Zero(3, values.cols());
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(values.cols());
  for (Eigen::Index i = 0; i < values.rows(); ++i)
  {
    const Eigen::Vector3d color = colorOf(i);
    for (TestFunctions::Values::InnerIterator entry(values, i); entry; ++entry)
    {
      colors.col(entry.col()) += entry.value() * color;
      sums[entry.col()] += entry.value();
    }
  }
  for (Eigen::Index v = 0; v < values.cols(); ++v)
    colors.col(v) = sums[v] > 1.0 ? Eigen::Vector3d(colors.col(v) / sums[v])
                                  : Eigen::Vector3d(colors.col(v) + (1.0 - sums[v]) * Eigen::Vector3d::Constant(0.85));
  return colors;
}

}   // namespace slender
