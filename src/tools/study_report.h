#pragma once

#include <string>
#include <vector>

namespace slender {

struct ReportOptions
{
  std::string out;                 ///< directory
  std::vector<std::string> only;   ///< names of studies; empty: all of the report
  bool quick = false;
  long jobs = 1;   ///< studies at a time
};

/// Runs the studies of the report, each as a process of its own (`study run NAME --json ... --out OUT/data/NAME`),
/// and writes OUT/report.html, which needs no other file, and OUT/results.md. A study whose result is in OUT already
/// does not run again, also if an earlier version of the package made the result; the pages name the version of each
/// result. Progress on stderr. Returns the number of studies that failed; the page names them. Throws BadInput when OUT
/// holds a report of the other extent, or cannot be written, and for names that the report has not.
int makeReport(const ReportOptions& options);

/// Writes DIR/results.md (see results_page.h) from the results that an earlier report left in DIR/data. Runs nothing.
/// Throws BadInput if DIR holds no report or cannot be written.
void writeResults(const std::string& directory);

}   // namespace slender
