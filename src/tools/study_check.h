#pragma once

#include <string>
#include <vector>

namespace slender {

struct StudyCheckOptions
{
  std::vector<std::string> only;   ///< names of studies; empty: every study
  std::string xml;                 ///< file for the results in JUnit's format; empty: none
  long jobs = 1;                   ///< studies at a time
};

/// Runs the quick form of each study as a process of its own (`study run NAME --quick --judge`) and prints one line per
/// study. The output of a failed study follows its line. Returns the number of studies that failed. Throws BadInput for
/// names of no study and for an XML file that cannot be written.
int checkStudies(const StudyCheckOptions& options);

}   // namespace slender
