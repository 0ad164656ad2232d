#pragma once

#include <vector>

namespace slender {

/// A nozzle's flow rate tabled over time: linear in between, constant before the first and after the last entry.
class FlowTable
{
public:
  struct Entry
  {
    double time;   ///< [s]
    double rate;   ///< [m^3/s]
  };
  /// Throws std::invalid_argument naming the entry: none at all, times that do not rise, rates that are negative or not finite.
  explicit FlowTable(std::vector<Entry> entries);

  double at(double time) const;
  /// Mean over a step from `start` to `end` [s], start < end: with it as ThreadInputs::flow_rate exactly the tabled volume flows.
  double mean(double start, double end) const;

private:
  std::vector<Entry> entries_;
};

}  // namespace slender
