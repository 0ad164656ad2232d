#pragma once

#include <vector>

namespace slender {

/// A number tabled over time: linear in between, constant before the first and after the last entry.
class NumberTable
{
public:
  struct Entry
  {
    double time;   ///< [s]
    double value;
  };
  /// Throws std::invalid_argument naming the entry: none at all, times that do not rise, numbers that are not finite.
  explicit NumberTable(std::vector<Entry> entries);

  double at(double time) const;
  double greatest() const;
  const std::vector<Entry>& entries() const { return entries_; }
  /// Mean over a step from `start` to `end` [s], start < end: of a flow rate: with it as ThreadInputs::flow_rate
  /// exactly the tabled volume flows.
  double mean(double start, double end) const;

private:
  std::vector<Entry> entries_;
};

}   // namespace slender
