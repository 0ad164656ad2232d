#include "slender_sim/node/drop_counter.h"

#include <numeric>

#include <ros/console.h>

namespace slender {

const char* toString(Drop reason)
{
  switch (reason)
  {
    case Drop::not_finite: return "not_finite";
    case Drop::bad_quaternion: return "bad_quaternion";
    case Drop::wrong_length: return "wrong_length";
    case Drop::unknown_name: return "unknown_name";
    case Drop::bad_frame: return "bad_frame";
    case Drop::no_transform: return "no_transform";
    case Drop::out_of_order: return "out_of_order";
    case Drop::stale: return "stale";
    case Drop::from_future: return "from_future";
    case Drop::out_of_range: return "out_of_range";
    case Drop::queue_full: return "queue_full";
  }
  return "?";
}

void DropCounter::drop(Drop reason, const std::string& what, const std::string& detail)
{
  ++counts_[static_cast<int>(reason)];
  const auto now = std::chrono::steady_clock::now();
  if (last_warning_.time_since_epoch().count() != 0 && now - last_warning_ < std::chrono::seconds(1))
  {
    ++silent_;
    return;
  }
  ROS_WARN("%s: dropped (%s)%s%s; %lu more since the last warning, %lu in all", what.c_str(), toString(reason),
           detail.empty() ? "" : ": ", detail.c_str(), static_cast<unsigned long>(silent_), static_cast<unsigned long>(total()));
  last_warning_ = now;
  silent_ = 0;
}

std::uint64_t DropCounter::total() const { return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0}); }

}  // namespace slender
