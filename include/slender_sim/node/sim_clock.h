#pragma once

#include <cstdint>

#include <ros/time.h>

namespace slender {

/// Simulated time in ROS stamps: start + ticks * step, rounded once to integer nanoseconds, so that it never drifts and
/// two runs with the same start stamp alike. Only moves forward: a reset of the scene does not turn it back.
class SimClock
{
public:
  SimClock() = default;
  /// `start` above zero; `step` [s] > 0.
  SimClock(ros::Time start, double step) : start_ns_(start.toNSec()), step_(step) {}

  std::uint64_t ticks() const { return ticks_; }
  void tick() { ++ticks_; }
  void skip(std::uint64_t ticks) { ticks_ += ticks; }

  ros::Time start() const { return ros::Time().fromNSec(start_ns_); }
  ros::Time stamp() const { return stampAt(ticks_); }
  ros::Time nextStamp() const { return stampAt(ticks_ + 1); }
  /// Simulated seconds since start.
  double seconds() const { return static_cast<double>(ticks_) * step_; }
  double step() const { return step_; }
  /// Seconds from start to a stamp (negative before it); doubles counted from 1970 would be too coarse for velocities.
  double secondsAt(const ros::Time& stamp) const
  {
    return static_cast<double>(static_cast<std::int64_t>(stamp.toNSec()) - static_cast<std::int64_t>(start_ns_)) * 1e-9;
  }

private:
  ros::Time stampAt(std::uint64_t ticks) const
  {
    const long double ns = static_cast<long double>(ticks) * static_cast<long double>(step_) * 1e9L;
    return ros::Time().fromNSec(start_ns_ + static_cast<std::uint64_t>(std::llroundl(ns)));
  }

  std::uint64_t start_ns_ = 1, ticks_ = 0;
  double step_ = 1.0;
};

}   // namespace slender
