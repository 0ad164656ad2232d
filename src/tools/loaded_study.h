#pragma once

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "report_page.h"
#include "slender_sim/study/study.h"

namespace slender {

/// A study's result as its file tells it.
struct LoadedStudy
{
  bool found = false;                                    ///< there is a result
  std::vector<std::pair<std::string, double>> metrics;   ///< NaN: not a number
  std::deque<study::Row> rows;
  std::vector<std::string> notes;
  double seconds = 0.0;
  std::string error;   ///< why the study failed; empty if it did not
};

/// Reads FOLDER/result.json. A file that cannot be read is an error of the result.
LoadedStudy loadStudy(const ReportedStudy& study);

/// Returns true if the whole text is a number.
bool isNumber(const std::string& text, double& value);

}   // namespace slender
