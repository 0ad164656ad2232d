#include "slender_sim/node/step_gaps.h"

#include <algorithm>

#include "slender_sim/dynamics/failure_place.h"

namespace slender {
namespace {

// times the median: jitter of a sensor stays below, one lost message of a steady stream is 2, two are 3
constexpr double kLongInterval = 2.5;

std::string number(double value) { return shortNumber(value, 6); }

}   // namespace

void StepGaps::add(std::uint32_t epoch, std::uint64_t step, double seconds)
{
  if (last_ && last_->epoch == epoch && step > last_->step)
  {
    const std::uint64_t stride = step - last_->step;
    const double time = seconds - last_->seconds;
    Stride& same = strides_.try_emplace(stride, Stride{0, last_->seconds, time, time, last_->seconds}).first->second;
    ++same.count;
    if (time > same.most)
    {
      same.most = time;
      same.most_at = last_->seconds;
    }
    same.least = std::min(same.least, time);
  }
  last_ = Instant{epoch, step, seconds};
}

std::string StepGaps::text(double step_length) const
{
  if (strides_.empty())
    return "";
  const std::uint64_t usual = strides_.begin()->first;   // ~state_every; gaps are longer
  std::uint64_t lost = 0, places = 0;
  double first = 0.0;
  for (const auto& [stride, found] : strides_)
    if (stride > usual)
    {
      lost += (stride / usual - 1) * found.count;
      first = places == 0 ? found.first : std::min(first, found.first);
      places += found.count;
    }
  std::string out;
  if (places > 0)
    out = std::to_string(lost) + " recorded instants are missing in " + std::to_string(places) +
          " places, first after " + number(first) + " s; a node's own bag (~record_bag) lacks none. ";
  double skipped = 0.0, at = 0.0;
  for (const auto& [stride, pace] : strides_)
  {
    const double expected = step_length > 0.0 ? step_length * static_cast<double>(stride) : pace.least;
    const double extra = pace.most - expected;
    if (extra > 0.5 * expected / static_cast<double>(stride) + 1e-6 && extra > skipped)
    {
      skipped = extra;
      at = pace.most_at;
    }
  }
  if (skipped > 0.0)
    out += "The stamps skip up to " + number(skipped) + " s between two steps, after " + number(at) +
           " s: the node was paused, or fell behind (~max_lag). ";
  return out.empty() ? out : out.substr(0, out.size() - 1);
}

std::string IntervalGaps::text() const
{
  if (times_.size() < 4)
    return "";
  std::vector<double> sorted;
  for (std::size_t k = 1; k < times_.size(); ++k)
    sorted.push_back(times_[k] - times_[k - 1]);
  const std::vector<double> intervals = sorted;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  std::size_t places = 0, first = 0;
  for (std::size_t k = 0; k < intervals.size(); ++k)
    if (intervals[k] > kLongInterval * usual && places++ == 0)
      first = k;
  if (places == 0)
    return "";
  return std::to_string(places) + " intervals between its messages are longer than " + number(kLongInterval) +
         " times the usual " + number(usual) + " s, the first one " + number(intervals[first]) + " s after " +
         number(times_[first]) + " s; the motion is interpolated over them.";
}

}   // namespace slender
