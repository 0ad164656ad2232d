#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace slender {

/// What PoseTrajectory and PointTrajectory have in common: timed samples, and how the motion begins and ends.
template <class Sample>
class SampledMotion
{
public:
  /// After the last sample the motion goes on with the mean velocity since the one before, which dies out linearly
  /// within `duration` [s] (>= 0; 0: held).
  void coast(double duration) { coast_ = duration; }
  /// From now on more samples may come: two equal ones at the end may be the turning point of a swing, and are no pause
  /// yet.
  void expectMore() { growing_ = true; }
  /// Says that the samples may begin and end in the middle of a motion. If the first or last interval is shorter than
  /// `interval` [s], the slope at this end is that of the parabola through the three outermost samples, but at most the
  /// slope of the neighbouring sample. With 0 both ends are at rest. Outside of the samples the motion is held in any
  /// case, so that the velocity jumps at such an end.
  void cutWithin(double interval) { cut_ = interval; }
  /// Forgets samples that no query at or after `time` needs.
  void forgetBefore(double time)
  {
    // The segment of `time` starts at the last sample not after it. The slope there needs one sample more, and up to
    // three where it may be in a pause.
    const auto after = std::upper_bound(times_.begin(), times_.end(), time) - times_.begin();
    const auto drop = std::max<std::ptrdiff_t>(0, after - 4);
    times_.erase(times_.begin(), times_.begin() + drop);
    samples_.erase(samples_.begin(), samples_.begin() + drop);
  }

  bool empty() const { return times_.empty(); }
  /// Times [s] of the samples that were given and not forgotten.
  const std::vector<double>& times() const { return times_; }

protected:
  /// Slope at sample k by differences. between(a, b) is the difference of sample b from sample a, in the axes of sample
  /// a. Two samples are equal if their difference is at most `same`. The definition is in src/geometry/hermite.h.
  template <class Between>
  Eigen::Vector3d slope(std::size_t k, double same, const Between& between) const;

  std::vector<double> times_;
  std::vector<Sample> samples_;
  double coast_ = 0.0, cut_ = 0.0;
  bool moving_start_ = false;   ///< see PointTrajectory::startInMotion()
  bool growing_ = false;        ///< see expectMore()
};

}   // namespace slender
