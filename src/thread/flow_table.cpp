#include "slender_sim/thread/flow_table.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace slender {

FlowTable::FlowTable(std::vector<Entry> entries) : entries_(std::move(entries))
{
  if (entries_.empty())
    throw std::invalid_argument("flow table: give at least one entry");
  for (std::size_t k = 0; k < entries_.size(); ++k)
  {
    const Entry& e = entries_[k];
    if (!std::isfinite(e.time) || !std::isfinite(e.rate) || e.rate < 0)
      throw std::invalid_argument("flow table: entry " + std::to_string(k) + ": time must be finite, rate zero or more");
    if (k > 0 && e.time <= entries_[k - 1].time)
      throw std::invalid_argument("flow table: entry " + std::to_string(k) + ": times must rise");
  }
}

double FlowTable::at(double time) const
{
  const auto after = std::upper_bound(entries_.begin(), entries_.end(), time, [](double t, const Entry& e) { return t < e.time; });
  if (after == entries_.begin())
    return entries_.front().rate;
  if (after == entries_.end())
    return entries_.back().rate;
  const Entry& before = *(after - 1);
  return before.rate + (after->rate - before.rate) * (time - before.time) / (after->time - before.time);
}

double FlowTable::mean(double start, double end) const
{
  double volume = 0.0, from = start;
  for (const Entry& e : entries_)
    if (e.time > start && e.time < end)
    {
      volume += 0.5 * (at(from) + e.rate) * (e.time - from);
      from = e.time;
    }
  volume += 0.5 * (at(from) + at(end)) * (end - from);
  return volume / (end - start);
}

}  // namespace slender
