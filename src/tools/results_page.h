#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report_page.h"

namespace slender {

/// The page of results in Markdown, docs/results.md: for each study its headlines, measured values, targets, whether
/// they are met, and what they mean to a user. `sections` have all studies; a study without a result is listed as not
/// in the report. `quick`: the results are those of the quick form. `facts`: what made them; may be empty.
std::string resultsPage(const std::vector<std::pair<std::string, std::string>>& facts, bool quick,
                        const std::vector<ReportSection>& sections);

}   // namespace slender
