#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/geometry/sampled_motion.h"

/// Cubic Hermite interpolation through timed samples, for poses and points alike.
namespace slender {

constexpr double burst_ratio = 4.0;   // intervals more uneven than this are a burst, see pose_trajectory.h

/// Slope at the middle of three samples; `before`, `after`: the neighbours' values minus its own.
inline Eigen::Vector3d threePointSlope(double h_before, const Eigen::Vector3d& before, double h_after,
                                       const Eigen::Vector3d& after)
{
  const double span = h_before + h_after;
  if (h_before * burst_ratio < h_after || h_after * burst_ratio < h_before)
    return (after - before) / span;
  return (h_before / (span * h_after)) * after - (h_after / (span * h_before)) * before;
}

/// Whether the equal samples k and k + 1 lie on both sides of the turning point of a motion, rather than being a pause:
/// the acceleration is about the same before, at and after them. `chord(j)`: sample j minus sample j - 1. A sample
/// after k + 1 that is not there counts as equal to it, unless the samples are `growing`.
template <class Chord>
bool turnsSteadily(const std::vector<double>& times, std::size_t k, bool growing, const Chord& chord)
{
  // A motion that brakes at a constant rate and stops between two samples has accelerations that differ by a half or
  // more at its last two samples.
  constexpr double alike = 1.0 / 3.0;
  const auto acceleration = [&](std::size_t j) {
    return Eigen::Vector3d((chord(j + 1) / (times[j + 1] - times[j]) - chord(j) / (times[j] - times[j - 1])) /
                           (0.5 * (times[j + 1] - times[j - 1])));
  };
  if (k < 2)
    return false;
  const Eigen::Vector3d here = acceleration(k);
  const auto same = [&here](const Eigen::Vector3d& other) {
    return (other - here).norm() <= alike * std::max(other.norm(), here.norm());
  };
  return same(acceleration(k - 1)) && (k + 2 < times.size() ? same(acceleration(k + 1)) : growing);
}

/// Whether sample k, which is neither the first nor the last, is part of a pause: a neighbour has the same value, to
/// within `same`, and the two are no turning point.
template <class Chord>
bool pausesAt(const std::vector<double>& times, std::size_t k, bool growing, double same, const Chord& chord)
{
  const bool before = chord(k).norm() <= same, after = chord(k + 1).norm() <= same;
  return (before && after) || (after && !turnsSteadily(times, k, growing, chord)) ||
         (before && !turnsSteadily(times, k - 1, growing, chord));
}

/// Returns true if the motion goes on beyond sample k, which is the first or the last one; see
/// SampledMotion::cutWithin(). Returns false for two samples, because they are a step and not a motion.
inline bool isCut(const std::vector<double>& times, std::size_t k, double within)
{
  if (times.size() < 3)
    return false;
  const std::size_t later = k == 0 ? 1 : times.size() - 1;
  return times[later] - times[later - 1] < within;
}

/// Slope at an end where isCut() is true: that of the parabola through three samples. On a parabola the slope of the
/// chord is the mean of the slopes at both ends of an interval. The result is bounded by the slope `beside`, so that
/// the motion does not overshoot after a jump or before a pause.
inline Eigen::Vector3d cutSlope(const Eigen::Vector3d& chord, const Eigen::Vector3d& beside)
{
  const Eigen::Vector3d parabola = 2.0 * chord - beside;
  return parabola.norm() < beside.norm() ? parabola : beside;
}

template <class Sample>
template <class Between>
Eigen::Vector3d SampledMotion<Sample>::slope(std::size_t k, double same, const Between& between) const
{
  const std::size_t last = times_.size() - 1;
  const auto shift = [&](std::size_t j) -> Eigen::Vector3d { return between(j - 1, j); };
  const auto chord = [&](std::size_t j) -> Eigen::Vector3d { return shift(j) / (times_[j] - times_[j - 1]); };
  if (k > 0 && k < last)
  {
    if (pausesAt(times_, k, growing_, same, shift))
      return Eigen::Vector3d::Zero();
    return threePointSlope(times_[k] - times_[k - 1], between(k, k - 1), times_[k + 1] - times_[k], between(k, k + 1));
  }
  if (k > 0 && coast_ > 0)
    return chord(k);
  if (k == 0 && last == 1 && moving_start_)
    return chord(1);
  if (k == 0 && last > 1 && moving_start_)
  {
    // The parabola through the first three samples has its mean slope over the first two in their chord.
    const Eigen::Vector3d next = slope(1, same, between);
    return (times_[1] - times_[0]) * burst_ratio < times_[2] - times_[1] ? next
                                                                         : Eigen::Vector3d(2.0 * chord(1) - next);
  }
  if (!isCut(times_, k, cut_))
    return Eigen::Vector3d::Zero();   // at rest if the motion is held beyond the end
  return cutSlope(chord(k == 0 ? 1 : k), slope(k == 0 ? 1 : k - 1, same, between));
}

/// Weights of the end value and of both slopes at the share s of a segment of length h that starts at zero, and their
/// rates.
struct HermiteWeights
{
  double h01, h10, h11, d01, d10, d11;
  HermiteWeights(double s, double h)
    : h01(s * s * (3 - 2 * s)),
      h10(h * s * (1 - s) * (1 - s)),
      h11(h * s * s * (s - 1)),
      d01(6 * s * (1 - s) / h),
      d10((1 - s) * (1 - 3 * s)),
      d11(s * (3 * s - 2))
  {
  }
};

}   // namespace slender
