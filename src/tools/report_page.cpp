#include "report_page.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>

#include "study/framework/whole_file.h"
#include "loaded_study.h"
#include "markup.h"
#include "slender_sim/study/bars.h"
#include "slender_sim/study/output.h"

namespace slender {

namespace {

namespace fs = std::filesystem;

const char kStyle[] =
    "body{font:15px/1.5 sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}"
    "h1{border-bottom:3px solid #246}h2{margin-top:2.5em;border-bottom:1px solid #999}h3{margin:2em 0 .3em}"
    "table{border-collapse:collapse;font-size:13px;margin:.7em 0}td,th{border:1px solid #ccc;padding:2px "
    "7px;text-align:left}"
    "th{background:#eef2f6;position:sticky;top:0}td.n{text-align:right;font-variant-numeric:tabular-nums}"
    "img{max-width:100%;border:1px solid #ddd;margin:.5em "
    "0}.wide{overflow:auto;max-height:32em}.bad{color:#b00020;font-weight:bold}"
    ".good{color:#166534}.words{color:#444}summary{cursor:pointer;color:#246}nav a{margin-right:1.2em}";

std::string base64(const std::string& bytes)
{
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve(4 * (bytes.size() + 2) / 3);
  for (std::size_t i = 0; i < bytes.size(); i += 3)
  {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      out += k <= left ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string cell(double value)
{
  if (std::isnan(value))
    return "<td>not a number</td>";
  char number[32];
  std::snprintf(number, sizeof number, "%.4g", value);
  return std::string("<td class=n>") + number + "</td>";
}

std::string cell(const std::string& text)
{
  double value = 0.0;
  return isNumber(text, value) ? cell(value) : "<td>" + escaped(text) + "</td>";
}

/// Returns two table cells with the bar of a metric and whether the value meets it, or nothing if the metric has no
/// bar.
std::string rating(const std::string& study, const std::string& metric, double value)
{
  const study::Bar* bar = study::findBar(study, metric);
  if (!bar)
    return "";
  const char* sense = bar->sense == study::Bar::Sense::at_least ? "at least" : bar->limit == 0 ? "" : "at most";
  char text[48];
  std::snprintf(text, sizeof text, "<td class=n>%s %g</td>", sense, bar->limit);
  return text + std::string(bar->metBy(value) ? "<td class=good>met</td>" : "<td class=bad>missed</td>");
}

void writeRows(std::ostream& page, const std::string& csv)
{
  std::istringstream lines(wholeFile(csv));
  std::string line;
  std::size_t rows = 0;
  std::ostringstream table;
  while (std::getline(lines, line))
  {
    table << "<tr>";
    for (const std::string& text : study::csvCells(line))
      table << (rows == 0 ? "<th>" + escaped(text) + "</th>" : cell(text));
    table << "</tr>\n";
    ++rows;
  }
  if (rows > 1)
    page << "<details" << (rows <= 25 ? " open" : "") << "><summary>" << rows - 1
         << " rows</summary><div class=wide><table>\n"
         << table.str() << "</table></div></details>\n";
}

void writeStudy(std::ostream& page, const ReportedStudy& study, const LoadedStudy& loaded)
{
  page << "<h3 id=\"" << escaped(study.name) << "\">" << escaped(study.name) << "</h3>\n<p class=words>"
       << escaped(study.description) << "</p>\n";
  if (!loaded.error.empty())
    page << "<p class=bad>failed: " << escaped(loaded.error) << "</p>\n";
  std::vector<std::string> pictures;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(study.folder, error))
    if (entry.path().extension() == ".png")
      pictures.push_back(entry.path().string());
  std::sort(pictures.begin(), pictures.end());
  for (const std::string& picture : pictures)
    page << "<img alt=\"" << escaped(fs::path(picture).stem().string()) << "\" src=\"data:image/png;base64,"
         << base64(wholeFile(picture)) << "\">\n";
  if (!loaded.metrics.empty())
  {
    page << "<table>";
    for (const auto& [key, value] : loaded.metrics)
      page << "<tr><td>" << escaped(key) << "</td>" << cell(value)
           << (std::isnan(value) ? "" : rating(study.name, key, value)) << "</tr>\n";
    page << "</table>\n";
  }
  if (!loaded.notes.empty())
  {
    page << "<ul>";
    for (const std::string& note : loaded.notes)
      page << "<li>" << escaped(note) << "</li>\n";
    page << "</ul>\n";
  }
  writeRows(page, study.folder + "/" + study.name + ".csv");
  if (loaded.seconds > 0)
  {
    char text[48];
    std::snprintf(text, sizeof text, "<p class=words>took %.1f s</p>\n", loaded.seconds);
    page << text;
  }
}

}   // namespace

std::string reportPage(const std::string& title, const std::vector<std::pair<std::string, std::string>>& facts,
                       const std::vector<ReportSection>& sections)
{
  std::map<std::string, LoadedStudy> loaded;
  for (const ReportSection& section : sections)
    for (const ReportedStudy& study : section.studies)
      loaded[study.name] = loadStudy(study);

  std::ostringstream page;
  page << "<!DOCTYPE html>\n<html lang=en><head><meta charset=utf-8><title>" << escaped(title) << "</title><style>"
       << kStyle << "</style></head><body>\n<h1>" << escaped(title) << "</h1>\n<table>";
  for (const auto& [key, text] : facts)
    page << "<tr><td>" << escaped(key) << "</td><td>" << escaped(text) << "</td></tr>\n";
  page << "</table>\n<nav><a href=\"#advice\">Advice</a><a href=\"#bars\">Bars</a>";
  for (std::size_t k = 0; k < sections.size(); ++k)
    page << "<a href=\"#section" << k << "\">" << escaped(sections[k].title) << "</a>";
  page << "</nav>\n<h2 id=advice>What to take</h2>\n<p class=words>From the fronts of error against run time below; "
          "errors against each problem's own "
          "size, CPU time of one thread of this machine.</p><ul>\n";
  for (const ReportSection& section : sections)
    for (const ReportedStudy& study : section.studies)
      for (const std::string& note : loaded[study.name].notes)
        if (note.find(" error take ") != std::string::npos)
          page << "<li>" << escaped(note) << "</li>\n";
  page << "</ul>\n<h2 id=bars>Bars</h2>\n<p class=words>worst_error_over_bound: the largest error of a study's checks "
          "over its bound.</p>\n<table>"
          "<tr><th>study</th><th>figure</th><th>measured</th><th>bar</th><th></th></tr>\n";
  for (const ReportSection& section : sections)
    for (const ReportedStudy& study : section.studies)
    {
      const LoadedStudy& result = loaded[study.name];
      if (!result.error.empty())
        page << "<tr><td><a href=\"#" << escaped(study.name) << "\">" << escaped(study.name)
             << "</a></td><td colspan=4 class=bad>failed</td></tr>\n";
      for (const auto& [key, value] : result.metrics)
      {
        const std::string verdict =
            std::isnan(value) ? "<td></td><td class=bad>not a number</td>" : rating(study.name, key, value);
        if (!verdict.empty())
          page << "<tr><td><a href=\"#" << escaped(study.name) << "\">" << escaped(study.name) << "</a></td><td>"
               << escaped(key) << "</td>" << cell(value) << verdict << "</tr>\n";
      }
    }
  page << "</table>\n";
  for (std::size_t k = 0; k < sections.size(); ++k)
  {
    page << "<h2 id=\"section" << k << "\">" << escaped(sections[k].title) << "</h2>\n<p class=words>"
         << escaped(sections[k].words) << "</p>\n";
    for (const ReportedStudy& study : sections[k].studies)
      writeStudy(page, study, loaded[study.name]);
  }
  page << "</body></html>\n";
  return page.str();
}

}   // namespace slender
