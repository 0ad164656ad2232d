#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "slender_sim/study/study.h"

namespace slender::study {

/// A finished (or failed) run of one study.
struct StudyResult
{
  const StudyContext* context;
  double wall_seconds;
  std::string error;   ///< empty unless the study threw
};

/// Aligned table of all rows, then metrics and notes.
void printTable(std::ostream& out, const StudyContext& context);

/// {"studies": [{"name", "metrics": {}, "rows": [], "wall_seconds"}]}; numbers that are not finite become null.
void writeJson(std::ostream& out, const std::vector<StudyResult>& results);

/// One line per row; the header is the union of all keys.
void writeCsv(std::ostream& out, const StudyContext& context);

/// As in writeCsv: quoted where need be; a row's value as text, empty when it has none.
std::string csvCell(const std::string& text);
/// the other way, of a line without line breaks in its cells
std::vector<std::string> csvCells(const std::string& line);
std::string valueText(const Row& row, const std::string& key);

/// Writes DIR/NAME.gp for every plot and lets gnuplot turn it into DIR/NAME.png.
/// Returns an empty string, or why there are no pictures (the scripts are kept).
std::string writePlots(const std::string& directory, const StudyContext& context);

}   // namespace slender::study
