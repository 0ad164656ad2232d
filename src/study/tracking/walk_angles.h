#pragma once

#include <cmath>

namespace slender::study {

/// Angle [rad] of a joint of the right side in a walk: mean and two harmonics, fitted to a recorded walk (CMU motion
/// capture; 1.25 s for two steps, 0.98 m/s). Flexion forwards; the left side follows half a period later.
struct Swing
{
  double mean, c1, s1, c2, s2;
  double at(double phase) const
  {
    return mean + c1 * std::cos(phase) + s1 * std::sin(phase) + c2 * std::cos(2 * phase) + s2 * std::sin(2 * phase);
  }
};
inline constexpr Swing kHipSwing{0.173, 0.311, -0.168, -0.083, -0.002},
    kKneeSwing{0.540, -0.128, -0.437, -0.245, 0.222}, kShoulderSwing{-0.063, -0.299, 0.117, -0.027, -0.011},
    kElbowSwing{0.327, -0.188, 0.056, 0.015, -0.005};
inline constexpr double kWalkSpeed = 0.98;    ///< [m/s]
inline constexpr double kWalkPeriod = 1.25;   ///< of two steps [s]

}   // namespace slender::study
