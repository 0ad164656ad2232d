#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace slender {

/// Finds out which steps a recorded run lacks: topics drop messages, and the clock of a node may skip.
class StepGaps
{
public:
  /// The next recorded instant: its epoch and step, and its stamp in seconds since the first one.
  void add(std::uint32_t epoch, std::uint64_t step, double seconds);
  /// What is missing, in one or two sentences; empty when nothing is. `step_length` [s] > 0 tells skipped time from
  /// lost steps; 0: not known.
  std::string text(double step_length) const;

private:
  struct Instant
  {
    std::uint32_t epoch;
    std::uint64_t step;
    double seconds;
  };
  // Of instants that are the same number of steps apart.
  struct Stride
  {
    std::uint64_t count = 0;
    double first, least, most, most_at;   // [s] when first; shortest and longest time between; when the longest began
  };
  std::optional<Instant> last_;
  std::map<std::uint64_t, Stride> strides_;
};

/// The same for messages without step numbers: intervals that are much longer than the usual one.
class IntervalGaps
{
public:
  void add(double seconds) { times_.push_back(seconds); }
  std::string text() const;

private:
  std::vector<double> times_;
};

}   // namespace slender
