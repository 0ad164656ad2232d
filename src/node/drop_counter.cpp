#include "slender_sim/node/drop_counter.h"

#include <cmath>
#include <numeric>

#include <ros/console.h>

namespace slender {

const char* toString(Drop reason)
{
  static const char* const words[kDropReasons] = {"not_finite",  "bad_quaternion", "wrong_length", "unknown_name",
                                                  "bad_frame",   "no_transform",   "out_of_order", "stale",
                                                  "from_future", "out_of_range",   "queue_full"};
  return words[static_cast<int>(reason)];
}

void DropCounter::drop(Drop reason, const std::string& what, const std::string& detail)
{
  Reason& r = reasons_[static_cast<int>(reason)];
  ++r.count;
  r.last = what + (detail.empty() ? "" : ": " + detail);
  const auto now = std::chrono::steady_clock::now();
  if (r.warned.time_since_epoch().count() != 0 && now - r.warned < std::chrono::seconds(1))
  {
    ++r.silent;
    return;
  }
  ROS_WARN("%s: dropped (%s)%s%s; %lu more for this reason since the last warning, %lu in all", what.c_str(),
           toString(reason), detail.empty() ? "" : ": ", detail.c_str(), static_cast<unsigned long>(r.silent),
           static_cast<unsigned long>(r.count));
  r.warned = now;
  r.silent = 0;
}

void DropCounter::dropByStamp(bool stale, const std::string& what, double ahead)
{
  drop(stale ? Drop::stale : Drop::from_future, what,
       "its stamp is " + std::to_string(std::abs(ahead)) + " s " +
           (stale ? "before the simulated time (~guide_timeout)" : "after the simulated time (~guide_ahead)"));
}

void DropCounter::keep(const std::string& what)
{
  if (told_of_kept_)
    return;
  told_of_kept_ = true;
  ROS_INFO("%s: the simulation stands still; the last messages are kept, and count when it goes on", what.c_str());
}

std::uint64_t DropCounter::total() const
{
  return std::accumulate(reasons_.begin(), reasons_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const Reason& r) { return sum + r.count; });
}

}   // namespace slender
