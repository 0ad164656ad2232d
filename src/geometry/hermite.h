#pragma once

#include <Eigen/Core>

/// Cubic Hermite interpolation through timed samples, for poses and points alike.
namespace slender {

constexpr double burst_ratio = 4.0;   // intervals more uneven than this are a burst, see pose_trajectory.h

/// Slope at the middle of three samples; `before`, `after`: the neighbours' values minus its own.
inline Eigen::Vector3d threePointSlope(double h_before, const Eigen::Vector3d& before, double h_after, const Eigen::Vector3d& after, double same)
{
  if (before.norm() <= same || after.norm() <= same)
  {
    return Eigen::Vector3d::Zero();
  }
  const double span = h_before + h_after;
  if (h_before * burst_ratio < h_after || h_after * burst_ratio < h_before)
  {
    return (after - before) / span;
  }
  return (h_before / (span * h_after)) * after - (h_after / (span * h_before)) * before;
}

/// Weights of the end value and of both slopes at the share s of a segment of length h that starts at zero, and their rates.
struct HermiteWeights
{
  double h01, h10, h11, d01, d10, d11;
  HermiteWeights(double s, double h)
    : h01(s * s * (3 - 2 * s)), h10(h * s * (1 - s) * (1 - s)), h11(h * s * s * (s - 1)), d01(6 * s * (1 - s) / h), d10((1 - s) * (1 - 3 * s))
    , d11(s * (3 * s - 2))
  {
  }
};

}  // namespace slender
