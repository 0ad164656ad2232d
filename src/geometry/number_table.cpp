#include "slender_sim/geometry/number_table.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace slender {

NumberTable::NumberTable(std::vector<Entry> entries) : entries_(std::move(entries))
{
  if (entries_.empty())
    throw std::invalid_argument("table: give at least one entry");
  for (std::size_t k = 0; k < entries_.size(); ++k)
  {
    const Entry& e = entries_[k];
    if (!std::isfinite(e.time) || !std::isfinite(e.value))
      throw std::invalid_argument("table: entry " + std::to_string(k) + ": time and value must be finite");
    if (k > 0 && e.time <= entries_[k - 1].time)
      throw std::invalid_argument("table: entry " + std::to_string(k) + ": times must rise");
  }
}

double NumberTable::at(double time) const
{
  const auto after =
      std::upper_bound(entries_.begin(), entries_.end(), time, [](double t, const Entry& e) { return t < e.time; });
  if (after == entries_.begin())
    return entries_.front().value;
  if (after == entries_.end())
    return entries_.back().value;
  const Entry& before = *(after - 1);
  return before.value + (after->value - before.value) * (time - before.time) / (after->time - before.time);
}

double NumberTable::greatest() const
{
  return std::max_element(entries_.begin(), entries_.end(),
                          [](const Entry& a, const Entry& b) { return a.value < b.value; })
      ->value;
}

double NumberTable::mean(double start, double end) const
{
  double volume = 0.0, from = start;
  for (const Entry& e : entries_)
    if (e.time > start && e.time < end)
    {
      volume += 0.5 * (at(from) + e.value) * (e.time - from);
      from = e.time;
    }
  volume += 0.5 * (at(from) + at(end)) * (end - from);
  return volume / (end - start);
}

}   // namespace slender
