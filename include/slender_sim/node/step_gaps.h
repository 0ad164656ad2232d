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
  // how often instants are so many steps apart, and when first; shortest and longest time, and when that began [s]
  struct Stride
  {
    std::uint64_t count = 0;
    double first, least, most, most_at;
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
