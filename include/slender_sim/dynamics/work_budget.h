#pragma once

#include <algorithm>
#include <limits>

namespace slender {

/// What a step may do, in counts that stand for about a tenth of a microsecond each, so that one that gets out of hand
/// ends. Counts and no times: what is refused is the same on every machine and in every run.
class WorkBudget
{
public:
  /// Forgets what was done.
  void start(long most)
  {
    done_ = 0;
    most_ = most;
  }

  /// Returns false once all is spent.
  bool spend(long counts)
  {
    done_ += counts;
    return !spent();
  }
  bool spent() const { return done_ > most_; }

  /// Of a step of cloths of that many vertices in all; those of 1,500 vertices and less have the same.
  static long ofStep(long vertices) { return kPerVertex * std::max(vertices, 1500L); }

  long left() const { return std::max(0L, most_ - done_); }
  long done() const { return done_; }

  static constexpr long kUnbounded = std::numeric_limits<long>::max() / 4;

private:
  static constexpr long kPerVertex = 20000;

  long done_ = 0, most_ = kUnbounded;
};

}   // namespace slender
