#pragma once

#include <string>
#include <vector>

namespace slender {

/// A study's results as its files tell them.
struct ReportedStudy
{
  std::string name, description;
  std::string folder;    ///< its JSON, CSV and plots; empty or without JSON: not run
  std::string failure;   ///< why there is no result
};

struct ReportSection
{
  std::string title, words;
  std::vector<ReportedStudy> studies;
};

/// The whole page: machine and versions, advice from the notes, a table of all bars, then the sections. Pictures are
/// part of it.
std::string reportPage(const std::string& title, const std::vector<std::pair<std::string, std::string>>& facts,
                       const std::vector<ReportSection>& sections);

}   // namespace slender
