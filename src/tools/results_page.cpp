#include "results_page.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "loaded_study.h"
#include "slender_sim/study/bars.h"
#include "slender_sim/study/headlines.h"

namespace slender {

namespace {

using study::Bar;
using study::Figure;
using study::Headline;

constexpr std::size_t kColumns = 100;   // of a line outside tables
const char kTableHead[] =
    "| Study | Figure | Measured | Target; compared with | Met | What it means |\n|---|---|---|---|---|---|\n";

/// Returns the text in lines of at most kColumns, ending with an empty line.
std::string paragraph(const std::string& text)
{
  std::istringstream words(text);
  std::string out, word;
  std::size_t column = 0;
  while (words >> word)
  {
    const bool fits = column + 1 + word.size() <= kColumns;
    out += column == 0 ? "" : fits ? " " : "\n";
    column = column == 0 || !fits ? word.size() : column + 1 + word.size();
    out += word;
  }
  return out + "\n\n";
}

/// Returns the text as the content of a cell.
std::string cell(const std::string& text)
{
  std::string out;
  for (const char c : text)
    out += c == '|' ? "\\|" : c == '\n' ? " " : std::string(1, c);
  return out;
}

std::string tableRow(const std::vector<std::string>& cells)
{
  std::string row = "|";
  for (const std::string& text : cells)
    row += " " + cell(text) + " |";
  return row + "\n";
}

/// The bar of a figure in this form of the study, or nullptr.
const Bar* barOf(const std::string& study, const Figure& figure, bool quick)
{
  const Bar* bar = figure.from == Figure::From::metric ? study::findBar(study, figure.key) : nullptr;
  return bar && !(quick && bar->form == Bar::Form::full) ? bar : nullptr;
}

bool met(const Bar& bar, const study::FigureValue& value)
{
  return value.found && bar.metBy(value.least) && bar.metBy(value.most);   // false for NaN
}

/// Returns the figure's value, a range where it has several values, in bold where it misses its target.
std::string measured(const Figure& figure, const study::Unit& unit, const study::FigureValue& value, const Bar* bar)
{
  const auto text = [&](double number) {
    return bar ? study::printed(number, unit, *bar) : study::printed(number, unit);
  };
  std::string out = "missing";
  if (value.found)
  {
    out = text(value.most);
    if (const std::string least = text(value.least); least != out)
      out =
          (least.size() > std::string(unit.name).size() ? least.substr(0, least.size() - std::string(unit.name).size())
                                                        : least) +
          " to " + out;
  }
  if (bar && !met(*bar, value))
    out = "**" + out + "**";
  return (figure.label.empty() ? "" : figure.label + " ") + out;
}

struct Counts
{
  int met = 0, missed = 0, not_measured = 0, studies = 0, absent = 0;
  std::vector<std::string> misses;   ///< study, metric
};

/// Returns true if the quick form does not have this metric.
bool onlyOfTheFullForm(const std::string& study, const std::string& metric)
{
  return std::any_of(study::headlines().begin(), study::headlines().end(), [&](const Headline& h) {
    return h.study == study && h.form == Bar::Form::full &&
           std::any_of(h.figures.begin(), h.figures.end(), [&](const Figure& f) { return f.key == metric; });
  });
}

/// All targets of a study and whether its result meets them: those of its metrics, of its headlines, and bars of its
/// own that have no metric.
void count(const std::string& name, const LoadedStudy& result, bool quick, Counts& counts)
{
  std::map<std::string, bool> targets;
  for (const Headline& headline : study::headlines())
    if (headline.study == name && !(quick && headline.form == Bar::Form::full))
      for (const Figure& figure : headline.figures)
        if (barOf(name, figure, quick) && !study::valueOf(figure, {result.metrics, result.rows}).found)
          targets[figure.key] = false;
  for (const Bar& bar : study::bars())
    if (bar.study == name && !(quick && (bar.form == Bar::Form::full || onlyOfTheFullForm(name, bar.metric))) &&
        !study::valueOf({bar.metric}, {result.metrics, result.rows}).found)
      targets[bar.metric] = false;
  for (const auto& [metric, value] : result.metrics)
    if (const Bar* bar = study::findBar(name, metric); bar && !(quick && bar->form == Bar::Form::full))
      targets[metric] = bar->metBy(value);
  if (!result.found)
    counts.not_measured += static_cast<int>(targets.size());
  else
    for (const auto& [metric, good] : targets)
    {
      ++(good ? counts.met : counts.missed);
      if (!good)
        counts.misses.push_back("`" + name + "` (`" + metric + "`)");
    }
}

/// Returns the rows of a study: its headlines, and targets that it misses beside them.
std::string rowsOf(const ReportedStudy& reported, const LoadedStudy& result, bool quick)
{
  const std::string& name = reported.name;
  const std::string absent = std::filesystem::exists(reported.folder) ? "did not end" : "not in this report";
  std::string rows;
  for (const Headline& headline : study::headlines())
  {
    if (headline.study != name)
      continue;
    const bool asked = !(quick && headline.form == Bar::Form::full);
    std::string values, verdict = "-";
    std::vector<std::string> targets;
    for (const Figure& figure : headline.figures)
    {
      const Bar* bar = barOf(name, figure, quick);
      const study::FigureValue value = study::valueOf(figure, {result.metrics, result.rows});
      values += (values.empty() ? "" : ", ") + measured(figure, headline.unit, value, result.found ? bar : nullptr);
      const Bar* any = figure.from == Figure::From::metric ? study::findBar(name, figure.key) : nullptr;
      if (any)
      {
        const std::string text = study::printedTarget(*any, headline.unit) +
                                 (any->kind == Bar::Kind::timing ? " (time)" : "") +
                                 (any->form == Bar::Form::full && quick ? " (full form)" : "");
        if (std::find(targets.begin(), targets.end(), text) == targets.end())
          targets.push_back(text);
      }
      if (bar && asked)
        verdict = met(*bar, value) && verdict != "no" ? "yes" : "no";
    }
    if (!result.found || !asked)
      verdict = "-";
    std::string compared;
    for (const std::string& target : targets)
      compared += (compared.empty() ? "" : ", ") + target;
    if (!headline.peer.empty())
      compared += (compared.empty() ? "" : "; ") + headline.peer;
    rows += tableRow({"`" + name + "`", headline.what,
                      !result.found ? absent
                      : asked       ? values
                                    : "not in the quick form",
                      compared, verdict, headline.meaning});
  }
  const auto shown = [&](const std::string& metric) {
    return std::any_of(study::headlines().begin(), study::headlines().end(), [&](const Headline& h) {
      return h.study == name && std::any_of(h.figures.begin(), h.figures.end(), [&](const Figure& f) {
               return f.from == Figure::From::metric && Bar{"", f.key}.concerns(metric);
             });
    });
  };
  for (const auto& [metric, value] : result.metrics)
    if (const Bar* bar = study::findBar(name, metric);
        bar && !(quick && bar->form == Bar::Form::full) && !bar->metBy(value) && !shown(metric))
      rows += tableRow({"`" + name + "`", "`" + metric + "`",
                        "**" + study::printed(value, {1.0, "", value == std::floor(value) ? 0 : 3}, *bar) + "**",
                        study::printedTarget(*bar, {}), "no", "A further target of this study, which it misses."});
  if (!result.error.empty())
    rows += tableRow({"`" + name + "`", "the study itself", "**failed**: " + result.error, "", "no",
                      "What is missing above was not measured."});
  return rows;
}

std::string introduction(const Counts& counts, bool quick,
                         const std::vector<std::pair<std::string, std::string>>& facts)
{
  std::string text =
      "# Results\n\n" +
      paragraph(
          "What the studies of this package measured, beside what was asked of them and what others published. "
          "[Studies](studies.md) says what each of them does and how to run it; "
          "[references](references.md) has the publications, and *thesis* is that of Bergou, 2010.") +
      paragraph(
          "`study report` writes this page as `results.md` beside its `report.html`, and `study results DIR` "
          "writes it again from what is in `DIR`. It is not edited by hand.") +
      "    rosrun slender_sim study report --out out/report\n    cp out/report/results.md docs/results.md\n\n"
      "## Targets\n\n";
  std::string sum = "Of " + std::to_string(counts.met + counts.missed) + " targets, **" + std::to_string(counts.met) +
                    " are met and " + std::to_string(counts.missed) + " are missed**.";
  if (counts.absent > 0)
    sum += " Studies that are not in this report: " + std::to_string(counts.absent) + " of " +
           std::to_string(counts.studies) + ". Targets of these studies: " + std::to_string(counts.not_measured) + ".";
  text += paragraph(sum);
  if (!counts.misses.empty())
  {
    std::string list = "Missed:";
    for (const std::string& miss : counts.misses)
      list += (&miss == &counts.misses.front() ? " " : ", ") + miss;
    text += paragraph(list + ". Their rows below have the values in bold.");
  }
  if (quick)
    text += paragraph(
        "**These are results of the quick form**, which has fewer and coarser cases. Targets of the full "
        "form are not judged.");
  text += paragraph(
      "What a figure means, in the last column, holds where its target is met. A value that is not a number "
      "meets no target. Targets marked *time* depend on the machine and its "
      "load. *Of the bound*: the largest error of all checks of a study over the bound that the study "
      "sets for it; at most 1 when all hold.");
  if (facts.empty())
    return text + paragraph("The report does not say which program and machine made it.");
  text += "| | |\n|---|---|\n";
  for (const auto& [key, value] : facts)
    text += tableRow({key, value});
  return text + "\n";
}

std::string handMeasuredTable()
{
  std::string text = "## Measured by hand\n\n" +
                     paragraph(
                         "These figures are not from the report: their programs need a ROS master or another "
                         "build. They are those of the version that is named.") +
                     "| Program | Figure | Measured | Target; compared with | Version | What it means |\n"
                     "|---|---|---|---|---|---|\n";
  for (const study::HandMeasured& m : study::handMeasured())
    text += tableRow({"`" + m.program + "`", m.what, m.measured, m.peer, m.version, m.meaning});
  return text;
}

}   // namespace

std::string resultsPage(const std::vector<std::pair<std::string, std::string>>& facts, bool quick,
                        const std::vector<ReportSection>& sections)
{
  Counts counts;
  std::string tables;
  for (const ReportSection& section : sections)
  {
    tables += "## " + section.title + "\n\n" + (section.words.empty() ? "" : paragraph(section.words)) + kTableHead;
    for (const ReportedStudy& reported : section.studies)
    {
      const LoadedStudy result = loadStudy(reported);
      ++counts.studies;
      counts.absent += result.found ? 0 : 1;
      count(reported.name, result, quick, counts);
      tables += rowsOf(reported, result, quick);
    }
    tables += "\n";
  }
  return introduction(counts, quick, facts) + tables + handMeasuredTable();
}

}   // namespace slender
