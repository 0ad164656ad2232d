#pragma once

#include <string>
#include <vector>

#include "slender_sim/study/study.h"

namespace slender::study {

/// A limit that a metric of a study has to meet.
struct Bar
{
  enum class Sense
  {
    at_most,
    at_least
  };
  /// Timings depend on the machine and its load. Reports show timings beside their bars, but tests do not judge them.
  enum class Kind
  {
    result,
    timing
  };
  /// Some limits belong to the full form only, because the quick form is too coarse to meet them.
  enum class Form
  {
    both,
    full
  };

  std::string study;    ///< empty: every study that has this metric
  std::string metric;   ///< a `*` at the end stands for any ending
  Sense sense = Sense::at_most;
  double limit = 0.0;
  Kind kind = Kind::result;
  Form form = Form::both;

  /// Returns true if `metric` stands for this name of a metric.
  bool concerns(const std::string& name) const;
  /// Returns false for a value that is not a number.
  bool metBy(double value) const { return sense == Sense::at_most ? value <= limit : value >= limit; }
};

/// All bars. A bar of a named study comes before the bars of every study.
const std::vector<Bar>& bars();

/// Returns the bar of this metric, or nullptr if the metric has none.
const Bar* findBar(const std::string& study, const std::string& metric);

/// Judges a finished study: all rows with a check must be within their bounds, and all metrics with a bar must meet it,
/// timings excepted. Returns one sentence per failure. A study in which nothing can fail, or that lacks a metric with a
/// bar of its own, fails.
std::vector<std::string> judge(const StudyContext& context);

}   // namespace slender::study
