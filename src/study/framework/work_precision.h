#pragma once

#include <string>
#include <vector>

#include "slender_sim/study/study.h"

namespace slender::study {

/// Error against run time of ways to solve one problem: the same norm and reference for all, errors at the same
/// simulated time.
class WorkPrecision
{
public:
  /// `scale`: what an error of 100 % is, in the unit of the errors (`error_label` names it). Adds a plot.
  WorkPrecision(StudyContext& context, const std::string& name, const std::string& problem,
                const std::string& error_label, double scale);

  /// `row` holds the run: error and CPU seconds per simulated second are set there. Series of the plot are `method`s;
  /// `counts`: false for runs that the front shall not be made of.
  void add(Row& row, const std::string& method, const std::string& setting, double error, double cpu_per_second,
           bool counts = true);

  /// Marks what no other run beats in both error and time as the front, in its rows and in the plot, and notes which
  /// way is fastest for errors of 10 %, 1 %, 0.1 % ...
  void conclude();

private:
  struct Run
  {
    Row* row;
    std::string method, setting;
    double error, cpu_per_second;
  };

  StudyContext& context_;
  Plot& plot_;
  std::string problem_;
  double scale_;
  std::vector<Run> runs_;
};

}   // namespace slender::study
