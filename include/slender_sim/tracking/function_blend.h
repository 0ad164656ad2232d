#pragma once

#include <Eigen/Core>

#include "slender_sim/tracking/weak_constraints.h"

namespace slender {

/// From the moment when test functions take over from others: how far the guide's averages are ahead of the shell's,
/// which nobody made the same before. Taken as it is, with its rate, it goes to zero along a cubic (Hermite), so that
/// neither averages nor their velocities jump, and all is exact from there on.
struct FunctionBlend
{
  Eigen::Matrix3Xd gap, rate;   ///< 3 x functions [m, m/s], at the start; without columns: no blend
  double start = 0.0;           ///< simulated time [s]
  double duration = 0.0;        ///< [s]

  /// Of functions that take over at `start`, by positions (3 x n [m]) and velocities [m/s] of the guide and of what
  /// tracks it. Duration 0: no blend.
  static FunctionBlend between(const WeakConstraints& functions, const Eigen::Matrix3Xd& guide,
                               const Eigen::Matrix3Xd& guide_velocity, const Eigen::Matrix3Xd& x,
                               const Eigen::Matrix3Xd& v, double start, double duration);

  /// Something is left at this time [s].
  bool active(double time) const;
  /// Takes what is left then from the guide's averages (3 x functions [m]): what the shell's shall be.
  void apply(double time, Eigen::Matrix3Xd& averages) const;
  /// Greatest length that is left of a gap [m].
  double left(double time) const;

private:
  struct Shares
  {
    double gap, rate;
  };
  Shares sharesAt(double time) const;
};

}   // namespace slender
