#pragma once

#include <algorithm>

namespace slender {

// What buffers of guides share when the guide has to catch up with its stream.

/// [s] a limit from the right is evaluated this much later; shorter than any step
constexpr double kLimitOffset = 1e-7;
/// [s] an extrapolated motion would come to rest in this time at a constant rate
constexpr double kOpenCoast = 0.5;
constexpr double kDryBlend = 0.3;       ///< [s] shortest blending time after a stream ran dry, whose offsets are small
constexpr double kSameMotion = 1e-10;   ///< [m], [rad] round-off of evaluating the same motion twice

/// Weights of an offset and of its rate at one instant: offset(t) = value * offset(0) + slope * rate(0), and the
/// derivative of that with respect to time.
struct FadeWeights
{
  double value = 0.0;        ///< [1]
  double slope = 0.0;        ///< [s]
  double value_rate = 0.0;   ///< [1/s]
  double slope_rate = 0.0;   ///< [1]
};

/// Weights of the cubic Hermite polynomial that takes an offset to zero within `duration` [s] > 0 and its rate within
/// `rate_duration` [s] > 0. The rate has a duration of its own, because a rate that fades over a long time would lead
/// far away. `elapsed` [s] is the time since the start; outside of the durations the polynomial keeps its end values.
inline FadeWeights fadeOut(double elapsed, double duration, double rate_duration)
{
  const double s = std::clamp(elapsed / duration, 0.0, 1.0);
  const double u = std::clamp(elapsed / rate_duration, 0.0, 1.0);
  FadeWeights weights;
  weights.value = (1 + 2 * s) * (1 - s) * (1 - s);
  weights.slope = rate_duration * u * (1 - u) * (1 - u);
  weights.value_rate = 6 * s * (s - 1) / duration;
  weights.slope_rate = (1 - u) * (1 - 3 * u);
  return weights;
}

}   // namespace slender
